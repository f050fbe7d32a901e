"""The bearing fault data of the MFPT society: two faults at seven loads."""

import os
from typing import Any

from scipy.io import loadmat

from skarxlag.bearings import BearingGeometry
from skarxlag.datasets._repository import (
    Download,
    Recording,
    Repository,
    fetch_rig,
    shared_parameters,
)

URL = (
    "https://raw.githubusercontent.com/mathworks/RollingElementBearingFaultDiagnosis-Data/"
    "d3efefb6ce84fa1ee6c0311f80f7c89cf903ad1d"
)
SAMPLING_RATE = 48_828.0
N_SAMPLES = 146_484
RPM = 1500.0
MM_PER_INCH = 25.4
NICE = BearingGeometry(8, 0.235 * MM_PER_INCH, 1.245 * MM_PER_INCH)


@shared_parameters
def fetch_mfpt(
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
    """Fetch the bearing fault data of the MFPT society, cut into windows.

    Acceleration of a bearing with a fault of the inner or the outer race at seven loads, each a
    recording of its own [1]_. There is one speed only, and no healthy recording at this rate.

    ================   ==========
    Recordings                 14
    Conditions                  2
    Speeds                      1
    Samples each          146,484
    Sampling rate      48.828 kHz
    ================   ==========

    The commit of the repository is fixed. The SHA-256 sums of its files are not known here, so the
    number of samples of each recording is checked instead. Converted files are accepted as well: a
    file ``mfpt/inner_load1.npz`` in `data_home` with an array ``acceleration`` is read as it is.

    Parameters
    ----------
    {download}
    return_X_y : bool, default=False
        If True, return ``(data, target)`` instead of a Bunch.
    window_length : int, default=1200
        Samples in a window (25 ms at the default). Windows do not overlap. Samples at the end of a
        recording that do not fill a window are not used.

    Returns
    -------
    rig : :class:`~sklearn.utils.Bunch`
        The windows of all recordings, with the following attributes.

        data : ndarray of shape (n_windows, window_length)
            Acceleration in g. Windows of one recording are consecutive and in time order.
        target : ndarray of str, shape (n_windows,)
            Condition of each window.
        target_names : list of str
            The conditions: ``inner`` and ``outer``; there is no healthy one.
        rpm : ndarray of float, shape (n_windows,)
            Nominal shaft speed in revolutions per minute: 1500.
        recording : ndarray of str, shape (n_windows,)
            Recording that the window was cut from, such as ``"inner_load1"``.
        start : ndarray of int, shape (n_windows,)
            Index of the window's first sample in its recording.
        sampling_rate : float
            48828, in Hz.
        bearing : BearingGeometry
            8 elements of 0.235 inch on a pitch diameter of 1.245 inch.
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
    .. [1] E. Bechhoefer, "Condition Based Maintenance Fault Database for Testing Diagnostics and
       Prognostic Algorithms", MFPT Society, 2013.

    Examples
    --------
    >>> from skarxlag.datasets import fetch_mfpt
    >>> rig = fetch_mfpt()  # doctest: +SKIP
    >>> rig.data.shape  # doctest: +SKIP
    (1708, 1200)
    """
    recordings = []
    for condition in ("inner", "outer"):
        for load in range(1, 8):
            part = "train_data" if load <= 5 else "test_data"
            path = f"{part}/{condition.capitalize()}RaceFault_vload_{load}.mat"
            name = f"{condition}_load{load}"
            recordings.append(Recording(path, condition, RPM, None, name, f"mfpt/{name}.npz"))
    download = Download(data_home, download_if_missing, mirror, n_retries, delay, verbose)
    repository = Repository("mfpt", URL, SAMPLING_RATE, "mfpt", NICE)
    return fetch_rig(repository, recordings, _read_signal, download, (window_length, return_X_y))


def _read_signal(path):
    signal = loadmat(path)["bearing"]["gs"][0, 0]
    if signal.size != N_SAMPLES:
        raise OSError(f"{path} has {signal.size} samples, but the original has {N_SAMPLES}.")
    return signal
