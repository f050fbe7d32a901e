# Public names, by their modules. lazy_loader and type checkers read them here.
from ._version import __version__ as __version__
from .bearings import BearingGeometry as BearingGeometry
from .bearings import bearing_orders as bearing_orders
from .core.pipelines import DiagnosisPipeline as DiagnosisPipeline
from .core.windows import make_windows as make_windows
from .decisions.condition_classifier import ConditionClassifier as ConditionClassifier
from .decisions.fault_detector import FaultDetector as FaultDetector
from .decisions.fault_orders import FaultOrderClassifier as FaultOrderClassifier
from .decisions.fusion import SensorFusion as SensorFusion
from .decisions.known_conditions import KnownConditions as KnownConditions
from .decisions.ladder import ThresholdLadder as ThresholdLadder
from .diagnosers import make_alpio as make_alpio
from .diagnosers import make_detector as make_detector
from .diagnosers import make_diagnoser as make_diagnoser
from .diagnosers import make_extended_state_pio as make_extended_state_pio
from .diagnosers import make_fault_order_classifier as make_fault_order_classifier
from .diagnosers import make_known_conditions as make_known_conditions
from .distances.comparison import SpectralDistance as SpectralDistance
from .distances.orders import OrderResidual as OrderResidual
from .distances.stretches import StretchResidual as StretchResidual
from .measures.envelope_spectra import envelope_spectrum as envelope_spectrum
from .measures.measured_speeds import estimate_shaft_speed as estimate_shaft_speed
from .measures.measured_speeds import rpm_from_tacho as rpm_from_tacho
from .measures.quality import signal_quality as signal_quality
from .measures.spectra import LogSpectra as LogSpectra
from .model_selection import SpecimenSplit as SpecimenSplit
from .model_selection import SpeedSplit as SpeedSplit
from .model_selection import cross_speed_predict as cross_speed_predict
from .models.identification import ARXLaguerre as ARXLaguerre
from .models.observer_bank import (
    ExtendedStatePIObserverBank as ExtendedStatePIObserverBank,
)
from .models.observers import ExtendedStatePIObserver as ExtendedStatePIObserver
from .models.observers import PIObserver as PIObserver
from .monitoring import ConditionMonitor as ConditionMonitor
from .persistence.models import load_diagnoser as load_diagnoser
from .persistence.models import save_diagnoser as save_diagnoser
from .persistence.monitor_states import load_monitor_state as load_monitor_state
from .persistence.monitor_states import save_monitor_state as save_monitor_state
from .plant.readers.files import iter_windows as iter_windows
from .plant.readers.files import list_channels as list_channels
from .plant.readers.files import read_recording as read_recording
from .plant.readers.rig import load_recordings as load_recordings
from .plant.readers.rig import read_recording_table as read_recording_table
from .verdicts.recordings import recording_verdicts as recording_verdicts
from .verdicts.recordings import window_verdicts as window_verdicts

__all__: list[str]
