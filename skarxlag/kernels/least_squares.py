"""Least squares from sums over windows, and windows that occur several times."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

#: Samples by which windows are compared before all their samples are.
_N_KEYS = 8


def solve_sums(sums: NDArray[Any], alpha: float) -> tuple[NDArray[Any], float]:
    r"""Solve ridge least squares from :math:`\sum [x; y][x; y]^T`.

    The coefficients minimise :math:`\sum (y - g^T x)^2 + \alpha |g|^2`. The recursion of Eq. (16),
    with its sign and its missing X(k) corrected, gives the same coefficients if it starts from
    :math:`P_0 = I / \alpha`.

    Parameters
    ----------
    sums : ndarray of shape (n_states + 1, n_states + 1)
        The sums, with y last.
    alpha : float
        Ridge parameter, at least 0. If it is 0 and x does not excite every state, the coefficients
        of least norm are returned.

    Returns
    -------
    coef : ndarray of shape (n_states,)
        The coefficients g.
    error : float
        The sum of squared prediction errors.

    Examples
    --------
    >>> import numpy as np
    >>> solve_sums(np.array([[4.0, 2.0], [2.0, 1.0]]), alpha=0.0)
    (array([0.5]), 0.0)
    """
    gram, cross, power = sums[:-1, :-1], sums[-1, :-1], sums[-1, -1]
    coef = linalg.lstsq(gram + alpha * np.eye(len(gram)), cross)[0]
    error = power - 2 * coef @ cross + coef @ gram @ coef
    return coef, max(float(error), 0.0)


def sample_keys(windows: NDArray[Any]) -> NDArray[Any]:
    """Return the samples of each window's output by which `distinct_windows` sorts.

    Parameters
    ----------
    windows : ndarray of shape (n_windows, n_channels, n_samples)
        Windows without NaN.

    Returns
    -------
    ndarray of shape (n_windows, 8)
        Samples at equal distances.
    """
    places = np.linspace(0, windows.shape[-1] - 1, _N_KEYS).astype(int)
    return windows[:, 0, places]


def distinct_windows(
    windows: Any, keys: NDArray[Any], weights: NDArray[Any]
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return the indices of the distinct windows, and the weight of each.

    Sums in floating point depend on the order of the summands. If windows are repeated or
    weighted, they are therefore sorted by their values. One window of weight 2 and two equal
    windows then give the same sums to the last bit.

    Parameters
    ----------
    windows : ndarray of shape (n_windows, n_channels, n_samples)
        Windows without NaN. Two are taken by their indices if their keys are equal.
    keys : ndarray of shape (n_windows, n_keys)
        Their `sample_keys`.
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
    >>> distinct_windows(windows, sample_keys(windows), np.array([1.0, 1.0, 2.0]))
    (array([0, 1]), array([3., 1.]))
    """
    order = np.lexsort(keys.T)
    same = np.all(keys[order[1:]] == keys[order[:-1]], axis=1)
    for i in np.flatnonzero(same):
        same[i] = np.array_equal(*windows[order[i : i + 2]])
    if not np.any(same) and np.all((weights == 0) | (weights == 1)):
        return np.arange(len(keys)), weights
    first = np.flatnonzero(np.concatenate([[True], ~same]))
    return order[first], np.add.reduceat(weights[order], first)
