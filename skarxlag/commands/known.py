"""What `fit` saves beside a diagnoser, to tell recordings of no condition that it knows."""

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._answers import answers
from ..diagnosers import make_known_conditions
from .diagnosers import set_threads


def fit_known_conditions(
    X: NDArray[Any], y: NDArray[Any], rpm: NDArray[Any] | None, n_jobs: int | None
) -> tuple[Any, str]:
    """Fit the known conditions on what the diagnoser was fitted on.

    Parameters
    ----------
    X : ndarray of shape (n_rows, ...)
        Windows or stretches.
    y : ndarray of shape (n_rows,)
        Their conditions.
    rpm : ndarray of shape (n_rows,) or None
        Their speeds, where the table states them.
    n_jobs : int or None
        Threads of the fit; what is saved has none.

    Returns
    -------
    known : Pipeline or None
        None if the rows do not suffice.
    line : str
        What to tell the user.
    """
    known = make_known_conditions()
    set_threads(known, n_jobs)
    try:
        with warnings.catch_warnings():
            # Few rows and one speed are the common case here; the line below says what follows.
            warnings.simplefilter("ignore", UserWarning)
            known.fit(X, y, **({} if rpm is None else {"rpm": rpm}))
    except ValueError as error:
        return None, f"No p-values of the nearest condition: {error}"
    left_out = sorted(set(y) - set(known[-1].classes_))
    set_threads(known, None)
    if left_out:
        return None, (
            "No p-values of the nearest condition: fewer than two windows at one speed of "
            f"{', '.join(left_out)}"
        )
    fewest = min(np.unique(y, return_counts=True)[1])
    at = "of unknown speed" if rpm is None else "at other speeds"
    return known, (
        f"p-values of the nearest condition, from {fewest} rows a condition or more; below "
        f"{answers(known).stated_rate:g} a recording is none of these. Recordings {at} are rarely "
        "rejected"
    )
