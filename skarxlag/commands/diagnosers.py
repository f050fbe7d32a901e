"""The diagnosers by the names that the commands give them."""

from typing import Any

from sklearn.base import BaseEstimator
from sklearn.pipeline import Pipeline

from ..diagnosers import make_alpio, make_diagnoser, make_extended_state_pio

#: Those that `evaluate` compares, in the order of its tables: title and maker. `fit` offers these
#: and the detector.
DIAGNOSERS = {
    "alpio": ("ALPIO", make_alpio),
    "extended-state": ("Extended state", make_extended_state_pio),
    "diagnoser": ("Diagnoser", make_diagnoser),
}


def set_threads(diagnoser: Any, n_jobs: int | None) -> None:
    """Set the number of threads of the diagnoser, of its steps and of what these have fitted."""
    names = [name for name in diagnoser.get_params() if name.split("__")[-1] == "n_jobs"]
    diagnoser.set_params(**dict.fromkeys(names, n_jobs))
    # A step may keep a fitted copy of a parameter, as meta-estimators do: the parameter is not it.
    for _, step in diagnoser.steps if isinstance(diagnoser, Pipeline) else ():
        for name, fitted in vars(step).items():
            if name.endswith("_") and isinstance(fitted, BaseEstimator):
                set_threads(fitted, n_jobs)
