"""Median of each value of a signal and its neighbours."""

from typing import Literal

import numpy as np
from scipy.ndimage import median_filter

from .arrays import Array
from .compiled import compiled

#: Most values in a median for which a sorted list is shifted value by value, with
#: vector instructions. The time that SciPy takes hardly depends on their number.
_FEW = 151


def running_median(
    values: Array, size: int, beyond: Literal["edge", "symmetric"]
) -> Array:
    """Compute the median of each value and its neighbours.

    Parameters
    ----------
    values : ndarray of float64 of shape (n_rows, n_values)
        Values without NaN, at least one in a row.
    size : int
        Odd number of values in the median, of any size.
    beyond : {"edge", "symmetric"}
        What follows the ends: the last value, or the values in reverse order.

    Returns
    -------
    ndarray of shape (n_rows, n_values)
        Medians.

    Examples
    --------
    >>> running_median(np.array([[1.0, 9.0, 2.0, 3.0]]), 3, "edge")
    array([[1., 2., 3., 3.]])
    """
    half = size // 2
    # The filter of SciPy 1.15 to 1.17 writes outside its memory if there are fewer
    # values than it has places.
    padded = np.pad(values, ((0, 0), (half, half)), mode=beyond)
    if size > _FEW:
        # One call: no median of a value looks beyond the padding of its row.
        medians = median_filter(padded.ravel(), size).reshape(padded.shape)
        return medians[:, half : half + values.shape[1]]
    medians = np.empty_like(values)
    _fill_medians(padded, np.empty((2, size + 2)), medians)
    return medians


@compiled
def _fill_medians(padded, lists, medians):
    """Fill the medians; `lists` is working memory for a sorted list, before and after a step.

    A list ends with an infinite value at both sides. A value leaves it where the next
    one is moved down, and a value enters it where the one before is moved up.
    """
    n_rows, n_values = medians.shape
    size = lists.shape[1] - 2
    for row in range(n_rows):
        lists[0, 0] = lists[1, 0] = -np.inf
        for j in range(1, size + 2):
            lists[0, j] = lists[1, j] = np.inf
        for k in range(size + n_values - 1):
            leaves = padded[row, k - size] if k >= size else np.inf
            enters = padded[row, k]
            before = lists[k % 2]
            after = lists[1 - k % 2]
            for j in range(1, size + 1):
                lower = before[j - 1] if before[j - 1] < leaves else before[j]
                upper = before[j] if before[j] < leaves else before[j + 1]
                after[j] = max(lower, min(upper, enters))
            if k >= size - 1:
                medians[row, k - size + 1] = after[1 + size // 2]
