"""Residual evaluation: one number for each signal (Eqs. 21 and 22, and the innovations test)."""

import numpy as np

from .observer import adapt_switching_gain
from .scaling import root_mean_square
from .spectra import cepstrum

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


def cepstral_norm(log_spectra, exponent):
    r"""Weighted cepstral norm :math:`\sum_{n \ge 1} n^p d_n^2` of log spectra.

    d are the cosine coefficients over frequency. Coefficient 0, the gain, is left out; p = 1 is
    Martin's metric between autoregressive models (Martin 2000).

    Parameters
    ----------
    log_spectra : ndarray of shape (n_signals, n_frequencies)
        Log spectra at the midpoints of equal cells.
    exponent : float
        The exponent p, at least 0.

    Returns
    -------
    ndarray of shape (n_signals,)
        The norm; 0 for a white spectrum, whatever its power.

    Examples
    --------
    >>> cepstral_norm(np.full((1, 8), 3.0), exponent=0.5).round(12)
    array([0.])
    """
    coefficients = cepstrum(log_spectra)
    weights = np.arange(1.0, coefficients.shape[-1] + 1) ** exponent
    return np.sum(weights * coefficients**2, axis=-1)
