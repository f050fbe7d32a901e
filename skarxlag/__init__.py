"""Model-based fault diagnosis of bearings across shaft speeds, as scikit-learn estimators."""

from ._version import __version__ as __version__
from .cepstral import CepstralResidual
from .detector import FaultDetector
from .diagnosers import make_alpio, make_detector, make_diagnoser, make_extended_state_pio
from .identification import ARXLaguerre
from .ladder import ThresholdLadder
from .model_selection import speed_splits
from .observers import ExtendedStatePIObserver, PIObserver
from .persistence import load_diagnoser, save_diagnoser
from .pipelines import DiagnosisPipeline
from .quality import signal_quality
from .recordings import (
    iter_windows,
    load_recordings,
    make_windows,
    read_recording,
    read_recording_table,
)
from .verdicts import recording_verdicts, window_verdicts

__all__ = [
    "ARXLaguerre",
    "CepstralResidual",
    "DiagnosisPipeline",
    "ExtendedStatePIObserver",
    "FaultDetector",
    "PIObserver",
    "ThresholdLadder",
    "iter_windows",
    "load_diagnoser",
    "load_recordings",
    "make_alpio",
    "make_detector",
    "make_diagnoser",
    "make_extended_state_pio",
    "make_windows",
    "read_recording",
    "read_recording_table",
    "recording_verdicts",
    "save_diagnoser",
    "signal_quality",
    "speed_splits",
    "window_verdicts",
]
