"""The diagnosers by the names that the commands give them."""

from sklearn.pipeline import Pipeline

from ..identification import ARXLaguerre
from ..ladder import FaultDetector
from ..observers import PIObserver
from ..pipelines import make_alpio, make_diagnoser, make_extended_state_pio


def make_detector():
    """Detection without isolation, in the sensor's unit, from healthy windows alone."""
    return Pipeline(
        [
            ("identify", ARXLaguerre(unit_rms=False)),
            ("observe", PIObserver()),
            ("decide", FaultDetector()),
        ]
    )


#: Those that `evaluate` compares, in the order of its tables: title and maker. `fit` offers these
#: and the detector.
COMPARED = {
    "alpio": ("ALPIO", make_alpio),
    "extended-state": ("Extended state", make_extended_state_pio),
    "diagnoser": ("Diagnoser", make_diagnoser),
}


def set_threads(diagnoser, n_jobs):
    """Set the number of threads of all steps that have one."""
    for step in diagnoser.named_steps.values():
        if "n_jobs" in step.get_params():
            step.set_params(n_jobs=n_jobs)
