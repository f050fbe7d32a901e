"""The UESTC bearing rig: four conditions at four shaft speeds."""

import os
from pathlib import Path
from typing import Any

from skarxlag.datasets._repository import (
    Download,
    Recording,
    Repository,
    checksums,
    fetch_rig,
    read_only_signal,
    shared_parameters,
)

URL = (
    "https://raw.githubusercontent.com/ChangLiu2024/UESTC-Bearing-Dataset/"
    "782c6ddddcd63e0ef97019dbfeec9887e36bca1e"
)
SAMPLING_RATE = 20_000.0


@shared_parameters
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
    {download}
    return_X_y : bool, default=False
        If True, return ``(data, target)`` instead of a Bunch.
    window_length : int, default=1200
        Samples in a window (60 ms at the default). Windows do not overlap. Samples at the end of a
        recording that do not fill a window are not used.

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
            The conditions: the healthy one ``N`` first, then ``B`` (ball), ``I`` (inner race) and
            ``O`` (outer race).
        rpm : ndarray of float, shape (n_windows,)
            Nominal shaft speed in revolutions per minute: 800, 1000, 1200 or 1400.
        recording : ndarray of str, shape (n_windows,)
            Recording that the window was cut from, such as ``"B_1000_1"``.
        start : ndarray of int, shape (n_windows,)
            Index of the window's first sample in its recording.
        sampling_rate : float
            20000, in Hz.
        bearing : None
            The authors do not state the dimensions of the bearing.
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
    recordings = []
    for path, sha256 in checksums("uestc").items():
        condition, rpm, _ = Path(path).stem.split("_")
        recordings.append(Recording(path, condition, float(rpm), sha256, Path(path).stem))
    download = Download(data_home, download_if_missing, mirror, n_retries, delay, verbose)
    repository = Repository("uestc", URL, SAMPLING_RATE, "uestc")
    return fetch_rig(
        repository, recordings, read_only_signal, download, (window_length, return_X_y)
    )
