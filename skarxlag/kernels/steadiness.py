"""How steady the power of each band of a signal is, from its short-time spectrum."""

import numpy as np

from .compiled import compiled

#: Bands that are sorted side by side: with a hundred segments they fit the nearest cache.
_SIDE_BY_SIDE = 32


@compiled
def windowed_segments(signals, window, hop):
    """Segments of signals, each times a window.

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
        As many segments as lie within a signal.
    """
    n_signals, n_samples = signals.shape
    segment = len(window)
    n_segments = (n_samples - segment) // hop + 1
    segments = np.empty((n_signals, n_segments, segment))
    for w in range(n_signals):
        for s in range(n_segments):
            samples, target = signals[w, s * hop :], segments[w, s]
            for k in range(segment):
                target[k] = samples[k] * window[k]
    return segments


@compiled
def sort_columns(rows):
    """Sort each column in place, by merge exchange.

    What it compares does not depend on values, so all columns are sorted together: K. E. Batcher
    (1968), "Sorting networks and their applications", AFIPS 32, 307-314; algorithm 5.2.2M in Knuth,
    "The Art of Computer Programming".

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


@compiled
def median_over_mean(spectra, floor):
    """Median power of each band over its mean power.

    Parameters
    ----------
    spectra : ndarray of shape (n_signals, n_segments, n_bands), complex
        Short-time spectra.
    floor : ndarray of shape (n_signals,)
        Added to the power of each signal, above 0.

    Returns
    -------
    ndarray of shape (n_signals, n_bands)
        The ratio, from 0 to 2.
    """
    n_signals, n_segments, n_bands = spectra.shape
    ratio = np.empty((n_signals, n_bands))
    power = np.zeros((n_segments, _SIDE_BY_SIDE))
    total = np.empty(_SIDE_BY_SIDE)
    middle = power[(n_segments - 1) // 2], power[n_segments // 2]
    for w in range(n_signals):
        for first in range(0, n_bands, _SIDE_BY_SIDE):
            n = min(_SIDE_BY_SIDE, n_bands - first)
            total[:] = 0.0
            least = floor[w]
            for s in range(n_segments):
                bands, row = spectra[w, s, first:], power[s]
                for i in range(n):
                    row[i] = bands[i].real * bands[i].real + bands[i].imag * bands[i].imag + least
                    total[i] += row[i]
            sort_columns(power)
            for i in range(n):
                ratio[w, first + i] = (middle[0][i] + middle[1][i]) / 2 * n_segments / total[i]
    return ratio
