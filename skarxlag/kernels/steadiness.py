"""Mean and median power of each band of a signal, from its short-time spectrum."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .compiled import compiled, inlined

#: Bands that are sorted side by side: with a hundred segments they fit the nearest cache.
_SIDE_BY_SIDE = 32


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
    n_segments = (signals.shape[1] - len(window)) // hop + 1
    segments = np.empty((len(signals), n_segments, len(window)))
    _fill_segments(signals, window, hop, segments)
    return segments


@compiled
def _fill_segments(signals, window, hop, segments):
    for w in range(segments.shape[0]):
        for s in range(segments.shape[1]):
            samples, target = signals[w, s * hop :], segments[w, s]
            for k in range(len(window)):
                target[k] = samples[k] * window[k]


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


def mean_and_median(spectra: Any, floor: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Compute the mean and the median power of each band over time.

    Parameters
    ----------
    spectra : ndarray of shape (n_signals, n_segments, n_bands), complex
        Short-time spectra.
    floor : ndarray of shape (n_signals,)
        Value above 0 that is added to the power of each signal.

    Returns
    -------
    mean, median : ndarray of shape (n_signals, n_bands)
        Mean and median, in the squared unit of the spectra.
    """
    n_signals, n_segments, n_bands = spectra.shape
    levels = np.empty((2, n_signals, n_bands))
    _fill_levels(
        spectra, floor, np.zeros((n_segments, _SIDE_BY_SIDE)), np.empty(_SIDE_BY_SIDE), levels
    )
    return levels[0], levels[1]


@compiled
def _fill_levels(spectra, floor, power, total, levels):
    """Fill mean and median; `power` and `total` are for some bands of one signal."""
    n_signals, n_segments, n_bands = spectra.shape
    lower, upper = power[(n_segments - 1) // 2], power[n_segments // 2]
    for w in range(n_signals):
        for first in range(0, n_bands, _SIDE_BY_SIDE):
            n = min(_SIDE_BY_SIDE, n_bands - first)
            for i in range(_SIDE_BY_SIDE):
                total[i] = 0.0
            least = floor[w]
            for s in range(n_segments):
                bands, row = spectra[w, s, first:], power[s]
                for i in range(n):
                    row[i] = bands[i].real * bands[i].real + bands[i].imag * bands[i].imag + least
                    total[i] += row[i]
            sort_columns(power)
            for i in range(n):
                levels[0, w, first + i] = total[i] / n_segments
                levels[1, w, first + i] = (lower[i] + upper[i]) / 2
