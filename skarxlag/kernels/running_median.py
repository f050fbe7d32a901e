"""Median of each value of a signal and its neighbours."""

from typing import Literal

import numpy as np
from scipy.ndimage import median_filter

from .arrays import Array


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
    # One call: no median of a value looks beyond the padding of its row.
    medians = median_filter(padded.ravel(), size).reshape(padded.shape)
    return medians[:, half : half + values.shape[1]]
