"""The diagnosers of the paper's tables: a bank of models, or one model with one ladder."""

from functools import partial

from sklearn.pipeline import Pipeline

from skarxlag import (
    ARXLaguerre,
    ExtendedStatePIObserver,
    PIObserver,
    ThresholdLadder,
    make_alpio,
    make_diagnoser,
    make_extended_state_pio,
)

#: Titles and makers of the diagnosers, in the order of the tables.
DIAGNOSERS = {
    "alpio": ("ALPIO", make_alpio),
    "extended-state": ("Extended state", make_extended_state_pio),
    "diagnoser": ("Diagnoser", make_diagnoser),
}


def make_single_ladder(observer, *, healthy, n_jobs=None):
    """Return the paper's ladder as printed: one model, of the healthy condition, and one residual.

    Its thresholds cut the residual's level into bands (Eqs. 23-32), one for each
    condition. The level is in the sensor's unit: on windows of unit root-mean-square it
    would not grow with the fault.

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


#: The proposal with one observer, which is closer to the printed form.
SINGLE_OBSERVER = partial(ExtendedStatePIObserver, n_observers=1)
#: Makers by title, for each comparison of the tables. A single residual has no
#: counterpart of `make_diagnoser`.
LADDERS = {
    "bank": dict(DIAGNOSERS.values()),
    "single": {
        DIAGNOSERS["alpio"][0]: partial(make_single_ladder, PIObserver),
        DIAGNOSERS["extended-state"][0]: partial(make_single_ladder, SINGLE_OBSERVER),
    },
}
