"""What a signal's spectrum looks like and how steady each band is, one signal at a time.

Every signal is worked on by itself, so that results do not depend on which others it comes with.
"""

import math

import numpy as np
from scipy import fft, signal

from .compiled import compiled
from .scaling import root_mean_square

#: Cells of (0, pi) on which the log spectrum of a window is taken.
LOG_SPECTRUM_CELLS = 256
#: Least number of samples for each coefficient of a signal's own model: with fewer it describes the
#: noise of the signal rather than its spectrum.
_SAMPLES_A_COEFFICIENT = 8


def frequency_grid(n_frequencies):
    """Midpoints of equal cells on (0, pi), in radians a sample."""
    return (np.arange(n_frequencies) + 0.5) * np.pi / n_frequencies


@compiled
def lagged_sums(samples, order):
    """Covariance-method sums of one signal, each from the one before it on the diagonal.

    Parameters
    ----------
    samples : ndarray of shape (n_samples,)
        The signal.
    order : int
        Largest lag, below n_samples.

    Returns
    -------
    ndarray of shape (order + 1, order + 1)
        Entry (i, j) is the sum of s(k - i) s(k - j) over k = order .. n_samples - 1.
    """
    n_samples = len(samples)
    sums = np.zeros((order + 1, order + 1))
    # Reversed, the samples that a sample meets lie one after another, which vectorises.
    backwards = samples[::-1].copy()
    for k in range(order, n_samples):
        for j in range(order + 1):
            sums[0, j] += samples[k] * backwards[n_samples - 1 - k + j]
    sums[:, 0] = sums[0]
    for i in range(order):
        for j in range(i, order):
            entering = samples[order - 1 - i] * samples[order - 1 - j]
            leaving = samples[n_samples - 1 - i] * samples[n_samples - 1 - j]
            sums[i + 1, j + 1] = sums[i, j] + entering - leaving
            sums[j + 1, i + 1] = sums[i + 1, j + 1]
    return sums


def autoregressive_log_spectrum(signals, order, n_frequencies, alpha=1e-9):
    r"""Log power spectrum of each signal by the model identified on it alone.

    :math:`-\log|1 - \sum_n g_n e^{-j\omega(n+1)}|^2` with g by least squares: the Laguerre network
    with its pole at 0. The constant that the power of the innovations adds is left out.

    Parameters
    ----------
    signals : ndarray of shape (n_signals, n_samples)
        Signals, in any unit.
    order : int
        Number of filters; at most an eighth of n_samples is used.
    n_frequencies : int
        Midpoints of equal cells on (0, pi), a power of two.
    alpha : float, default=1e-9
        Ridge, as a share of the signal's power.

    Returns
    -------
    ndarray of shape (n_signals, n_frequencies)
        Natural logarithm of power, up to a constant; 0 for a signal of zeros.
    """
    order = min(order, signals.shape[-1] // _SAMPLES_A_COEFFICIENT)
    log_spectra = np.zeros((len(signals), n_frequencies))
    for row, samples in enumerate(signals):
        rms = root_mean_square(samples)
        if rms == 0 or order == 0:
            continue
        sums = lagged_sums(samples / rms, order)
        ridge = alpha * np.trace(sums) / len(sums) * np.eye(order)
        coef = np.linalg.solve(sums[1:, 1:] + ridge, sums[1:, 0])
        # Midpoints of n cells are the odd frequencies of a transform of 4 n points.
        response = fft.rfft(np.concatenate([[1.0], -coef]), 4 * n_frequencies)
        power = np.abs(response[1 : 2 * n_frequencies : 2]) ** 2
        log_spectra[row] = -np.log(np.maximum(power, np.finfo(np.float64).tiny))
    return log_spectra


def band_steadiness(signals, segment, hop):
    r"""How far the median power of each band lies below its mean power.

    The median over time is what a switching gain settles at, the mean is the power; a band in
    which strikes ring has a mean far above its median. Bands are those of a short-time Fourier
    transform with a Hann window.

    Parameters
    ----------
    signals : ndarray of shape (n_signals, n_samples)
        Signals, in any unit.
    segment : int
        Samples in the Hann window.
    hop : int
        Samples from one Hann window to the next.

    Returns
    -------
    ndarray of shape (n_signals, max(segment // 2 - 1, 1))
        :math:`\log(\mathrm{median}\,P / \mathrm{mean}\,P)`, natural; 0 for a band without power
        and where a segment is shorter than 4 samples.
    """
    window = signal.windows.hann(segment + 2)[1:-1]
    n_bands = max(segment // 2 - 1, 1)
    ratio = np.zeros((len(signals), n_bands))
    for row, samples in enumerate(signals):
        rms = root_mean_square(samples)
        if rms == 0 or segment < 4:
            continue
        segments = np.lib.stride_tricks.sliding_window_view(samples / rms, segment)[::hop]
        power = np.abs(fft.rfft(segments * window, axis=-1)[:, 1 : n_bands + 1]) ** 2
        # A band without power is steady: what rounding leaves in it must not count.
        power += 1e-14 * segment
        ratio[row] = np.log(np.median(power, axis=0) / np.mean(power, axis=0))
    return ratio


def cepstrum(log_spectra):
    r"""Cosine coefficients of log spectra, without coefficient 0, the gain.

    :math:`d_n` with :math:`\log P(\omega) = d_0 + \sum_{n \ge 1} d_n \cos n\omega` on the midpoints
    of equal cells on (0, pi), from the orthonormal DCT-II.

    Parameters
    ----------
    log_spectra : ndarray of shape (n_signals, n_frequencies)
        Log spectra.

    Returns
    -------
    ndarray of shape (n_signals, n_frequencies - 1)
        In nepers of power.

    Examples
    --------
    >>> frequency = frequency_grid(8)
    >>> cepstrum(3 + 2 * np.cos(frequency)[np.newaxis])[0, :3].round(6) + 0.0
    array([2., 0., 0.])
    """
    coefficients = np.empty(log_spectra.shape)
    for row, log_spectrum in enumerate(log_spectra):
        coefficients[row] = fft.dct(log_spectrum, type=2, norm="ortho")
    return coefficients[:, 1:] * math.sqrt(2 / max(log_spectra.shape[1], 1))
