"""The autoregressive model of a signal by the covariance method, in O(order^2).

The samples s(m) ... s(m + p - 1) predict s(m + p). With coefficients in that order, oldest sample
first, the normal equations are made of

    R(a, b) = sum_m s(m + a) s(m + b),  m = 0 .. n_samples - p - 1,  a, b = 0 .. p.

R is nearly Toeplitz: R(a, b) - R(a - 1, b - 1) = e(a) e(b) - l(a) l(b). The samples that enter the
sum are e(a) = s(n_samples - p - 1 + a), and those that leave it are l(a) = s(a - 1). The triangular
factor of such a matrix follows from its first row, e and l by Schur's algorithm as generalised
in T. Kailath and A. H. Sayed (1995), "Displacement structure: theory and applications", SIAM
Review 37(3), 297-386.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from .compiled import compiled

_EPS = np.finfo(np.float64).eps


def predictors(signals: NDArray[Any], order: int, alpha: float) -> NDArray[Any]:
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
    n = fft.next_fast_len(signals.shape[1] + order, real=True)
    spectra = fft.rfft(signals, n)
    products = fft.irfft(spectra.real**2 + spectra.imag**2, n)[:, : order + 1].copy()
    entering, leaving = np.zeros((2, len(signals), order + 1))
    entering[:, 1:], leaving[:, 1:] = signals[:, -order:], signals[:, :order]
    v, factor = np.empty(order + 1), np.empty((order + 1, order + 1))
    solutions = np.zeros((len(signals), order))
    _fill_solutions(products, entering, leaving, alpha, v, factor, solutions)
    return solutions[:, ::-1]


@compiled
def _fill_solutions(products, entering, leaving, alpha, v, factor, solutions):
    r"""Solve :math:`\sum_b (R(a, b) + \rho\,\delta_{ab})\,c_b = R(a, p)`, a, b = 0 .. p - 1.

    The difference between R and R shifted by one place along its diagonal is
    :math:`u u^T + e e^T - v v^T - l l^T`. At each step, rotations of (u, e) and (v, l) set the
    first entries of e and l to 0. A hyperbolic rotation of (u, v) sets the first entry of v to 0.
    Then u is a row of the triangular factor, and it is shifted by one place. If the ridge
    :math:`\rho` is 0, the solution is not written.

    Parameters
    ----------
    products : ndarray of shape (n_signals, order + 1)
        Sum of s(m) s(m + b) over all m. It is overwritten by the first row of R.
    entering, leaving : ndarray of shape (n_signals, order + 1)
        e and l, with 0 in front. They are overwritten.
    alpha : float
        The ridge, relative to the power of the signal.
    v, factor : ndarray of shape (order + 1,) and (order + 1, order + 1)
        Working memory. The last row of the factor is u at first.
    solutions : ndarray of shape (n_signals, order)
        Receives the solutions.
    """
    n_signals, order = solutions.shape
    for w in range(n_signals):
        first_row, enters, leaves = products[w], entering[w], leaving[w]
        for m in range(1, order + 1):
            for b in range(order + 1 - m):
                first_row[b] -= enters[m] * enters[m + b]
        diagonal = power = first_row[0]
        for a in range(1, order + 1):
            diagonal += enters[a] * enters[a] - leaves[a] * leaves[a]
            power += diagonal
        ridge = alpha * power / (order + 1)
        if ridge == 0:
            continue
        scale = 1 / np.sqrt(first_row[0] + ridge)
        for b in range(order + 1):
            factor[order, b] = v[b] = first_row[b] * scale
        factor[order, 0], v[0] = 1 / scale, 0.0
        plus = factor[order]
        for a in range(order):
            enters, minus, leaves = entering[w, a:], v[a:], leaving[w, a:]
            factor_row = factor[a, a:]
            gain = np.sqrt(plus[0] * plus[0] + enters[0] * enters[0])
            loss = np.sqrt(minus[0] * minus[0] + leaves[0] * leaves[0])
            cos_plus, sin_plus = plus[0] / gain, enters[0] / gain
            cos_minus, sin_minus = (minus[0] / loss, leaves[0] / loss) if loss > 0 else (1.0, 0.0)
            tanh = loss / gain
            # Above 0 by the ridge, but for rounding.
            sech = np.sqrt(max((1 - tanh) * (1 + tanh), _EPS))
            cosh = 1 / sech
            for j in range(order + 1 - a):
                p, q, r, s = plus[j], enters[j], minus[j], leaves[j]
                enters[j] = cos_plus * q - sin_plus * p
                leaves[j] = cos_minus * s - sin_minus * r
                r = cos_minus * r + sin_minus * s
                p = (cos_plus * p + sin_plus * q - tanh * r) * cosh
                minus[j] = sech * r - tanh * p
                factor_row[j] = p
            plus = factor_row
        # The last column of the factor has been through forward substitution. Backward, two
        # unknowns at a time share what is read from a row.
        solution = solutions[w]
        for a in range(order):
            solution[a] = factor[a, order]
        for b in range(order - 1, 0, -2):
            last = solution[b] / factor[b, b]
            before = (solution[b - 1] - factor[b - 1, b] * last) / factor[b - 1, b - 1]
            solution[b], solution[b - 1] = last, before
            for a in range(b - 1):
                solution[a] -= factor[a, b - 1] * before + factor[a, b] * last
        if order % 2 == 1:
            solution[0] /= factor[0, 0]
