"""Least squares from sums over windows."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg


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
