"""The bearing fault data of the MFPT society: two faults at seven loads."""

import os
from typing import Any

from skarxlag.bearings import BearingGeometry
from skarxlag.datasets._repository import Recording, Source, fetch_rig, shares_sections

URL = (
    "https://raw.githubusercontent.com/mathworks/RollingElementBearingFaultDiagnosis-Data/"
    "d3efefb6ce84fa1ee6c0311f80f7c89cf903ad1d"
)
SAMPLING_RATE = 48_828.0
N_SAMPLES = 146_484
RPM = 1500.0
MM_PER_INCH = 25.4
NICE = BearingGeometry(8, 0.235 * MM_PER_INCH, 1.245 * MM_PER_INCH)


@shares_sections
def fetch_mfpt(
    *,
    data_home: str | os.PathLike[str] | None = None,
    download_if_missing: bool = True,
    return_X_y: bool = False,
    window_length: int = 1200,
    mirror: str | None = None,
) -> Any:
    """Fetch the bearing fault data of the MFPT society, cut into windows.

    Acceleration of a bearing with a fault of the inner or the outer race at seven
    loads, each a recording of its own [1]_. There is one speed only, and no healthy
    recording at this rate. The conditions are ``inner`` and ``outer``. The attribute
    ``load`` is the number of the load in the name of the file, 1 to 7, not a force. The
    samples are in g. The bearing has 8 elements of 0.235 inch on a pitch diameter of
    1.245 inch.

    ================   ==========
    Recordings                 14
    Conditions                  2
    Speed in rpm             1500
    Samples each          146,484
    Sampling rate      48.828 kHz
    ================   ==========

    The commit of the repository is fixed. The SHA-256 sums of its files are not known
    here, so the number of samples of each recording is checked instead. Converted files
    are accepted as well: a file ``mfpt/inner_load1.npz`` in `data_home` with an array
    ``acceleration`` is read as it is.

    Parameters
    ----------
    {shared}

    References
    ----------
    .. [1] E. Bechhoefer, "Condition Based Maintenance Fault Database for Testing
           Diagnostics and Prognostic Algorithms", MFPT Society, 2013.

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
            converted = f"mfpt/{name}.npz"
            recordings.append(
                Recording(path, condition, RPM, name, None, converted, load=str(load))
            )
    source = Source(
        "mfpt",
        URL,
        SAMPLING_RATE,
        recordings,
        NICE,
        channel="bearing.gs",
        n_samples=N_SAMPLES,
    )
    return fetch_rig(
        source,
        data_home=data_home,
        download_if_missing=download_if_missing,
        return_X_y=return_X_y,
        window_length=window_length,
        mirror=mirror,
    )
