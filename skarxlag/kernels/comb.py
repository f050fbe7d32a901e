"""Fundamental frequency near a given one, by a comb of harmonics."""

import numpy as np
from scipy import fft

from .arrays import Array
from .running_median import running_median
from .scaling import centred

#: Points of the zero-padded spectrum for each cell of the plain one.
_PADDING = 4
#: Width of the median about a frequency, as a share of the fundamental.
_FLOOR_WIDTH = 0.8
#: Share of the mean power that is added to each frequency before the logarithm.
_LEAST_POWER = 1e-12
#: Largest step of the logarithm of the fundamental.
_STEP = 1e-3


def comb_frequency(
    samples: Array, fundamental: float, tolerance: float, n_harmonics: int
) -> float:
    """Return the frequency whose multiples stand out most from the spectrum.

    Parameters
    ----------
    samples : ndarray of shape (n_samples,)
        A signal in any unit.
    fundamental : float
        Nominal frequency in cycles a sample.
    tolerance : float
        Largest logarithm of the frequency over the nominal one.
    n_harmonics : int
        Multiples that count, as far as they lie below half a cycle a sample.

    Returns
    -------
    float
        In cycles a sample.
    """
    # Multiples that are above the spectrum at every candidate need no finer steps.
    n_harmonics = max(min(n_harmonics, int(0.5 / fundamental * np.exp(tolerance))), 1)
    n_fft = fft.next_fast_len(_PADDING * len(samples), real=True)
    highest = (n_harmonics + 1) * fundamental * np.exp(tolerance)
    width = 2 * int(_FLOOR_WIDTH * fundamental * n_fft / 2) + 1
    contrast = _contrast(samples, n_fft, int(highest * n_fft), width)
    # A quarter of a cell of the padded spectrum at the highest multiple.
    step = min(_STEP, 0.25 / (n_harmonics * fundamental * n_fft))
    n_steps = int(tolerance / step + 1e-9)
    candidates = fundamental * np.exp(step * np.arange(-n_steps, n_steps + 1))
    score = np.zeros(len(candidates))
    cells = np.arange(len(contrast))
    for harmonic in range(1, n_harmonics + 1):
        position = harmonic * candidates * n_fft
        score += np.interp(position, cells, contrast, right=0.0)
    # Of equals the nominal one, so that a signal without harmonics moves nothing.
    best = np.flatnonzero(score == score.max())
    nearest = np.abs(best - n_steps).argmin()
    return candidates[best[nearest]]


def _contrast(samples, n_fft, last_cell, width):
    """Return how far the log power of each cell is above the median of a number of cells."""
    rows, _ = centred(samples[np.newaxis])
    tapered = rows[0] * np.hanning(len(samples))
    power = np.abs(fft.rfft(tapered, n_fft)) ** 2
    floor = _LEAST_POWER * max(power.mean(), 1.0)
    level = np.log(power[: last_cell + 1] + floor)
    median = running_median(level[np.newaxis], width, "symmetric")[0]
    return np.maximum(level - median, 0)
