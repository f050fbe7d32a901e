"""Least squares from sums over windows, and windows that occur several times."""

from hashlib import blake2b

import numpy as np
from scipy import linalg

from .arrays import Array

#: Samples by which windows are compared before all their samples are.
_N_KEYS = 8


def solve_sums(sums: Array, alpha: float) -> tuple[Array, float]:
    r"""Solve ridge least squares from :math:`\sum [x; y][x; y]^T`.

    The coefficients minimise :math:`\sum (y - g^T x)^2 + \alpha |g|^2`. The recursion
    of Eq. (16), with its sign and its missing X(k) corrected, gives the same
    coefficients if it starts from :math:`P_0 = I / \alpha`.

    Parameters
    ----------
    sums : ndarray of shape (n_states + 1, n_states + 1)
        The sums, with y last.
    alpha : float
        Ridge parameter, at least 0. If it is 0 and x does not excite every state, the
        coefficients of least norm are returned.

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
    gram = sums[:-1, :-1]
    cross = sums[-1, :-1]
    power = sums[-1, -1]
    ridge = alpha * np.eye(len(gram))
    coef = linalg.lstsq(gram + ridge, cross)[0]
    error = power - 2 * coef @ cross + coef @ gram @ coef
    return coef, max(float(error), 0.0)


def distinct_windows(
    windows: Array, rows: Array, weights: Array
) -> tuple[Array, Array]:
    """Return the rows of the distinct windows, and the weight of each.

    Sums in floating point depend on the order of the summands. If windows are repeated
    or weighted, they are therefore sorted by a digest of their samples. One window of
    weight 2 and two equal windows then give the same sums to the last bit.

    Parameters
    ----------
    windows : ndarray of shape (n_windows, n_channels, n_samples)
        Windows without NaN.
    rows : ndarray of int of shape (n_rows,)
        Windows that count.
    weights : ndarray of shape (n_rows,)
        Number of windows that each of them stands for.

    Returns
    -------
    rows : ndarray of int of shape (n_distinct,)
        Distinct windows. If no window is repeated or weighted, these are all rows in
        their order.
    weights : ndarray of shape (n_distinct,)
        Sums of the weights.

    Examples
    --------
    >>> windows = np.array([[[2.0, 3.0]], [[1.0, 5.0]], [[2.0, 3.0]]])
    >>> rows, weights = distinct_windows(windows, np.arange(3), np.array([1.0, 1.0, 2.0]))
    >>> windows[rows, 0].tolist(), weights.tolist()
    ([[2.0, 3.0], [1.0, 5.0]], [3.0, 1.0])
    """
    places = np.linspace(0, windows.shape[-1] - 1, _N_KEYS).astype(int)
    keys = windows[rows[:, np.newaxis], 0, places]
    are_different = len(np.unique(keys, axis=0)) == len(rows)
    if are_different and np.all(weights == 1):
        return rows, weights
    digests = [_digest(windows[row]) for row in rows]
    _, first, group = np.unique(digests, return_index=True, return_inverse=True)
    return rows[first], np.bincount(group, weights)


def _digest(window):
    return blake2b(window.tobytes(), digest_size=16).digest()
