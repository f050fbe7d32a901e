"""Output of a fitted step that is computed batch by batch, to save memory."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..kernels.arx_laguerre import LANES

#: Bytes of the rows of a batch: so many that the calls around the loops take little
#: time, and so few that the results of several models for them are soon used again.
BATCH_BYTES = 2**22
#: Bytes of as many rows as the recursions process side by side.
_MOST_BYTES = 2**25

#: Whether `fit_transform` of a step may return `RowsInBatches`. `DiagnosisPipeline.fit`
#: allows it.
MAY_BE_IN_BATCHES: ContextVar[bool] = ContextVar("MAY_BE_IN_BATCHES", default=False)


class RowsInBatches:
    """Rows that a fitted transformer computes when they are read.

    It has the length, shape and type of the array that `transform` returns. An index
    computes the rows that it selects, and `numpy.asarray` computes all of them.

    Parameters
    ----------
    rows : ndarray of shape (n_rows, ...), or RowsInBatches
        Input of the transformer, at least one row.
    transform : callable
        Method of the transformer, which works on each row by itself.
    chosen : ndarray of int or None, default=None
        Rows of the input that count. None: all.

    Examples
    --------
    >>> squares = RowsInBatches(np.arange(4.0), np.square)
    >>> squares.shape, squares[2:]
    ((4,), array([4., 9.]))
    """

    def __init__(
        self,
        rows: Any,
        transform: Callable[[NDArray[Any]], NDArray[Any]],
        chosen: NDArray[np.intp] | None = None,
    ) -> None:
        self.rows: Any = rows
        self.transform: Callable[[NDArray[Any]], NDArray[Any]] = transform
        self.chosen: NDArray[np.intp] = (
            np.arange(len(rows)) if chosen is None else chosen
        )
        first = self[:1]
        self.shape: tuple[int, ...] = (len(self.chosen), *first.shape[1:])
        self.ndim: int = first.ndim
        self.dtype: np.dtype[Any] = first.dtype

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, index: Any) -> NDArray[Any]:
        return self.transform(self.rows[self.chosen[index]])

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        everything = np.empty(self.shape, dtype=dtype or self.dtype)
        for batch in batches_of(self):
            everything[batch] = self[batch]
        return everything


def batches_of(X: Any) -> Iterator[slice]:
    """Yield slices of the rows of a batch, in order."""
    together = rows_of_batch(X)
    for start in range(0, len(X), together):
        yield slice(start, start + together)


def rows_of_batch(X: Any) -> int:
    """Return the number of rows that are processed together.

    They, or the rows that they are computed from, take 4 MiB in double precision. Of
    long rows, there are as many as the recursions process side by side.
    """
    of_row = _bytes_of_row(X)
    return max(BATCH_BYTES // of_row, min(LANES, _MOST_BYTES // of_row), 1)


def chosen_rows(X: Any, index: NDArray[Any]) -> Any:
    """Return the rows of an index array, which are computed when they are read if X is."""
    if isinstance(X, RowsInBatches):
        return RowsInBatches(X.rows, X.transform, X.chosen[index])
    return X[index]


def _bytes_of_row(X):
    """Return the bytes of a row in double precision, or of its input if that has more."""
    own = max(8 * math.prod(X.shape[1:]), 1)
    return max(own, _bytes_of_row(X.rows)) if isinstance(X, RowsInBatches) else own
