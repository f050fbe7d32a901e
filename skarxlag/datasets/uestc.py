"""The UESTC bearing rig: four conditions at four shaft speeds."""

import os
from typing import Any

from skarxlag.datasets._repository import fetch_rig

REPOSITORY = (
    "https://raw.githubusercontent.com/ChangLiu2024/UESTC-Bearing-Dataset/"
    "782c6ddddcd63e0ef97019dbfeec9887e36bca1e"
)
SAMPLING_RATE = 20_000.0
DESCRIPTION = """\
UESTC bearing data set
======================

Vibration of a bearing housing (acceleration, one axis, piezoelectric sensor) on a laboratory rig
without load: ASAHI UCPH 20 bearings, normal (N), with a pit of 3 mm diameter on one ball (B), or
with a wire cut of 0.55 mm width and 1 mm depth in the inner (I) or the outer race (O), at nominal
shaft speeds of 800, 1000, 1200 and 1400 rpm, sampled at 20 kHz.

One bearing and one recording for each condition and speed. A recording was stored in five parts;
the first part of each is fetched: 262,144 samples, 13.1 s, 16 files of 2 MB. The amplitude is
physical. The real shaft speed differs from the nominal one by up to 8 %, and slightly between
conditions; the recording of the inner race at 1400 rpm has 66 clipped samples. Windows of one
recording are not independent: split it in time, never at random.

Terms of use, as its authors state them: the data set "is open-source and can be used for any
bearing fault detection research. Publications utilizing this dataset are required to cite the
following paper." It comes from the repository ChangLiu2024/UESTC-Bearing-Dataset.

C. Liu et al., "A New Target Domain One-Class Learning Bearing Fault Detection Framework", IEEE
Sensors Journal, 2025, doi 10.1109/JSEN.2025.3635217.
"""
CHECKSUMS = {
    "N_800_1.mat": "26f14f33a0d1af4dccbb10e6e3f2c47269d50668b48e23c487dcf7d7783ce5c9",
    "N_1000_1.mat": "e791529b67582a29e421d37ba576c607efd398841a2dbe088f21adcb53b6c437",
    "N_1200_1.mat": "5a3cfc32c62b105d2c95608471d2e4c9ffd758dcbc140c3d7127ef7773a76c95",
    "N_1400_1.mat": "93de079c543b744440ca27f77398b8c8d6791b7e104fcd08c3950d67788bd09e",
    "B_800_1.mat": "191bd9c8af058beb0612ce7a1025aa2b520e782471f1437f31bcb522af97bb45",
    "B_1000_1.mat": "e05224ccf783494c3fe63514001ec96d6b59bb322bc8a5ea97550ea7d8672bba",
    "B_1200_1.mat": "5ec02ef15e4346fc98021e2f75d3f840527fb7e6b13e03093d3158b1cb7c6535",
    "B_1400_1.mat": "eebbb612156d665cfcc939953c1bb7ed2d5f7045a96ea4211ee4e5cf326ac867",
    "I_800_1.mat": "2401c0e6546e1286ba918a8df4ea1e9fb30e15b3ca2f068f287e5d4023a80dd5",
    "I_1000_1.mat": "ec053b2de01834367fe43c83d1be9b3a1d6c846fd50941e1131aa3676d63e043",
    "I_1200_1.mat": "cafc531a6a944adaed8c097ebf7369ca103109713f27b34368b275e30edbaf19",
    "I_1400_1.mat": "787d04c5c976ad00f17a9c2c21f0f8f62ac9bcf7c84d9b0ffed6f2db21ba5b90",
    "O_800_1.mat": "e90b9db6726929d6a19907d48326d5c65d2049aa4e3018b1e8b7337fb360cff3",
    "O_1000_1.mat": "67304995d0a2857e8763d61222cb3d362a0ef9783e719a03bec09f98bbfd2d8a",
    "O_1200_1.mat": "c150a199a271505b772ea0a08e2db07b9994fa1f0df6830f07d713c9acfa7055",
    "O_1400_1.mat": "55f4d634557ae200b059efa30656c9033986365ab9a22a540817957ae607a284",
}


