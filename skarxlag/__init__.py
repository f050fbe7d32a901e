"""Model-based fault diagnosis of bearings across shaft speeds, as scikit-learn estimators.

A name is imported from its module when it is first used, so that ``skarxlag --version``
and ``--help`` do not wait for numba. Type checkers read the same names in the stub
``__init__.pyi``.
"""

import importlib
from typing import Any

from ._version import __version__ as __version__
from .core.registry import ESTIMATORS as _ESTIMATORS

#: Module of each public name.
_MODULES = _ESTIMATORS | {
    "bearing_orders": "bearings",
    "BearingGeometry": "bearings",
    "ConditionMonitor": "monitoring",
    "cross_speed_predict": "model_selection",
    "envelope_spectrum": "measures.envelope_spectra",
    "estimate_shaft_speed": "measures.measured_speeds",
    "iter_windows": "plant.readers.files",
    "list_channels": "plant.readers.files",
    "load_diagnoser": "persistence.models",
    "load_monitor_state": "persistence.monitor_states",
    "load_recordings": "plant.readers.rig",
    "make_alpio": "diagnosers",
    "make_detector": "diagnosers",
    "make_diagnoser": "diagnosers",
    "make_extended_state_pio": "diagnosers",
    "make_fault_order_classifier": "diagnosers",
    "make_known_conditions": "diagnosers",
    "make_windows": "plant.readers.windows",
    "read_recording": "plant.readers.files",
    "read_recording_table": "plant.readers.rig",
    "recording_verdicts": "verdicts.recordings",
    "rpm_from_tacho": "measures.measured_speeds",
    "save_diagnoser": "persistence.models",
    "save_monitor_state": "persistence.monitor_states",
    "signal_quality": "measures.quality",
    "SpecimenSplit": "model_selection",
    "SpeedSplit": "model_selection",
    "window_verdicts": "verdicts.recordings",
}
__all__ = sorted(_MODULES)


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f".{_MODULES[name]}", __name__), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
