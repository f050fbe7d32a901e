"""The diagnosers by the names that the commands give them."""

from collections.abc import Callable
from functools import partial
from typing import Any

from sklearn.pipeline import Pipeline

from ..diagnosers import make_alpio, make_diagnoser, make_extended_state_pio
from ..identification import ARXLaguerre
from ..ladder import ThresholdLadder
from ..observers import ExtendedStatePIObserver, PIObserver


def make_single_ladder(
    observer: Callable[..., Any], *, healthy: str, n_jobs: int | None = None
) -> Pipeline:
    """The paper's ladder as printed: one model, of the healthy condition, and one residual.

    Its thresholds cut the residual's level into bands (Eqs. 23-32), one for each condition. The
    level is in the sensor's unit: on windows of unit root-mean-square it would not grow with the
    fault.

    Parameters
    ----------
    observer : callable
        Makes the observer, `PIObserver` or `ExtendedStatePIObserver`.
    healthy : label
        The condition that the model is identified on.
    n_jobs : int or None, default=None
        Threads that work on windows.
    """
    return Pipeline(
        [
            ("identify", ARXLaguerre(healthy=healthy, unit_rms=False, n_jobs=n_jobs)),
            ("observe", observer(n_jobs=n_jobs)),
            ("decide", ThresholdLadder(healthy=healthy)),
        ]
    )


#: Those that `evaluate` compares, in the order of its tables: title and maker. `fit` offers these
#: and the detector.
DIAGNOSERS = {
    "alpio": ("ALPIO", make_alpio),
    "extended-state": ("Extended state", make_extended_state_pio),
    "diagnoser": ("Diagnoser", make_diagnoser),
}
#: What `evaluate` puts into the paper's tables, by its option --ladder: makers by title. A single
#: residual has no counterpart of our own diagnoser.
LADDERS: dict[str, dict[str, Any]] = {
    "bank": dict(DIAGNOSERS.values()),
    "single": {
        DIAGNOSERS["alpio"][0]: partial(make_single_ladder, PIObserver),
        DIAGNOSERS["extended-state"][0]: partial(make_single_ladder, ExtendedStatePIObserver),
    },
}


def set_threads(diagnoser: Any, n_jobs: int | None) -> None:
    """Set the number of threads of the diagnoser, of its steps and of what these have fitted."""
    names = [name for name in diagnoser.get_params() if name.split("__")[-1] == "n_jobs"]
    diagnoser.set_params(**dict.fromkeys(names, n_jobs))
    # A step may keep a fitted copy of a parameter, as meta-estimators do: the parameter is not it.
    for _, step in getattr(diagnoser, "steps", []):
        for name, fitted in vars(step).items():
            if name.endswith("_") and hasattr(fitted, "get_params"):
                set_threads(fitted, n_jobs)
