"""Mean and median power of each band over the segments of a signal.

The short-time spectra of a few signals fit the nearest caches and are never stored for all signals.
All arithmetic is in single precision, whose rounding is 140 dB below the signal.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from .compiled import compiled, inlined

#: Samples of signals whose segments are worked on together.
_SAMPLES_IN_CACHE = 20_000


def band_levels(
    signals: NDArray[Any], window: NDArray[Any], hop: int, floor: NDArray[Any]
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Compute the mean and the median power of each band over the segments of each signal.

    Parameters
    ----------
    signals : ndarray of shape (n_signals, n_samples)
        Signals whose largest value is near 1.
    window : ndarray of shape (segment,)
        Window of a segment, from 4 to n_samples long.
    hop : int
        Samples from one segment to the next.
    floor : ndarray of shape (n_signals,)
        Value above 0 that is added to the power of each signal.

    Returns
    -------
    mean, median : ndarray of shape (n_signals, segment // 2 - 1)
        Mean and median power of the bands above frequency 0, without the Nyquist frequency.

    Examples
    --------
    >>> tone = np.cos(np.pi / 8 * np.arange(64.0))[np.newaxis]
    >>> mean, median = band_levels(tone, np.ones(16), 4, np.array([1e-12]))
    >>> median.round(3)
    array([[64.,  0.,  0.,  0.,  0.,  0.,  0.]], dtype=float32)
    """
    signals = np.ascontiguousarray(signals, dtype=np.float32)
    window, floor = window.astype(np.float32), floor.astype(np.float32)
    n_segments = (signals.shape[1] - len(window)) // hop + 1
    n_bands = len(window) // 2 - 1
    levels = np.empty((2, len(signals), n_bands), dtype=np.float32)
    power = np.empty((n_segments, n_bands), dtype=np.float32)
    n_together = max(_SAMPLES_IN_CACHE // signals.shape[1], 1)
    for first in range(0, len(signals), n_together):
        some = slice(first, first + n_together)
        spectra = fft.rfft(windowed_segments(signals[some], window, hop))
        _fill_levels(spectra, floor[some], power, levels[:, some])
    return levels[0], levels[1]


def windowed_segments(signals: NDArray[Any], window: NDArray[Any], hop: int) -> NDArray[Any]:
    """Cut signals into segments, and multiply each segment by a window.

    Parameters
    ----------
    signals : ndarray of shape (n_signals, n_samples)
        Signals.
    window : ndarray of shape (segment,)
        The window, at most n_samples long.
    hop : int
        Samples from one segment to the next.

    Returns
    -------
    ndarray of shape (n_signals, n_segments, segment)
        The segments that lie completely within a signal.
    """
    segments = np.lib.stride_tricks.sliding_window_view(signals, len(window), axis=1)
    return segments[:, ::hop] * window


@compiled
def _fill_levels(spectra, floor, power, levels):
    """Fill mean and median; `power` is working memory of shape (n_segments, n_bands)."""
    n_segments, n_bands = power.shape
    lower, upper = power[(n_segments - 1) // 2], power[n_segments // 2]
    for w in range(len(spectra)):
        mean, median = levels[0, w], levels[1, w]
        mean[:] = np.float32(0.0)
        for s in range(n_segments):
            row, spectrum = power[s], spectra[w, s, 1:]
            for band in range(n_bands):
                value = spectrum[band]
                row[band] = value.real * value.real + value.imag * value.imag + floor[w]
                mean[band] += row[band]
        sort_columns(power)
        for band in range(n_bands):
            mean[band] *= np.float32(1.0 / n_segments)
            median[band] = (lower[band] + upper[band]) * np.float32(0.5)


@inlined
def sort_columns(rows: NDArray[Any]) -> None:
    """Sort each column in place, by merge exchange.

    The sequence of comparisons does not depend on the values, so all columns are sorted together.
    See K. E. Batcher (1968), "Sorting networks and their applications", AFIPS 32, 307-314, and
    algorithm 5.2.2M in Knuth, "The Art of Computer Programming".

    Parameters
    ----------
    rows : ndarray of shape (n_rows, n_columns)
        Values without NaN; overwritten.
    """
    n_rows, n_columns = rows.shape
    flat = rows.reshape(-1)
    top = 1
    while 2 * top < n_rows:
        top *= 2
    p = top
    while p > 0:
        q, first, distance = top, 0, p
        while distance > 0:
            # Rows first, first + 1, ... first + p - 1 of every 2 p meet those at the distance.
            for row in range(first, n_rows - distance, 2 * p):
                lower, upper = flat[row * n_columns :], flat[(row + distance) * n_columns :]
                for i in range(min(p, n_rows - distance - row) * n_columns):
                    low, high = lower[i], upper[i]
                    lower[i] = low if low < high else high
                    upper[i] = high if low < high else low
            distance, first = q - p, p
            q //= 2
        p //= 2
