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
    first_rows = lagged_products(signals, order)
    entering, leaving = np.zeros_like(first_rows), np.zeros_like(first_rows)
    entering[:, 1:], leaving[:, 1:] = signals[:, -order:], signals[:, :order]
    power = first_rows[:, 0] + np.cumsum(entering**2 - leaving**2, axis=1).mean(axis=1)
    return schur_solutions(first_rows, entering, leaving, alpha * power)[:, ::-1]


def lagged_products(signals: NDArray[Any], order: int) -> NDArray[Any]:
    """Compute the first row R(0, 0) ... R(0, order) of each signal's normal equations.

    Parameters
    ----------
    signals : ndarray of shape (n_signals, n_samples)
        Signals.
    order : int
        Largest lag, below n_samples.

    Returns
    -------
    ndarray of shape (n_signals, order + 1)
        Entry b is the sum of s(m) s(m + b) over m = 0 .. n_samples - order - 1.
    """
    # All products of the samples at each lag, less those of the last `order` samples.
    return _autocorrelation(signals, order) - _autocorrelation(signals[:, -order:], order)


def _autocorrelation(signals, order):
    """Compute the sums of s(m) s(m + b) over all m, for b = 0 .. order."""
    n = fft.next_fast_len(signals.shape[1] + order, real=True)
    spectra = fft.rfft(signals, n)
    return fft.irfft(spectra.real**2 + spectra.imag**2, n)[:, : order + 1]


def schur_solutions(
    first_rows: NDArray[Any], entering: NDArray[Any], leaving: NDArray[Any], ridges: NDArray[Any]
) -> NDArray[Any]:
    r"""Solve :math:`\sum_b (R(a, b) + \rho\,\delta_{ab})\,c_b = R(a, p)`, a, b = 0 .. p - 1.

    The difference between R and R shifted by one place along its diagonal is
    :math:`u u^T + e e^T - v v^T - l l^T`. At each step, rotations of (u, e) and (v, l) set the
    first entries of e and l to 0. A hyperbolic rotation of (u, v) sets the first entry of v to 0.
    Then u is a row of the triangular factor, and it is shifted by one place.

    Parameters
    ----------
    first_rows : ndarray of shape (n_signals, order + 1)
        R(0, b).
    entering, leaving : ndarray of shape (n_signals, order + 1)
        e and l, with 0 in front. They are overwritten.
    ridges : ndarray of shape (n_signals,)
        The ridge of each signal, above 0. If it is 0, the solution is 0.

    Returns
    -------
    ndarray of shape (n_signals, order)
        The solutions.
    """
    order = first_rows.shape[1] - 1
    solutions = np.zeros((len(first_rows), order))
    u, v = np.empty((2, order + 1))
    factor = np.empty((order, order + 1))
    _fill_solutions(first_rows, entering, leaving, ridges, u, v, factor, solutions)
    return solutions


@compiled
def _fill_solutions(first_rows, entering, leaving, ridges, u, v, factor, solutions):
    """Fill `solutions`; u, v and the factor are those of one signal."""
    n_signals, order = solutions.shape
    for w in range(n_signals):
        if ridges[w] == 0:
            continue
        scale = 1 / np.sqrt(first_rows[w, 0] + ridges[w])
        for b in range(order + 1):
            u[b] = v[b] = first_rows[w, b] * scale
        u[0], v[0] = 1 / scale, 0.0
        for a in range(order):
            n = order + 1 - a
            plus, enters, minus, leaves = u[:n], entering[w, a:], v[a:], leaving[w, a:]
            factor_row = factor[a, a:]
            gain = np.sqrt(plus[0] * plus[0] + enters[0] * enters[0])
            loss = np.sqrt(minus[0] * minus[0] + leaves[0] * leaves[0])
            cos_plus, sin_plus = plus[0] / gain, enters[0] / gain
            cos_minus, sin_minus = (minus[0] / loss, leaves[0] / loss) if loss > 0 else (1.0, 0.0)
            tanh = loss / gain
            # Above 0 by the ridge, but for rounding.
            sech = np.sqrt(max((1 - tanh) * (1 + tanh), _EPS))
            cosh = 1 / sech
            for j in range(n):
                p, q, r, s = plus[j], enters[j], minus[j], leaves[j]
                enters[j] = cos_plus * q - sin_plus * p
                leaves[j] = cos_minus * s - sin_minus * r
                r = cos_minus * r + sin_minus * s
                p = (cos_plus * p + sin_plus * q - tanh * r) * cosh
                minus[j] = sech * r - tanh * p
                plus[j] = p
                factor_row[j] = p
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
