"""Model-based fault diagnosis of bearings across shaft speeds, as scikit-learn estimators."""

from .cepstral import CepstralResidual
from .identification import ARXLaguerre
from .ladder import FaultDetector, ThresholdLadder
from .model_selection import speed_splits
from .observers import ExtendedStatePIObserver, PIObserver
from .persistence import load_diagnoser, save_diagnoser
from .pipelines import DiagnosisPipeline, make_alpio, make_diagnoser, make_extended_state_pio
from .recording_table import load_recordings, read_recording_table
from .recordings import iter_windows, read_recording
from .signals import make_windows

__version__ = "0.1.0"

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
    "make_diagnoser",
    "make_extended_state_pio",
    "make_windows",
    "read_recording",
    "read_recording_table",
    "save_diagnoser",
    "speed_splits",
]
