"""Model-based fault diagnosis of bearings across shaft speeds, as scikit-learn estimators.

A name is imported from its module when it is first used, so that ``skarxlag --version`` and
``--help`` do not wait for numba. A new public name is added twice below: for type checkers and for
`_MODULES`.
"""

import importlib
from typing import TYPE_CHECKING, Any

from ._version import __version__ as __version__

if TYPE_CHECKING:
    from .bearings import BearingGeometry as BearingGeometry
    from .bearings import bearing_orders as bearing_orders
    from .channels import ChannelRows as ChannelRows
    from .comparison import SpectralDistance as SpectralDistance
    from .detection import FaultDetector as FaultDetector
    from .diagnosers import make_alpio as make_alpio
    from .diagnosers import make_detector as make_detector
    from .diagnosers import make_diagnoser as make_diagnoser
    from .diagnosers import make_extended_state_pio as make_extended_state_pio
    from .diagnosers import make_fault_order_classifier as make_fault_order_classifier
    from .diagnosers import make_known_conditions as make_known_conditions
    from .envelope_spectra import envelope_spectrum as envelope_spectrum
    from .fault_classifier import FaultOrderClassifier as FaultOrderClassifier
    from .identification import ARXLaguerre as ARXLaguerre
    from .known_conditions import KnownConditions as KnownConditions
    from .ladder import ThresholdLadder as ThresholdLadder
    from .model_selection import SpeedSplit as SpeedSplit
    from .model_selection import cross_speed_predict as cross_speed_predict
    from .monitoring import ConditionMonitor as ConditionMonitor
    from .monitoring import load_monitor_state as load_monitor_state
    from .monitoring import save_monitor_state as save_monitor_state
    from .observer_bank import ExtendedStatePIObserverBank as ExtendedStatePIObserverBank
    from .observers import ExtendedStatePIObserver as ExtendedStatePIObserver
    from .observers import PIObserver as PIObserver
    from .orders import OrderResidual as OrderResidual
    from .persistence import load_diagnoser as load_diagnoser
    from .persistence import save_diagnoser as save_diagnoser
    from .pipelines import DiagnosisPipeline as DiagnosisPipeline
    from .quality import signal_quality as signal_quality
    from .recordings.files import iter_windows as iter_windows
    from .recordings.files import list_channels as list_channels
    from .recordings.files import read_recording as read_recording
    from .recordings.rig import load_recordings as load_recordings
    from .recordings.rig import read_recording_table as read_recording_table
    from .recordings.windows import make_windows as make_windows
    from .spectra import LogSpectra as LogSpectra
    from .speeds import estimate_shaft_speed as estimate_shaft_speed
    from .speeds import rpm_from_tacho as rpm_from_tacho
    from .stretches import StretchResidual as StretchResidual
    from .verdicts import recording_verdicts as recording_verdicts
    from .verdicts import window_verdicts as window_verdicts

#: Module of each public name.
_MODULES = {
    "ARXLaguerre": "identification",
    "BearingGeometry": "bearings",
    "ChannelRows": "channels",
    "ConditionMonitor": "monitoring",
    "DiagnosisPipeline": "pipelines",
    "ExtendedStatePIObserver": "observers",
    "ExtendedStatePIObserverBank": "observer_bank",
    "FaultDetector": "detection",
    "FaultOrderClassifier": "fault_classifier",
    "KnownConditions": "known_conditions",
    "LogSpectra": "spectra",
    "OrderResidual": "orders",
    "PIObserver": "observers",
    "SpectralDistance": "comparison",
    "SpeedSplit": "model_selection",
    "StretchResidual": "stretches",
    "ThresholdLadder": "ladder",
    "bearing_orders": "bearings",
    "cross_speed_predict": "model_selection",
    "envelope_spectrum": "envelope_spectra",
    "estimate_shaft_speed": "speeds",
    "iter_windows": "recordings.files",
    "list_channels": "recordings.files",
    "load_diagnoser": "persistence",
    "load_monitor_state": "monitoring",
    "load_recordings": "recordings.rig",
    "make_alpio": "diagnosers",
    "make_detector": "diagnosers",
    "make_diagnoser": "diagnosers",
    "make_extended_state_pio": "diagnosers",
    "make_fault_order_classifier": "diagnosers",
    "make_known_conditions": "diagnosers",
    "make_windows": "recordings.windows",
    "read_recording": "recordings.files",
    "read_recording_table": "recordings.rig",
    "recording_verdicts": "verdicts",
    "rpm_from_tacho": "speeds",
    "save_diagnoser": "persistence",
    "save_monitor_state": "monitoring",
    "signal_quality": "quality",
    "window_verdicts": "verdicts",
}
__all__ = list(_MODULES)


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f".{_MODULES[name]}", __name__), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
