"""Cross-validation across shaft speeds and across specimens."""

from .cross_speed import cross_speed_predict
from .groups import first_and_second_half
from .specimen_split import SpecimenSplit, locations_of_labels
from .speed_split import SpeedSplit

__all__ = [
    "SpecimenSplit",
    "SpeedSplit",
    "cross_speed_predict",
    "first_and_second_half",
    "locations_of_labels",
]
