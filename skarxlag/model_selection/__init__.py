"""Cross-validation across shaft speeds and specimens, and the evaluation of all protocols."""

from .evaluation import evaluate, evaluation_summary
from .groups import first_and_second_half
from .protocols import PROTOCOLS, Split, protocol_splits
from .scorer import SpeedScorer
from .specimen_split import SpecimenSplit, locations_of_labels
from .speed_split import SpeedSplit

__all__ = [
    "PROTOCOLS",
    "SpecimenSplit",
    "SpeedScorer",
    "SpeedSplit",
    "Split",
    "evaluate",
    "evaluation_summary",
    "first_and_second_half",
    "locations_of_labels",
    "protocol_splits",
]
