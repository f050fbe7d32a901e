"""The rig of Case Western Reserve University: nine faults at four loads."""

import os
from typing import Any

from skarxlag.bearings import SKF_6205, BearingGeometry
from skarxlag.datasets._repository import (
    Recording,
    Source,
    checksums,
    fetch_rig,
    shares_sections,
)

URL = "https://engineering.case.edu/sites/default/files"
SAMPLING_RATE = 12_000.0
#: Nominal speed for each load of 0, 1, 2 and 3 hp.
SPEEDS = (1797, 1772, 1750, 1730)
#: Number of the first file of each condition. The file of the next load has the next
#: number.
DRIVE_END = {
    "inner007": 105, "inner014": 169, "inner021": 209, "ball007": 118, "ball014": 185,
    "ball021": 222, "outer007": 130, "outer014": 197, "outer021": 234,
}  # fmt: skip
FAN_END = {
    "inner007": 278, "inner014": 274, "inner021": 270, "ball007": 282, "ball014": 286,
    "ball021": 290, "outer007": 298, "outer014": 309, "outer021": 315,
}  # fmt: skip
#: The only file that is out of sequence: outer014 of the fan end at 1 hp.
OUT_OF_SEQUENCE = {310: 309}
#: First files, first load, sensor and bearing of each end of the motor.
ENDS = {
    "drive": (DRIVE_END, 0, "DE", SKF_6205),
    "fan": (FAN_END, 1, "FE", BearingGeometry(8, 6.746, 28.499)),
}


@shares_sections
def fetch_cwru(
    *,
    end: str = "drive",
    data_home: str | os.PathLike[str] | None = None,
    download_if_missing: bool = True,
    return_X_y: bool = False,
    window_length: int = 1200,
    mirror: str | None = None,
) -> Any:
    """Fetch the bearing data of Case Western Reserve University (download of 105 or 79 MB).

    Acceleration next to a faulty bearing of a motor: three sizes of faults of the inner
    race, the outer race and a ball, at four loads of 0 to 3 hp (fan end: 1 to 3), each
    a recording of its own [1]_. Healthy recordings were made at another sampling rate
    and are not fetched. The conditions are ``inner007``, ``inner014``, ``inner021``
    (inner race, 0.007, 0.014 and 0.021 inch), and ``ball...`` and ``outer...`` alike.
    Each condition is a bearing of its own. The samples are in g, the load is in hp.

    ================   ======================
    Recordings         36 (fan end: 27)
    Conditions                              9
    Speeds in rpm      1797, 1772, 1750, 1730
    Samples each       120,617 to 122,917
    Sampling rate                      12 kHz
    Bearing            6205 (fan end: 6203)
    ================   ======================

    Converted files are accepted as well: a file ``cwru_drive_end/inner007_1797.npz``
    (or ``cwru_fan_end/...``) in `data_home` with an array ``acceleration`` is read as
    it is, and its SHA-256 is not checked.

    Parameters
    ----------
    end : {"drive", "fan"}, default="drive"
        End of the motor with the faulty bearing.
    {shared}

    References
    ----------
    .. [1] Case Western Reserve University Bearing Data Center,
           https://engineering.case.edu/bearingdatacenter.

    Examples
    --------
    >>> from skarxlag.datasets import fetch_cwru
    >>> rig = fetch_cwru()  # doctest: +SKIP
    >>> rig.data.shape  # doctest: +SKIP
    (3641, 1200)
    """
    if end not in ENDS:
        raise ValueError(f"end must be one of {list(ENDS)}, got {end!r}.")
    first_files, first_load, sensor, bearing = ENDS[end]
    sums = checksums("cwru")
    recordings = []
    for condition, first in first_files.items():
        for load in range(first_load, len(SPEEDS)):
            number = OUT_OF_SEQUENCE.get(first + load, first + load)
            path = f"{number}.mat"
            name = f"{condition}_{SPEEDS[load]}"
            recordings.append(
                Recording(
                    path,
                    condition,
                    SPEEDS[load],
                    name,
                    sums[path],
                    converted=f"cwru_{end}_end/{name}.npz",
                    # Some files repeat the arrays of another file.
                    channel=f"X{number:03d}_{sensor}_time",
                    load=str(load),
                )
            )
    pattern = f"*_{sensor}_time"
    source = Source("cwru", URL, SAMPLING_RATE, recordings, bearing, channel=pattern)
    return fetch_rig(
        source,
        data_home=data_home,
        download_if_missing=download_if_missing,
        return_X_y=return_X_y,
        window_length=window_length,
        mirror=mirror,
    )
