"""Whole recordings of the rigs, with their bearings and fault locations."""

from functools import partial
from typing import Any, NamedTuple

import numpy as np

from benchmarks.recordings import fetch_cwru, fetch_hit_sm, fetch_mfpt, fetch_uestc
from skarxlag.bearings import BEARINGS, BearingGeometry, bearing_orders
from skarxlag.core.fault_locations import location_of_label

#: Function that fetches each rig.
RIGS = {
    "SpectraQuest": partial(fetch_hit_sm, rig="spectraquest"),
    "self-built": partial(fetch_hit_sm, rig="self-built"),
    "UESTC": fetch_uestc,
    "CWRU drive end": partial(fetch_cwru, end="drive"),
    "CWRU fan end": partial(fetch_cwru, end="fan"),
    "MFPT": fetch_mfpt,
}
#: Bearings that the authors do not state. Housings UCP 204 hold inserts UC 204; the
#: orders of the self-built rig are those of a 6205.
_NOT_STATED = {"UESTC": "UC204", "self-built": "6205"}


class Recording(NamedTuple):
    """A recording of one condition at one speed, with a fault location or "healthy"."""

    rig: str
    name: str
    location: str
    rpm: float
    rate: float
    bearing: BearingGeometry
    samples: Any
    condition: str = ""

    @property
    def orders(self):
        """Return orders of cage, spin, inner and outer race."""
        by_name = bearing_orders(self.bearing)
        return np.array([by_name[name] for name in ("cage", "spin", "inner", "outer")])


def recordings(name, data_home=None):
    """All recordings of a rig, in whole seconds.

    Parameters
    ----------
    name : str
        Of `RIGS`.
    data_home : str or None, default=None
        Folder of the downloaded rigs.

    Returns
    -------
    list of Recording
    """
    rate = int(RIGS[name](data_home=data_home).sampling_rate)
    rig = RIGS[name](window_length=rate, data_home=data_home)
    whole = []
    for recording in dict.fromkeys(rig.recording):
        rows = rig.recording == recording
        condition = rig.target[rows][0]
        rpm = float(rig.rpm[rows][0])
        location = location_of_label(str(condition)) or condition
        samples = np.ascontiguousarray(rig.data[rows].ravel(), dtype=np.float64)
        bearing = rig.bearing or BEARINGS[_NOT_STATED[name]]
        whole.append(
            Recording(
                name,
                str(recording),
                location,
                rpm,
                float(rig.sampling_rate),
                bearing,
                samples,
                str(condition),
            )
        )
    return whole
