"""Rows that are computed when they are taken, for steps of `fit` that take them batch by batch."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import numpy as np

_is_wanted = ContextVar("_is_wanted", default=False)


class OnDemand:
    """Array of rows that are computed whenever a slice of them is taken.

    Rows that are chosen by indices or flags are such an array again.

    Parameters
    ----------
    compute : callable
        Returns the rows of a slice or of an array of indices.
    n_rows : int
        Number of rows.

    Examples
    --------
    >>> squares = OnDemand(lambda rows: np.arange(10.0)[rows, np.newaxis] ** 2, 10)
    >>> squares.shape, squares[2:4].tolist(), float(np.asarray(squares).sum())
    ((10, 1), [[4.0], [9.0]], 285.0)
    >>> squares[[3, 9]][1:].tolist()
    [[81.0]]
    """

    def __init__(self, compute: Callable[[Any], Any], n_rows: int) -> None:
        first = compute(slice(1))
        self.compute, self.ndim, self.dtype = compute, first.ndim, first.dtype
        self.shape = (n_rows, *first.shape[1:])

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, rows: Any) -> Any:
        if isinstance(rows, slice):
            return self.compute(rows)
        chosen = np.arange(len(self))[rows]
        return OnDemand(lambda some: self.compute(chosen[some]), len(chosen))

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Any:
        return np.asarray(self.compute(slice(None)), dtype=dtype)


@contextmanager
def on_demand(is_wanted: bool) -> Iterator[None]:
    """Return a context in which `rows_computed_by` may leave rows for later."""
    token = _is_wanted.set(is_wanted)
    try:
        yield
    finally:
        _is_wanted.reset(token)


def rows_computed_by(compute: Callable[[Any], Any], n_rows: int) -> Any:
    """Return all rows, or in the context of `on_demand` an array that computes those taken."""
    return OnDemand(compute, n_rows) if _is_wanted.get() else compute(slice(None))
