"""The two rigs of the HIT-SM bearing data sets: seven conditions at three speeds."""

import os
from pathlib import Path
from typing import Any

from skarxlag.bearings import SKF_6205
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
    "https://raw.githubusercontent.com/hitwzc/Bearing-datasets/"
    "12e46cd1b4a40f396c2bd6e245be5bafe18b1989"
)
SAMPLING_RATE = 51_200.0
#: Folder of each rig in the repository, and its bearing where the authors state it.
RIGS = {
    "spectraquest": ("SpectraQuest MFS dataset", SKF_6205),
    "self-built": ("Self-built dataset", None),
}


@shared_parameters
def fetch_hit_sm(
    *,
    rig: str = "spectraquest",
    data_home: str | os.PathLike[str] | None = None,
    download_if_missing: bool = True,
    return_X_y: bool = False,
    window_length: int = 1200,
    mirror: str | None = None,
    n_retries: int = 3,
    delay: float = 1.0,
    verbose: bool = True,
) -> Any:
    """Fetch a rig of the HIT-SM data sets, cut into windows (download of 37 MB).

    Vibration of normal bearings and of bearings with a fault of the inner or the outer race in
    three sizes, at three shaft speeds [1]_. The gain differs between files of the SpectraQuest rig,
    so amplitudes cannot be compared between its recordings: scale every window to unit RMS before
    you use it.

    ================   ========
    Recordings               21
    Conditions                7
    Speeds                    3
    Samples each        262,144
    Sampling rate      51.2 kHz
    ================   ========

    Parameters
    ----------
    rig : {"spectraquest", "self-built"}, default="spectraquest"
        The rig: the SpectraQuest machinery fault simulator, or the rig that the laboratory built.
    {download}
    return_X_y : bool, default=False
        If True, return ``(data, target)`` instead of a Bunch.
    window_length : int, default=1200
        Samples in a window (23 ms at the default). Windows do not overlap. Samples at the end of a
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
            The conditions: the healthy one ``Normal`` first, then ``IR2``, ``IR5``, ``IR8`` (inner
            race, arc of 2, 5, 8 degrees), ``OR2``, ``OR5`` and ``OR8`` (outer race).
        rpm : ndarray of float, shape (n_windows,)
            Nominal shaft speed in revolutions per minute: 600, 900 or 1200.
        recording : ndarray of str, shape (n_windows,)
            Recording that the window was cut from, such as ``"OR5_1200"``.
        start : ndarray of int, shape (n_windows,)
            Index of the window's first sample in its recording.
        sampling_rate : float
            51200, in Hz.
        bearing : BearingGeometry or None
            6205 on the SpectraQuest rig. None on the self-built rig, whose bearing is not stated.
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
        If `rig` is unknown, or if `window_length` is below 1 or longer than a recording.

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
    if rig not in RIGS:
        raise ValueError(f"rig must be one of {list(RIGS)}, got {rig!r}.")
    folder, bearing = RIGS[rig]
    recordings = []
    for path, sha256 in checksums("hit_sm").items():
        if path.startswith(folder):
            condition, rpm = Path(path).stem.split("_")
            recordings.append(Recording(path, condition, float(rpm), sha256, Path(path).stem))
    download = Download(data_home, download_if_missing, mirror, n_retries, delay, verbose)
    repository = Repository("hit_sm", URL, SAMPLING_RATE, f"hit_sm_{rig}", bearing)
    return fetch_rig(
        repository, recordings, read_only_signal, download, (window_length, return_X_y)
    )
