"""Rolling-element bearings: their geometry, their defect frequencies, and a catalogue."""

from .geometry import (
    BEARINGS,
    METRES_PER_MM,
    SKF_6205,
    BearingGeometry,
    BearingLike,
    bearing_list,
    bearing_orders,
    contact_speed,
    defect_frequencies,
)

__all__ = [
    "BEARINGS",
    "METRES_PER_MM",
    "SKF_6205",
    "BearingGeometry",
    "BearingLike",
    "bearing_list",
    "bearing_orders",
    "contact_speed",
    "defect_frequencies",
]
