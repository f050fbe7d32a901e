"""Mean and median power of each band over the segments of a signal, in one pass.

The short-time spectra of one signal fit the nearest caches and are never stored for all signals.
Segments of `LENGTH` samples are transformed by a Fourier transform that is compiled for this length
and works on `_SIDE_BY_SIDE` segments at a time. Other lengths use that of SciPy. All arithmetic is
in single precision, whose rounding is 140 dB below the signal.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from .compiled import compiled, inlined

#: Samples of a segment for which the transform is compiled. Two samples make one complex number.
LENGTH = 128
_HALF, _QUARTER = LENGTH // 2, LENGTH // 8
#: Segments that are transformed together: their complex numbers fit the nearest cache.
_SIDE_BY_SIDE = 24
#: Distances in a block of complex numbers: real to imaginary parts, and a quarter of either.
_IMAGINARY = _HALF * _SIDE_BY_SIDE
_STEP = _QUARTER * _SIDE_BY_SIDE
#: Samples of signals whose segments of another length are worked on together.
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
    segment, n_bands = len(window), len(window) // 2 - 1
    levels = np.empty((2, len(signals), n_bands), dtype=np.float32)
    if segment != LENGTH:
        n_together = max(_SAMPLES_IN_CACHE // signals.shape[1], 1)
        for first in range(0, len(signals), n_together):
            some = slice(first, first + n_together)
            bands = fft.rfft(windowed_segments(signals[some], window, hop))[..., 1 : n_bands + 1]
            power = bands.real**2 + bands.imag**2 + floor[some, np.newaxis, np.newaxis]
            _reduce_power(power, levels[:, some])
        return levels[0], levels[1]
    n_segments = (signals.shape[1] - segment) // hop + 1
    n_blocks = -(-n_segments // _SIDE_BY_SIDE)
    angles = -2j * np.pi * np.arange(_HALF) / LENGTH
    _fill_levels(
        signals,
        # Even and odd samples are joined to twice their spectrum.
        window / np.float32(2.0),
        floor,
        n_segments,
        np.zeros((hop, n_blocks * _SIDE_BY_SIDE + -(-LENGTH // hop)), dtype=np.float32),
        np.exp(angles).view(np.float64).reshape(-1, 2).T.astype(np.float32),
        np.empty((2, 2 * _IMAGINARY), dtype=np.float32),
        np.zeros((_HALF, _SIDE_BY_SIDE), dtype=np.float32),
        np.empty((n_segments, _HALF), dtype=np.float32),
        levels,
    )
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
def _fill_levels(signals, window, floor, n_segments, phases, twiddles, blocks, power, rows, levels):
    """Fill mean and median; the arrays from `blocks` to `rows` are working memory."""
    hop, n_columns = phases.shape
    for w in range(len(signals)):
        # Row k of the phases holds the samples k, k + hop, k + 2 hop ...
        for k in range(hop):
            phase = phases[k]
            for column in range(min(n_columns, (signals.shape[1] - 1 - k) // hop + 1)):
                phase[column] = signals[w, column * hop + k]
        for first in range(0, n_segments, _SIDE_BY_SIDE):
            _fill_block(phases, window, first, blocks[0])
            _quarters(blocks[0], blocks[1], twiddles, 16)
            _quarters(blocks[1], blocks[0], twiddles, 4)
            _quarters(blocks[0], blocks[1], twiddles, 1)
            _fill_power(blocks[1], twiddles, floor[w], power)
            for lane in range(min(_SIDE_BY_SIDE, n_segments - first)):
                row = rows[first + lane]
                for band in range(_HALF):
                    row[band] = power[band, lane]
        _fill_mean_and_median(rows, 1, levels[0, w], levels[1, w])


@compiled
def _reduce_power(power, levels):
    """Fill mean and median of powers of shape (n_signals, n_segments, n_bands); sort the powers."""
    for w in range(len(power)):
        _fill_mean_and_median(power[w], 0, levels[0, w], levels[1, w])


@inlined
def _fill_mean_and_median(rows, first, mean, median):
    """Fill mean and median of the columns from the first one on, and sort the columns."""
    n_rows = len(rows)
    lower, upper = rows[(n_rows - 1) // 2], rows[n_rows // 2]
    for band in range(len(mean)):
        mean[band] = np.float32(0.0)
    for s in range(n_rows):
        row = rows[s, first:]
        for band in range(len(mean)):
            mean[band] += row[band]
    sort_columns(rows)
    for band in range(len(mean)):
        mean[band] *= np.float32(1.0 / n_rows)
        median[band] = (lower[band + first] + upper[band + first]) * np.float32(0.5)


@inlined
def _fill_block(phases, window, first, block):
    """Write even samples of the segments as real parts, and odd ones as imaginary parts."""
    hop = phases.shape[0]
    for k in range(LENGTH):
        column, phase = divmod(k, hop)
        samples, weight = phases[phase, first + column :], window[k]
        target = block[(k // 2) * _SIDE_BY_SIDE + (k % 2) * _IMAGINARY :]
        for lane in range(_SIDE_BY_SIDE):
            target[lane] = weight * samples[lane]


@inlined
def _quarters(source, target, twiddles, stride):
    """Run one pass of Stockham's transform with four-point butterflies.

    All writes are at constant distances, as vector instructions need them.
    """
    n = stride * _SIDE_BY_SIDE
    for p in range(_QUARTER // stride):
        turn = 2 * p * stride
        c1, s1 = twiddles[0, turn], twiddles[1, turn]
        c2, s2 = c1 * c1 - s1 * s1, np.float32(2.0) * c1 * s1
        c3, s3 = c1 * c2 - s1 * s2, c1 * s2 + s1 * c2
        a, b = source[4 * p * n :], source[(4 * p + 1) * n :]
        c, d = source[(4 * p + 2) * n :], source[(4 * p + 3) * n :]
        out = target[p * n :]
        for i in range(n):
            br, bi = b[i] * c1 - b[i + _IMAGINARY] * s1, b[i] * s1 + b[i + _IMAGINARY] * c1
            cr, ci = c[i] * c2 - c[i + _IMAGINARY] * s2, c[i] * s2 + c[i + _IMAGINARY] * c2
            dr, di = d[i] * c3 - d[i + _IMAGINARY] * s3, d[i] * s3 + d[i + _IMAGINARY] * c3
            er, ei = a[i] + cr, a[i + _IMAGINARY] + ci
            fr, fi = a[i] - cr, a[i + _IMAGINARY] - ci
            gr, gi = br + dr, bi + di
            hr, hi = br - dr, bi - di
            out[i] = er + gr
            out[i + _IMAGINARY] = ei + gi
            out[i + _STEP] = fr + hi
            out[i + _STEP + _IMAGINARY] = fi - hr
            out[i + 2 * _STEP] = er - gr
            out[i + 2 * _STEP + _IMAGINARY] = ei - gi
            out[i + 3 * _STEP] = fr - hi
            out[i + 3 * _STEP + _IMAGINARY] = fi + hr


@inlined
def _fill_power(block, twiddles, floor, power):
    """Separate the spectra of even and odd samples, join them, and write the power of each band."""
    for band in range(1, _HALF):
        cosine, sine = twiddles[0, band], twiddles[1, band]
        z, mirror = block[band * _SIDE_BY_SIDE :], block[(_HALF - band) * _SIDE_BY_SIDE :]
        row = power[band]
        for lane in range(_SIDE_BY_SIDE):
            even_r, even_i = (
                z[lane] + mirror[lane],
                z[lane + _IMAGINARY] - mirror[lane + _IMAGINARY],
            )
            odd_r, odd_i = z[lane + _IMAGINARY] + mirror[lane + _IMAGINARY], mirror[lane] - z[lane]
            real = even_r + odd_r * cosine - odd_i * sine
            imag = even_i + odd_r * sine + odd_i * cosine
            row[lane] = real * real + imag * imag + floor


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