def fetch_uestc(
    *,
    data_home: str | os.PathLike[str] | None = None,
    download_if_missing: bool = True,
    return_X_y: bool = False,
    window_length: int = 1200,
    mirror: str | None = None,
    n_retries: int = 3,
    delay: float = 1.0,
    verbose: bool = True,
) -> Any:
    """Fetch the UESTC bearing rig, cut into windows (download of 34 MB).

    Vibration of normal bearings and of bearings with a fault of the ball, the inner or the outer
    race, at four shaft speeds [1]_. Every recording was stored in five parts, of which only the
    first is fetched.

    ================   =======
    Recordings              16
    Conditions               4
    Speeds                   4
    Samples each       262,144
    Sampling rate       20 kHz
    ================   =======

    Parameters
    ----------
    data_home : str or path-like, default=None
        Folder that holds the data sets of scikit-learn. If None, the folder that
        :func:`sklearn.datasets.get_data_home` returns is used. The recordings are stored in its
        subfolder ``uestc``, with the same layout as in their repository. A file that is already
        there with the right SHA-256 is not downloaded again. A file with another SHA-256 is
        replaced, with a warning.
    download_if_missing : bool, default=True
        If False, raise an OSError instead of downloading.
    return_X_y : bool, default=False
        If True, return ``(data, target)`` instead of a Bunch.
    window_length : int, default=1200
        Samples in a window (60 ms at the default). Windows do not overlap. Samples at the
        end of a recording that do not fill a window are not used.
    mirror : str, default=None
        URL of a copy of the repository's root, from which to download. If None, the files are
        downloaded from the repository itself, at the commit that the SHA-256 sums belong to.
    n_retries : int, default=3
        Number of times that a failed download is repeated, for each file.
    delay : float, default=1.0
        Time between two attempts, in seconds.
    verbose : bool, default=True
        If True, write one line to standard error for every file that is downloaded.

    Returns
    -------
    rig : :class:`~sklearn.utils.Bunch`
        The windows of all recordings, with the following attributes.

        data : ndarray of shape (n_windows, window_length)
            Acceleration, in a unit that the authors do not state. Windows of one recording are
            consecutive and in time order.
        target : ndarray of str, shape (n_windows,)
            Condition of each window.
        target_names : list of str
            The conditions, the healthy one first: ``N``, ``B`` (ball), ``I`` (inner
            race), ``O`` (outer race).
        rpm : ndarray of float, shape (n_windows,)
            Nominal shaft speed in revolutions per minute: 800, 1000, 1200 or 1400.
        recording : ndarray of str, shape (n_windows,)
            Recording that the window was cut from, such as ``"B_1000_1"``.
        start : ndarray of int, shape (n_windows,)
            Index of the window's first sample in its recording.
        sampling_rate : float
            20000, in Hz.
        filenames : list of str
            Path of every recording, in the order of the recordings in `data`.
        DESCR : str
            Description of the rig, its terms of use and the work to cite.
    (data, target) : tuple of ndarray
        The windows and their conditions, if `return_X_y` is True.

    Raises
    ------
    OSError
        If a file is missing or is not the original and `download_if_missing` is False, or if it
        cannot be downloaded. The message names the file.
    ValueError
        If `window_length` is below 1 or longer than a recording.

    References
    ----------
    .. [1] C. Liu et al., "A New Target Domain One-Class Learning Bearing Fault Detection
       Framework", IEEE Sensors Journal, 2025, doi 10.1109/JSEN.2025.3635217.

    Examples
    --------
    >>> from skarxlag.datasets import fetch_uestc
    >>> rig = fetch_uestc()  # doctest: +SKIP
    >>> rig.data.shape  # doctest: +SKIP
    (3488, 1200)
    """
    return fetch_rig(
        "uestc",
        {f"Data/{name[:-6]}/{name}": sha256 for name, sha256 in CHECKSUMS.items()},
        REPOSITORY if mirror is None else mirror,
        sampling_rate=SAMPLING_RATE,
        description=DESCRIPTION,
        data_home=data_home,
        download_if_missing=download_if_missing,
        return_X_y=return_X_y,
        window_length=window_length,
        n_retries=n_retries,
        delay=delay,
        verbose=verbose,
    )
