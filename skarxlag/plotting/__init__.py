"""Figures, as Display classes that follow the conventions of scikit-learn.

They need matplotlib, which the extra ``skarxlag[plot]`` installs.
"""

from ._style import condition_styles
from .identification import IdentificationDisplay
from .spectra import EnvelopeSpectrumDisplay, OrderSpectrumDisplay
from .speed_accuracy import SpeedAccuracyDisplay
from .thresholds import ResidualDisplay, ThresholdLadderDisplay

__all__ = [
    "EnvelopeSpectrumDisplay",
    "IdentificationDisplay",
    "OrderSpectrumDisplay",
    "ResidualDisplay",
    "SpeedAccuracyDisplay",
    "ThresholdLadderDisplay",
    "condition_styles",
]
