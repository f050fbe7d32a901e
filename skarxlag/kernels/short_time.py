"""Mean and median power of each band over the segments of a signal.

Segments of `LENGTH` samples are transformed side by side, by a Fourier transform that
is compiled for this length, and the spectra of one signal fit the nearest caches. Its
arithmetic is in single precision, whose rounding is 140 dB below the signal.
"""

from functools import lru_cache

import numpy as np
from scipy import fft

from .arrays import Array
from .compiled import compiled, inlined

#: Samples of a segment for which the transform is compiled. Two samples make one
#: complex number.
LENGTH = 128
_HALF = LENGTH // 2
#: Segments that are transformed together.
_LANES = 72
#: Distances in a block of complex numbers: from real to imaginary parts, and a quarter
#: of that.
_IMAGINARY = _HALF * _LANES
_STEP = _HALF // 4 * _LANES
_PHASES = -2 * np.pi * np.arange(_HALF) / LENGTH
_REVOLUTIONS = np.array([np.cos(_PHASES), np.sin(_PHASES)], dtype=np.float32)


def band_levels(
    signals: Array, window: Array, hop: int, floor: Array
) -> tuple[Array, Array]:
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
        Power of the bands above frequency 0, without the Nyquist frequency.

    Examples
    --------
    >>> tone = np.cos(np.pi / 8 * np.arange(64.0))[np.newaxis]
    >>> mean, median = band_levels(tone, np.ones(16), 4, np.array([1e-12]))
    >>> median.round(3)
    array([[64.,  0.,  0.,  0.,  0.,  0.,  0.]])
    """
    if len(window) == LENGTH:
        power = _compiled_power(signals, window, hop, floor)
    else:
        spectra = fft.rfft(windowed_segments(signals, window, hop))
        bands = spectra[..., 1 : len(window) // 2]
        of_segments = bands.real**2 + bands.imag**2 + floor[:, np.newaxis, np.newaxis]
        power = np.swapaxes(of_segments, 1, 2).copy()
    n_segments = power.shape[2]
    mean = power.mean(axis=2)
    power.sort(axis=2)
    median = (power[..., (n_segments - 1) // 2] + power[..., n_segments // 2]) / 2
    return mean, median


def _compiled_power(signals, window, hop, floor):
    """Return the power of each band and segment in single precision."""
    n_segments = (signals.shape[1] - LENGTH) // hop + 1
    n_columns = -(-n_segments // _LANES) * _LANES + -(-LENGTH // hop)
    power = np.empty((len(signals), _HALF - 1, n_segments), dtype=np.float32)
    _fill_segments(
        np.ascontiguousarray(signals, dtype=np.float32),
        # The join of the spectra of even and odd samples doubles them.
        (window / 2).astype(np.float32),
        floor.astype(np.float32),
        _REVOLUTIONS,
        np.zeros((hop, n_columns), dtype=np.float32),
        np.empty((2, 2 * _IMAGINARY), dtype=np.float32),
        power,
    )
    return power


@lru_cache(maxsize=16)
def hann_window(length: int) -> Array:
    """Return a Hann window without the zeros at its ends; it cannot be written to."""
    window = np.hanning(length + 2)[1:-1]
    window.flags.writeable = False
    return window


def windowed_segments(signals: Array, window: Array, hop: int) -> Array:
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
def _fill_segments(signals, window, floor, turns, phases, blocks, power):
    """Fill the power of each band and segment; `phases` and `blocks` are working memory."""
    hop = len(phases)
    n_segments = power.shape[2]
    for w in range(len(signals)):
        # Row k of the phases holds the samples k, k + hop, k + 2 hop ...
        for k in range(hop):
            samples = signals[w, k::hop]
            for i in range(len(samples)):
                phases[k, i] = samples[i]
        for first in range(0, n_segments, _LANES):
            # Even samples are real parts, and odd ones are imaginary parts.
            for k in range(LENGTH):
                samples = phases[k % hop, first + k // hop :]
                part = blocks[0, k // 2 * _LANES + k % 2 * _IMAGINARY :]
                for lane in range(_LANES):
                    part[lane] = window[k] * samples[lane]
            source = blocks[0]
            target = blocks[1]
            for stride in (_HALF // 4, _HALF // 16, _HALF // 64):
                _quarters(source, target, turns, stride)
                source, target = target, source
            _fill_power(source, turns, floor[w], target)
            for band in range(1, _HALF):
                of_band = target[band * _LANES :]
                for lane in range(min(_LANES, n_segments - first)):
                    power[w, band - 1, first + lane] = of_band[lane]


@inlined
def _quarters(source, target, turns, stride):
    """Run one pass of Stockham's transform with four-point butterflies.

    All writes are at constant distances, as vector instructions need them.
    """
    n = stride * _LANES
    for p in range(_HALF // 4 // stride):
        # Cosine and sine of an angle, of twice and of three times this angle.
        c1 = turns[0, 2 * p * stride]
        s1 = turns[1, 2 * p * stride]
        c2 = c1 * c1 - s1 * s1
        s2 = np.float32(2.0) * c1 * s1
        c3 = c1 * c2 - s1 * s2
        s3 = c1 * s2 + s1 * c2
        a = source[4 * p * n :]
        b = source[(4 * p + 1) * n :]
        c = source[(4 * p + 2) * n :]
        d = source[(4 * p + 3) * n :]
        out = target[p * n :]
        for i in range(n):
            br = b[i] * c1 - b[i + _IMAGINARY] * s1
            bi = b[i] * s1 + b[i + _IMAGINARY] * c1
            cr = c[i] * c2 - c[i + _IMAGINARY] * s2
            ci = c[i] * s2 + c[i + _IMAGINARY] * c2
            dr = d[i] * c3 - d[i + _IMAGINARY] * s3
            di = d[i] * s3 + d[i + _IMAGINARY] * c3
            er = a[i] + cr
            ei = a[i + _IMAGINARY] + ci
            fr = a[i] - cr
            fi = a[i + _IMAGINARY] - ci
            gr = br + dr
            gi = bi + di
            hr = br - dr
            hi = bi - di
            out[i] = er + gr
            out[i + _IMAGINARY] = ei + gi
            out[i + _STEP] = fr + hi
            out[i + _STEP + _IMAGINARY] = fi - hr
            out[i + 2 * _STEP] = er - gr
            out[i + 2 * _STEP + _IMAGINARY] = ei - gi
            out[i + 3 * _STEP] = fr - hi
            out[i + 3 * _STEP + _IMAGINARY] = fi + hr


@inlined
def _fill_power(block, turns, floor, power):
    """Separate the spectra of even and odd samples, join them, and write the power of each band."""
    for band in range(1, _HALF):
        cosine = turns[0, band]
        sine = turns[1, band]
        z = block[band * _LANES :]
        mirror = block[(_HALF - band) * _LANES :]
        row = power[band * _LANES :]
        for lane in range(_LANES):
            i = lane + _IMAGINARY
            even_r = z[lane] + mirror[lane]
            even_i = z[i] - mirror[i]
            odd_r = z[i] + mirror[i]
            odd_i = mirror[lane] - z[lane]
            real = even_r + odd_r * cosine - odd_i * sine
            imag = even_i + odd_r * sine + odd_i * cosine
            row[lane] = real * real + imag * imag + floor
