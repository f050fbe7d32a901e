"""Rolling-element bearings: their geometry, their defect frequencies, and a catalogue."""

from .geometry import (
    BEARINGS,
    METRES_PER_MM,
    SKF_6205,
    BearingGeometry,
    BearingLike,
    bearing_orders,
    contact_speed,
    defect_frequencies,
    listed,
)

__all__ = [
    "BEARINGS",
    "METRES_PER_MM",
    "SKF_6205",
    "BearingGeometry",
    "BearingLike",
    "bearing_orders",
    "contact_speed",
    "defect_frequencies",
    "listed",
]
