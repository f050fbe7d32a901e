"""Rows that are computed when they are taken, for steps of `fit` that take them batch by batch."""

from collections.abc import Callable
from contextvars import ContextVar
from typing import Any

import numpy as np

from ..kernels.lanes import LANES

#: Whether `rows_computed_by` may leave rows for later.
IS_WANTED = ContextVar("IS_WANTED", default=False)


class TakesRowsOnDemand:
    """Estimator that takes rows batch by batch only, in `fit`, too."""


class OnDemand:
    """Array of rows that are computed whenever a slice of them is taken.

    Rows that are chosen by indices or flags are such an array again.

    Parameters
    ----------
    compute : callable
        Returns the rows of a slice or of an array of indices.
    n_rows : int
        Number of rows.
    together : int, default=LANES
        Rows that take hardly more time than one of them.

    Examples
    --------
    >>> squares = OnDemand(lambda rows: np.arange(10.0)[rows, np.newaxis] ** 2, 10)
    >>> squares.shape, squares[2:4].tolist(), float(np.asarray(squares).sum())
    ((10, 1), [[4.0], [9.0]], 285.0)
    >>> squares[[3, 9]][1:].tolist()
    [[81.0]]
    """

    def __init__(
        self, compute: Callable[[Any], Any], n_rows: int, together: int = LANES
    ) -> None:
        first = compute(slice(1))
        self.compute, self.ndim, self.dtype = compute, first.ndim, first.dtype
        self.shape, self.together = (n_rows, *first.shape[1:]), together

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, rows: Any) -> Any:
        if isinstance(rows, slice):
            return self.compute(rows)
        chosen = np.arange(len(self))[rows]
        return OnDemand(
            lambda some: self.compute(chosen[some]), len(chosen), self.together
        )

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Any:
        return np.asarray(self.compute(slice(None)), dtype=dtype)


def rows_computed_by(compute: Callable[[Any], Any], n_rows: int) -> Any:
    """Return all rows, or an array that computes those taken, if the next step takes them."""
    return OnDemand(compute, n_rows) if IS_WANTED.get() else compute(slice(None))


def batch_size(X: Any, wanted: int) -> int:
    """Return the rows of a batch: as wanted, or as many as are best computed together."""
    return max(wanted, X.together) if isinstance(X, OnDemand) else wanted
