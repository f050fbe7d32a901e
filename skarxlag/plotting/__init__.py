"""Figures, as Display classes in scikit-learn's manner; they need matplotlib."""

from ._style import condition_styles
from .identification import IdentificationDisplay
from .order_spectrum import OrderSpectrumDisplay
from .residual import ResidualDisplay
from .speed_accuracy import SpeedAccuracyDisplay
from .threshold_ladder import ThresholdLadderDisplay
from .trajectories import TrajectoryDisplay

__all__ = [
    "IdentificationDisplay",
    "OrderSpectrumDisplay",
    "ResidualDisplay",
    "SpeedAccuracyDisplay",
    "ThresholdLadderDisplay",
    "TrajectoryDisplay",
    "condition_styles",
]
