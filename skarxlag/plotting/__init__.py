"""Figures, as Display classes that follow the conventions of scikit-learn.

They need matplotlib, which the extra ``skarxlag[plot]`` installs.
"""

from ._style import condition_styles
from .identification import IdentificationDisplay
from .residual import ResidualDisplay
from .spectra import EnvelopeSpectrumDisplay, OrderSpectrumDisplay
from .threshold_ladder import ThresholdLadderDisplay

__all__ = [
    "EnvelopeSpectrumDisplay",
    "IdentificationDisplay",
    "OrderSpectrumDisplay",
    "ResidualDisplay",
    "ThresholdLadderDisplay",
    "condition_styles",
]
