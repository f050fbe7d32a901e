"""Log spectrum of a signal, and steadiness of its bands.

Every signal is processed separately, so that its result does not depend on the other
signals.
"""

import math

import numpy as np
from scipy import fft

from .arrays import Array
from .linear_prediction import predictors
from .scaling import largest
from .short_time import LENGTH, band_levels, hann_window

#: Order of the autoregressive model of a window, if no other is given.
SPECTRUM_ORDER = 128
#: Frequencies at which the spectral shape is evaluated, at least. Their logarithms are
#: averaged over each band, so that a sharp line counts wherever in its band it lies.
_LEAST_CELLS = 252
#: Segments of the short-time spectrum start this share of a segment apart.
_OVERLAP = 8
#: Least power of which the logarithm is taken.
_TINY = np.finfo(np.float64).tiny
#: Share of the power of a segment that stays in an empty band in single precision.
_ROUNDING = 1e-12
#: Least number of samples for each coefficient of a signal's own model: with fewer it
#: describes the noise of the signal rather than its spectrum.
_SAMPLES_A_COEFFICIENT = 8
#: Ridge parameter of this model, relative to the power of the signal: a tone without
#: noise has a model, too.
_RIDGE = 1e-9


def frequency_grid(n_frequencies: int) -> Array:
    """Return the midpoints of equal cells on (0, pi), in radians per sample."""
    return (np.arange(n_frequencies) + 0.5) * np.pi / n_frequencies


def autoregressive_log_spectrum(
    signals: Array, order: int, n_frequencies: int
) -> Array:
    r"""Compute the log power spectrum of each signal from a model identified on this signal alone.

    The spectrum is :math:`-\log|1 - \sum_n g_n e^{-j\omega(n+1)}|^2`, where g is found
    by least squares. The model is a Laguerre network with its pole at 0, which is an
    autoregressive model. The constant that the power of the innovations would add is
    omitted.

    Parameters
    ----------
    signals : ndarray of shape (n_signals, n_samples)
        Signals as `unit_peak` returns them.
    order : int
        Number of filters. At most n_samples / 8 filters are used.
    n_frequencies : int
        Midpoints of equal cells on (0, pi).

    Returns
    -------
    ndarray of shape (n_signals, n_frequencies)
        Natural logarithm of power, up to a constant; 0 for a signal of zeros.
    """
    order = min(order, signals.shape[-1] // _SAMPLES_A_COEFFICIENT)
    if order == 0:
        return np.zeros((len(signals), n_frequencies))
    whitening = np.ones((len(signals), order + 1))
    whitening[:, 1:] = -predictors(signals, order, _RIDGE)
    power = _midpoint_power(whitening, n_frequencies)
    return -np.log(np.maximum(power, _TINY))


def _midpoint_power(coefficients, n):
    """Compute the power of the transform of real rows at the midpoints of n cells on (0, pi)."""
    # The midpoints are the odd multiples of a quarter of a cell's turn.
    step = -(-coefficients.shape[1] // (4 * n))
    transform = np.fft.rfft(coefficients, 4 * n * step)
    response = transform[:, step :: 2 * step]
    return response.real**2 + response.imag**2


def own_spectra(signals: Array, order: int) -> Array:
    """Compute the spectral shape and the steadiness of each signal on common bands.

    Parameters
    ----------
    signals : ndarray of shape (n_signals, n_samples)
        Signals, in any unit.
    order : int
        Order of the autoregressive model of a signal, at least 1.

    Returns
    -------
    ndarray of shape (n_signals, 2, n_bands)
        Log spectrum of the model, up to a constant, and logarithm of median over mean
        power. The short-time spectrum has half as many bands, so two neighbours have
        the same steadiness.

    Examples
    --------
    >>> noise = np.random.default_rng(0).normal(size=(2, 1200))
    >>> own_spectra(noise, 128).shape
    (2, 2, 126)
    """
    unit = unit_peak(signals)
    segment = min(LENGTH, unit.shape[1])
    hop = max(segment // _OVERLAP, 1)
    of_bands = steadiness(unit, segment, hop)
    n_bands = 2 * of_bands.shape[1]
    n_cells = -(-_LEAST_CELLS // n_bands)
    fine = autoregressive_log_spectrum(unit, order, n_bands * n_cells)
    spectra = np.empty((len(unit), 2, n_bands))
    # Sums of which the order does not depend on the number of signals.
    cells = fine.reshape(-1, n_bands, n_cells)
    spectra[:, 0] = np.einsum("wbc->wb", cells) / n_cells
    spectra[:, 1] = np.repeat(of_bands, 2, axis=1)
    return spectra


def steadiness(signals: Array, segment: int, hop: int) -> Array:
    r"""Compute the logarithm of median over mean power of each band over time.

    The bands are those of a short-time Fourier transform with a Hann window. The median
    is the power between impacts. In a band in which impacts ring, the mean is far above
    it.

    Parameters
    ----------
    signals : ndarray of shape (n_signals, n_samples)
        Signals as `unit_peak` returns them.
    segment : int
        Samples in the Hann window, at most n_samples.
    hop : int
        Samples from one Hann window to the next.

    Returns
    -------
    ndarray of shape (n_signals, max(segment // 2 - 1, 1))
        0 for a signal of zeros, and if a segment is shorter than 4 samples.
    """
    if segment < 4:
        return np.zeros((len(signals), 1))
    # A band without power is steady: what rounding leaves in it must not count.
    energy = np.einsum("wk,wk->w", signals, signals)
    floor = _ROUNDING * segment / signals.shape[1] * energy
    floor[floor == 0] = 1.0
    mean, median = band_levels(signals, hann_window(segment), hop, floor)
    return np.log(median, dtype=np.float64) - np.log(mean, dtype=np.float64)


def unit_peak(signals: Array) -> Array:
    """Divide signals by their largest value, so that no square overflows or vanishes.

    Parameters
    ----------
    signals : ndarray of shape (n_signals, n_samples)
        Signals, in any unit.

    Returns
    -------
    ndarray of shape (n_signals, n_samples)
        In one layout and type, for the compiled kernels; a signal of zeros stays one.

    Examples
    --------
    >>> unit_peak(np.array([[1e300, -2e300], [0.0, 0.0]]))
    array([[ 0.5, -1. ],
           [ 0. ,  0. ]])
    """
    signals = np.ascontiguousarray(signals, dtype=np.float64)
    peak = largest(signals)
    peak[peak == 0] = 1.0
    return signals / peak


def cepstrum(log_spectra: Array) -> Array:
    r"""Compute the cosine coefficients of log spectra, without coefficient 0, which is the gain.

    The coefficients :math:`d_n` satisfy :math:`\log P(\omega) = d_0 + \sum_{n \ge 1}
    d_n \cos n\omega` on the midpoints of equal cells on (0, pi). They are computed with
    the orthonormal DCT-II.

    Parameters
    ----------
    log_spectra : ndarray of shape (..., n_frequencies)
        Log spectra.

    Returns
    -------
    ndarray of shape (..., n_frequencies - 1)
        Coefficients in nepers of power.

    Examples
    --------
    >>> frequency = frequency_grid(8)
    >>> cepstrum(3 + 2 * np.cos(frequency)[np.newaxis])[0, :3].round(6) + 0.0
    array([2., 0., 0.])
    """
    coefficients = fft.dct(log_spectra, type=2, norm="ortho")[..., 1:]
    return coefficients * math.sqrt(2 / log_spectra.shape[-1])
