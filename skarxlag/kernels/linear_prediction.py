"""The autoregressive model of a signal by the covariance method, in O(order^2).

The samples s(m) ... s(m + p - 1) predict s(m + p). With coefficients in that order,
oldest sample first, the normal equations are made of

    R(a, b) = sum_m s(m + a) s(m + b),  m = 0 .. n_samples - p - 1,  a, b = 0 .. p.

R is nearly Toeplitz: R(a, b) - R(a - 1, b - 1) = e(a) e(b) - l(a) l(b). The samples
that enter the sum are e(a) = s(n_samples - p - 1 + a), and those that leave it are l(a)
= s(a - 1). The triangular factor of such a matrix follows from its first row, e and l
by Schur's algorithm as generalised in T. Kailath and A. H. Sayed (1995), "Displacement
structure: theory and applications", SIAM Review 37(3), 297-386.
"""

import math

import numpy as np

from .arrays import Array
from .compiled import compiled

_EPS = np.finfo(np.float64).eps
#: Entries of a row, or samples, that are worked on together: rows are filled up with
#: zeros to a multiple, since a loop over the entries that remain would take half as
#: long as all others.
_LANES = 16
#: Samples whose products with all later ones are added together.
_TOGETHER = 4


def predictors(signals: Array, order: int, alpha: float) -> Array:
    r"""Compute g in :math:`s(k) \approx \sum_n g_n\,s(k - 1 - n)` by ridge regression.

    Parameters
    ----------
    signals : ndarray of shape (n_signals, n_samples)
        Signals of a size whose squares neither overflow nor vanish.
    order : int
        Number of coefficients, from 1 to n_samples - 1.
    alpha : float
        Ridge parameter, relative to the power of the signal.

    Returns
    -------
    ndarray of shape (n_signals, order)
        Coefficients; 0 for a signal of zeros.

    Examples
    --------
    >>> predictors(0.5 ** np.arange(20.0)[np.newaxis], 1, 1e-12).round(6)
    array([[0.5]])
    """
    width = -(-(order + 1) // _LANES) * _LANES
    padded = np.zeros((2, signals.shape[1] + width + _LANES))
    generators = np.zeros((4, width + _LANES))
    factor = np.empty((order, width))
    solutions = np.zeros((len(signals), order + _LANES))
    _fill_solutions(signals, alpha, padded, generators, factor, solutions)
    return solutions[:, order - 1 :: -1]


@compiled
def _fill_solutions(signals, alpha, padded, generators, factor, solutions):
    r"""Solve :math:`\sum_b (R(a, b) + \rho\,\delta_{ab})\,c_b = R(a, p)`, a, b = 0 .. p - 1.

    The difference between R and R shifted by one place along its diagonal is :math:`u
    u^T + e e^T - v v^T - l l^T`. At each step, rotations of (u, e) and (v, l) set the
    first entries of e and l to 0. A hyperbolic rotation of (u, v) sets the first entry
    of v to 0. Then u is a row of the triangular factor, and it is shifted by one place.
    If the ridge :math:`\rho` is 0, the solution is not written.

    Parameters
    ----------
    signals : ndarray of shape (n_signals, n_samples)
        The signals.
    alpha : float
        The ridge, relative to the power of the signal.
    padded : ndarray of shape (2, n_samples + width + _LANES)
        Working memory for the first factors s(m) and for the signal; zero on entry.
    generators, factor : ndarray of shape (4, width + _LANES) and (order, width)
        Working memory for u, e, v and l, and for the rows of the factor, from the
        diagonal on.
    solutions : ndarray of shape (n_signals, order + _LANES)
        Receives the solutions; zero on entry.
    """
    n_signals, n_samples = signals.shape
    order, width = factor.shape
    n_products = n_samples - order
    u = generators[0]
    entering = generators[1]
    v = generators[2]
    leaving = generators[3]
    for w in range(n_signals):
        for m in range(n_samples):
            padded[1, m] = signals[w, m]
        for m in range(n_products):
            padded[0, m] = signals[w, m]
        for b in range(width):
            u[b] = 0.0
        for m in range(0, n_products, _TOGETHER):
            # In registers, because the compiler cannot know that the sums are apart.
            r = padded[0, m:]
            r0 = r[0]
            r1 = r[1]
            r2 = r[2]
            r3 = r[3]
            s = padded[1, m:]
            for b in range(width):
                near = r0 * s[b] + r1 * s[b + 1]
                u[b] += near + (r2 * s[b + 2] + r3 * s[b + 3])
        for b in range(order + 1, width):
            u[b] = 0.0
        diagonal = power = u[0]
        for a in range(1, order + 1):
            entering[a] = signals[w, n_products - 1 + a]
            leaving[a] = signals[w, a - 1]
            diagonal += entering[a] * entering[a] - leaving[a] * leaving[a]
            power += diagonal
        ridge = alpha * power / (order + 1)
        if ridge == 0:
            continue
        first = math.sqrt(u[0] + ridge)
        for b in range(width):
            u[b] /= first
            v[b] = u[b]
        u[0] = first
        entering[0] = v[0] = leaving[0] = 0.0
        plus = u
        for a in range(order):
            enters = generators[1, a:]
            minus = generators[2, a:]
            leaves = generators[3, a:]
            factor_row = factor[a]
            gain = math.sqrt(plus[0] * plus[0] + enters[0] * enters[0])
            loss = math.sqrt(minus[0] * minus[0] + leaves[0] * leaves[0])
            cos_plus = plus[0] / gain
            sin_plus = enters[0] / gain
            cos_minus = 1.0
            sin_minus = 0.0
            if loss > 0:
                cos_minus = minus[0] / loss
                sin_minus = leaves[0] / loss
            tanh = loss / gain
            # Above 0 by the ridge, but for rounding.
            sech = math.sqrt(max((1 - tanh) * (1 + tanh), _EPS))
            of_plus = cos_plus / sech
            of_enters = sin_plus / sech
            of_minus = tanh / sech
            for j in range(_LANES * ((order - a) // _LANES + 1)):
                p = plus[j]
                q = enters[j]
                r = minus[j]
                s = leaves[j]
                enters[j] = cos_plus * q - sin_plus * p
                leaves[j] = cos_minus * s - sin_minus * r
                r = cos_minus * r + sin_minus * s
                p = of_plus * p + of_enters * q - of_minus * r
                minus[j] = sech * r - tanh * p
                factor_row[j] = p
            plus = factor_row
        # The last column of the factor has been through forward substitution.
        for a in range(order - 1, -1, -1):
            factor_row = factor[a]
            solution = solutions[w, a:]
            for lane in range(_LANES):
                u[lane] = 0.0
            for first in range(0, order - a, _LANES):
                row = factor_row[first:]
                values = solution[first:]
                for lane in range(_LANES):
                    u[lane] += row[lane] * values[lane]
            total = factor_row[order - a]
            for lane in range(_LANES):
                total -= u[lane]
            solution[0] = total / factor_row[0]
