"""Windows that occur several times, as in a bootstrap sample, are found and counted once."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

_N_KEYS = 8


def distinct_windows(
    windows: NDArray[Any], weights: NDArray[Any]
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return the indices of the distinct windows, and the weight of each.

    Sums in floating point depend on the order of the summands. If windows are repeated or
    weighted, they are therefore sorted by their values. One window of weight 2 and two equal
    windows then give the same sums to the last bit.

    Parameters
    ----------
    windows : ndarray of shape (n_windows, n_channels, n_samples)
        Windows without NaN.
    weights : ndarray of shape (n_windows,)
        Number of windows that each window stands for.

    Returns
    -------
    rows : ndarray of int of shape (n_distinct,)
        Indices of the distinct windows. If no window is repeated or weighted, these are all indices
        in their original order.
    weights : ndarray of shape (n_distinct,)
        Sums of the weights.

    Examples
    --------
    >>> windows = np.array([[[2.0, 3.0]], [[1.0, 5.0]], [[2.0, 3.0]]])
    >>> distinct_windows(windows, np.array([1.0, 1.0, 2.0]))
    (array([0, 1]), array([3., 1.]))
    """
    places = np.linspace(0, windows.shape[-1] - 1, _N_KEYS).astype(int)
    keys = windows[:, 0, places]
    order = np.lexsort(keys.T)
    same = np.all(keys[order[1:]] == keys[order[:-1]], axis=1)
    for i in np.flatnonzero(same):
        same[i] = np.array_equal(windows[order[i + 1]], windows[order[i]])
    if not np.any(same) and np.all((weights == 0) | (weights == 1)):
        return np.arange(len(windows)), weights
    first = np.flatnonzero(np.concatenate([[True], ~same]))
    return order[first], np.add.reduceat(weights[order], first)
