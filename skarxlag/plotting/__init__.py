"""Figures, as Display classes in scikit-learn's manner; they need matplotlib."""

from .speed_accuracy import SpeedAccuracyDisplay
from .trajectories import ResidualDisplay, TrajectoryDisplay

__all__ = ["ResidualDisplay", "SpeedAccuracyDisplay", "TrajectoryDisplay"]
