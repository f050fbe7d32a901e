"""Residual evaluation: one number for each signal (Eqs. 21 and 22, and the innovations test)."""

import numpy as np
from scipy.fft import dct

from .arx_laguerre import accumulate_sums
from .laguerre import laguerre_response
from .least_squares import solve_sums
from .observer import adapt_switching_gain
from .scaling import root_mean_square

#: Share of a window over which the switching gain is averaged, at its end, once it has settled.
_SETTLED = 0.5


def sliding_surface(error, slope):
    r"""The surface :math:`S(k) = \lambda e(k) + (e(k) - e(k-1))`, with e(-1) = e(0).

    Parameters
    ----------
    error : ndarray of shape (..., n_samples)
        The output error e.
    slope : float
        The slope :math:`\lambda`, at least 0.

    Returns
    -------
    ndarray of shape (..., n_samples)
        The surface, in the unit of the error.

    Examples
    --------
    >>> sliding_surface(np.array([1.0, 3.0, 2.0]), slope=0.5)
    array([0.5, 3.5, 0. ])
    """
    return slope * error + np.diff(error, axis=-1, prepend=error[..., :1])


def switching_gain(surface, step):
    """Trajectory of the adapted switching gain, which starts at the surface's RMS.

    Parameters
    ----------
    surface : ndarray of shape (n_signals, n_samples)
        The sliding surface.
    step : float
        Step of the gain's logarithm a sample, above 0.

    Returns
    -------
    ndarray of shape (n_signals, n_samples)
        The gain, in the unit of the surface.
    """
    return adapt_switching_gain(surface, root_mean_square(surface), step)


def settled_level(gain):
    """Geometric mean of a gain over the last half of the window; 0 where the gain is 0."""
    tail = gain[..., int(_SETTLED * gain.shape[-1]) :]
    silent = tail[..., 0] == 0
    level = np.exp(np.mean(np.log(np.where(silent[..., np.newaxis], 1.0, tail)), axis=-1))
    return np.where(silent, 0.0, level)


def log_spectrum(signals, order, pole, alpha, frequency):
    r"""Log power spectrum of each signal by the Laguerre network identified on it alone.

    :math:`-\log|1 - \sum_n g_n L_n(e^{j\omega})|^2`, without the constant that the innovations'
    power adds.

    Parameters
    ----------
    signals : ndarray of shape (n_signals, n_samples)
        Signals of unit root-mean-square.
    order : int
        Number of filters.
    pole : float
        Their pole.
    alpha : float
        Ridge.
    frequency : ndarray of shape (n_frequencies,)
        Radians a sample.

    Returns
    -------
    ndarray of shape (n_signals, n_frequencies)
        Natural logarithm of power, up to a constant.
    """
    orders, poles, one = np.array([order]), np.array([float(pole)]), np.ones(1)
    n_transient = min(order, signals.shape[-1] // 2)
    filters = laguerre_response(order, pole, frequency)
    coef = np.empty((len(signals), order))
    for row, signal in enumerate(signals):
        sums = accumulate_sums(signal[np.newaxis, np.newaxis], one, orders, poles, n_transient)
        coef[row] = solve_sums(sums, alpha)[0]
    prediction_error_filter = 1 - coef @ filters
    tiny = np.finfo(np.float64).tiny
    return -np.log(np.maximum(np.abs(prediction_error_filter) ** 2, tiny))


def cepstral_distance(log_spectra, exponent):
    r"""Weighted cepstral norm :math:`\sum_{n \ge 1} n^p d_n^2` of log spectra.

    d is the orthonormal DCT-II over frequency. Coefficient 0, the gain, is left out; p = 1 is
    Martin's metric between autoregressive models (Martin 2000).

    Parameters
    ----------
    log_spectra : ndarray of shape (..., n_frequencies)
        Log spectra at the midpoints of equal cells.
    exponent : float
        The exponent p, at least 0.

    Returns
    -------
    ndarray of shape (...)
        The norm; 0 for a white spectrum, whatever its power.

    Examples
    --------
    >>> cepstral_distance(np.full(8, 3.0), exponent=0.5).round(12)
    array(0.)
    """
    cepstrum = dct(log_spectra, type=2, norm="ortho", axis=-1)[..., 1:]
    weights = np.arange(1.0, cepstrum.shape[-1] + 1) ** exponent
    return np.sum(weights * cepstrum**2, axis=-1)
