"""The SpectraQuest rig of the HIT-SM bearing data sets: seven conditions at three speeds."""

import os
from typing import Any

from skarxlag.datasets._repository import fetch_rig

REPOSITORY = (
    "https://raw.githubusercontent.com/hitwzc/Bearing-datasets/"
    "12e46cd1b4a40f396c2bd6e245be5bafe18b1989"
)
SAMPLING_RATE = 51_200.0
DESCRIPTION = """\
HIT-SM bearing data set, SpectraQuest MFS rig
=============================================

Vertical vibration (acceleration, SQI608A11-3F/8) of a housing with a 6205 deep groove ball bearing
on a SpectraQuest machinery fault simulator with a cantilever load of 5 kg: normal (Normal), or with
a fault of the inner (IR) or the outer race (OR) over an arc of 2, 5 or 8 degrees, at nominal shaft
speeds of 600, 900 and 1200 rpm, sampled at 51.2 kHz. The second rig of the data sets is not
fetched.

One bearing and one recording for each condition and speed: 262,144 samples, 5.1 s, 21 files of
2 MB. The gain differs between files (normal windows are 100 times quieter than faulty ones, at
every speed), so the amplitude means nothing here: normalise every window. Windows of one recording
are not independent: split it in time, never at random.

Terms of use, as its authors state them: "The datasets are publicly available and can be used by
anyone for the task of classifying the fault status of rolling bearings." They come from the
repository hitwzc/Bearing-datasets of the sensing and measurement laboratory, School of
Mechatronics Engineering, Harbin Institute of Technology, which names the paper "Multisource
cross-domain fault diagnosis of rolling bearing based on subdomain adaptation network" as theirs.
"""
CHECKSUMS = {
    "Normal_600.mat": "6e8de88c4563f22b028dc0fb1b1f0880f77a6e580c437614284c099092f81a17",
    "Normal_900.mat": "91618b247e8bc65b1d515e9662e8c18219b3d4073426a64c1bb04487a9608ba1",
    "Normal_1200.mat": "e0393c44e971231baeac5fe2fb5dedf42a03a5c4ec9f5bc4448d1376e80e0764",
    "IR2_600.mat": "71eac6cf1b129ceb4f074d6e3d56d5feadf8a764e8fd3a5b38e91a1bcc1645a1",
    "IR2_900.mat": "9a307bc8d61fe79f7154d50d6811f490a551228f7c57c0d02efe39bbc2c6cef2",
    "IR2_1200.mat": "28bae33f046020f3bfb223567711ccba5d50cdd66c7a3461a4776222c46276a8",
    "IR5_600.mat": "52ac7e7aabc670a0a6de267347572e6e9110c64783b8fabe662ee407a1c754c8",
    "IR5_900.mat": "e1c5e77952fb090c7656cd91811af8bcb6512e135602b8c926d1b800a41d7cf4",
    "IR5_1200.mat": "72afc227e70795bb015df0aebdffa33223dc7650bb62b8046d2a32fbca01ab72",
    "IR8_600.mat": "d8a3c772834a828997c89559ffdb4cba6d6f886ab99ba1c1a129080497556789",
    "IR8_900.mat": "c8720261d5feb0bb8dc83e99bb9a8875a2cb3ab6c2572995d8dea067bc48676a",
    "IR8_1200.mat": "faca72b7efe952a340a5be15ce04efe39a24b9f5c5e329d0e8cf35c59e6e2d91",
    "OR2_600.mat": "61783f3ba7b2153bd80e586d4cc7fbb2bf5eb7f261007794faa8f542e6666489",
    "OR2_900.mat": "4b0f8e74dd0f56b01ec055a0e70b486ee619baa7d1da75ff8b36eee1f3f7bb5b",
    "OR2_1200.mat": "5663525bdd773e2281167e534ec3f1b024064c9a575ca7446a1d46b2cc7a3bca",
    "OR5_600.mat": "59f71b3919c3104753099155606162f14a7b194ad12ac650586377c9eb607ff8",
    "OR5_900.mat": "5fbfadce16c23cea3fb5c3a269136cc42a6744ab92cc0556c315584ec176b35b",
    "OR5_1200.mat": "83d3918b67020ad91b5173fde5b0d39d0225763371fe331ee8a78aee43e361a1",
    "OR8_600.mat": "d96d60f65fa1136ac5f56a4c4bfa531f99b12fcb3381a175ea6310928e8fb89d",
    "OR8_900.mat": "391c990aadb196b79df15cc4b6fcbcb3fa206ef2551f1777e096901bd8b8ddf4",
    "OR8_1200.mat": "008ee453e6731a87283e58d9aefa36f97b237a0b12e49adefb138b0bafe896d6",
}


def fetch_hit_sm(
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
    """Fetch the SpectraQuest rig of the HIT-SM data sets, cut into windows (download of 37 MB).

    Vibration of normal bearings and of bearings with a fault of the inner or the outer race in
    three sizes, at three shaft speeds [1]_. The gain differs between files, so amplitudes cannot be
    compared between recordings: scale every window to unit RMS before you use it.

    ================   ========
    Recordings               21
    Conditions                7
    Speeds                    3
    Samples each        262,144
    Sampling rate      51.2 kHz
    ================   ========

    Parameters
    ----------
    data_home : str or path-like, default=None
        Folder that holds the data sets of scikit-learn. If None, the folder that
        :func:`sklearn.datasets.get_data_home` returns is used. The recordings are stored in its
        subfolder ``hit_sm``, with the same layout as in their repository. A file that is already
        there with the right SHA-256 is not downloaded again. A file with another SHA-256 is
        replaced, with a warning.
    download_if_missing : bool, default=True
        If False, raise an OSError instead of downloading.
    return_X_y : bool, default=False
        If True, return ``(data, target)`` instead of a Bunch.
    window_length : int, default=1200
        Samples in a window (23 ms at the default). Windows do not overlap. Samples at the
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
            Acceleration, with a gain that differs between recordings. Windows of one recording
            are consecutive and in time order.
        target : ndarray of str, shape (n_windows,)
            Condition of each window.
        target_names : list of str
            The conditions, the healthy one first: ``Normal``, ``IR2``, ``IR5``,
            ``IR8`` (inner race, arc of 2, 5, 8 degrees), ``OR2``, ``OR5``, ``OR8`` (outer race).
        rpm : ndarray of float, shape (n_windows,)
            Nominal shaft speed in revolutions per minute: 600, 900 or 1200.
        recording : ndarray of str, shape (n_windows,)
            Recording that the window was cut from, such as ``"OR5_1200"``.
        start : ndarray of int, shape (n_windows,)
            Index of the window's first sample in its recording.
        sampling_rate : float
            51200, in Hz.
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
    .. [1] "Multisource cross-domain fault diagnosis of rolling bearing based on subdomain
       adaptation network", the paper that the repository hitwzc/Bearing-datasets belongs to.

    Examples
    --------
    >>> from skarxlag.datasets import fetch_hit_sm
    >>> rig = fetch_hit_sm()  # doctest: +SKIP
    >>> rig.data.shape  # doctest: +SKIP
    (4578, 1200)
    """
    return fetch_rig(
        "hit_sm",
        {f"SpectraQuest MFS dataset/{name}": sha256 for name, sha256 in CHECKSUMS.items()},
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
