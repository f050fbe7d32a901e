"""The UESTC bearing rig: four conditions at four shaft speeds."""

import os
from typing import Any

from skarxlag.datasets._repository import (
    Source,
    fetch_rig,
    named_recordings,
    shares_sections,
)

URL = (
    "https://raw.githubusercontent.com/ChangLiu2024/UESTC-Bearing-Dataset/"
    "782c6ddddcd63e0ef97019dbfeec9887e36bca1e"
)
SAMPLING_RATE = 20_000.0


@shares_sections
def fetch_uestc(
    *,
    data_home: str | os.PathLike[str] | None = None,
    download_if_missing: bool = True,
    return_X_y: bool = False,
    window_length: int = 1200,
    mirror: str | None = None,
) -> Any:
    """Fetch the UESTC bearing rig, cut into windows (download of 34 MB).

    Vibration of normal bearings and of bearings with a fault of the ball, the inner or
    the outer race, at four shaft speeds [1]_. Every recording was stored in five parts,
    of which only the first is fetched.

    ================   =====================
    Recordings                            16
    Conditions                             4
    Speeds in rpm      800, 1000, 1200, 1400
    Samples each                     262,144
    Sampling rate                     20 kHz
    ================   =====================

    The conditions are ``N`` (healthy), ``B`` (ball), ``I`` (inner race) and ``O``
    (outer race). The authors state neither the unit of the samples nor the dimensions
    of the bearing.

    Parameters
    ----------
    {shared}

    References
    ----------
    .. [1] C. Liu et al., "A New Target Domain One-Class Learning Bearing Fault
           Detection Framework", IEEE Sensors Journal, 2025, doi
           10.1109/JSEN.2025.3635217.

    Examples
    --------
    >>> from skarxlag.datasets import fetch_uestc
    >>> rig = fetch_uestc()  # doctest: +SKIP
    >>> rig.data.shape  # doctest: +SKIP
    (3488, 1200)
    """
    source = Source("uestc", URL, SAMPLING_RATE, named_recordings("uestc"))
    return fetch_rig(
        source,
        data_home=data_home,
        download_if_missing=download_if_missing,
        return_X_y=return_X_y,
        window_length=window_length,
        mirror=mirror,
    )
