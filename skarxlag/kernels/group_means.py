"""Weighted means of groups of rows."""

from typing import Any

import numpy as np
from numpy.typing import NDArray


def group_means(values: NDArray[Any], group: NDArray[Any], weights: NDArray[Any]) -> NDArray[Any]:
    """Compute the weighted mean of each group of rows.

    Parameters
    ----------
    values : ndarray of shape (n_rows, ...)
        Rows.
    group : ndarray of int of shape (n_rows,)
        Group of each row, 0 to n_groups - 1, each with a row.
    weights : ndarray of shape (n_rows,)
        Weight of each row, above 0.

    Returns
    -------
    ndarray of shape (n_groups, ...)
        Means.

    Examples
    --------
    >>> group_means(np.array([1.0, 2.0, 5.0]), np.array([1, 0, 0]), np.array([1.0, 2.0, 1.0]))
    array([3., 1.])
    """
    own = [group == number for number in range(group.max() + 1)]
    return np.stack([np.average(values[rows], axis=0, weights=weights[rows]) for rows in own])
