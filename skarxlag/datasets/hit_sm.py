"""The two rigs of the HIT-SM bearing data sets: seven conditions at three speeds."""

import os
from typing import Any

from skarxlag.bearings import SKF_6205
from skarxlag.datasets._repository import (
    Source,
    fetch_rig,
    named_recordings,
    shares_sections,
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


@shares_sections
def fetch_hit_sm(
    *,
    rig: str = "spectraquest",
    data_home: str | os.PathLike[str] | None = None,
    download_if_missing: bool = True,
    return_X_y: bool = False,
    window_length: int = 1200,
    mirror: str | None = None,
) -> Any:
    """Fetch a rig of the HIT-SM data sets, cut into windows (download of 37 MB).

    Vibration of normal bearings and of bearings with a fault of the inner or the outer
    race in three sizes, at three shaft speeds [1]_. The gain differs between files of
    the SpectraQuest rig, so amplitudes cannot be compared between its recordings: scale
    every window to unit RMS before you use it.

    ================   ===================
    Recordings                          21
    Conditions                           7
    Speeds in rpm           600, 900, 1200
    Samples each                   262,144
    Sampling rate                 51.2 kHz
    Bearing            6205 (SpectraQuest)
    ================   ===================

    The conditions are ``Normal``, ``IR2``, ``IR5``, ``IR8`` (inner race, arc of 2, 5, 8
    degrees), ``OR2``, ``OR5`` and ``OR8`` (outer race). Each condition is a bearing of
    its own. The authors state neither the unit of the samples nor the bearing of the
    self-built rig.

    Parameters
    ----------
    rig : {"spectraquest", "self-built"}, default="spectraquest"
        The rig: the SpectraQuest machinery fault simulator, or the rig that the
        laboratory built.
    {shared}

    References
    ----------
    .. [1] "Multisource cross-domain fault diagnosis of rolling bearing based on
           subdomain adaptation network", the paper that the repository
           hitwzc/Bearing-datasets belongs to.

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
    recordings = named_recordings("hit_sm", folder)
    source = Source("hit_sm", URL, SAMPLING_RATE, recordings, bearing, f"hit_sm_{rig}")
    return fetch_rig(
        source,
        data_home=data_home,
        download_if_missing=download_if_missing,
        return_X_y=return_X_y,
        window_length=window_length,
        mirror=mirror,
    )
