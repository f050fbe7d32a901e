"""Fundamental frequency near a given one, by a comb of harmonics."""

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.ndimage import median_filter

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
    samples: NDArray[Any], fundamental: float, tolerance: float, n_harmonics: int
) -> float:
    """Frequency whose multiples stand out most from the spectrum.

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
    rows, _ = centred(samples[np.newaxis])
    n_fft = fft.next_fast_len(_PADDING * len(samples), real=True)
    power = np.abs(fft.rfft(rows[0] * np.hanning(len(samples)), n_fft)) ** 2
    highest = min(
        int((n_harmonics + 1) * fundamental * np.exp(tolerance) * n_fft), len(power) - 1
    )
    level = np.log(power[: highest + 1] + _LEAST_POWER * max(power.mean(), 1.0))
    width = 2 * int(_FLOOR_WIDTH * fundamental * n_fft / 2) + 1
    contrast = np.maximum(level - running_median(level, width, "symmetric"), 0)
    # A quarter of a cell of the padded spectrum at the highest multiple.
    step = min(_STEP, 0.25 / (n_harmonics * fundamental * n_fft))
    n_steps = int(tolerance / step + 1e-9)
    candidates = fundamental * np.exp(step * np.arange(-n_steps, n_steps + 1))
    score = np.zeros(len(candidates))
    for harmonic in range(1, n_harmonics + 1):
        position = harmonic * candidates * n_fft
        score += np.interp(position, np.arange(len(contrast)), contrast, right=0.0)
    # Of equals the nominal one, so that a signal without harmonics moves nothing.
    best = np.flatnonzero(score == score.max())
    return candidates[best[np.abs(best - n_steps).argmin()]]


def running_median(
    values: NDArray[Any], size: int, beyond: Literal["edge", "symmetric"]
) -> NDArray[Any]:
    """Compute the median of each value and its neighbours.

    Parameters
    ----------
    values : ndarray of shape (n_values,)
        Values, at least one.
    size : int
        Odd number of values in the median, of any size.
    beyond : {"edge", "symmetric"}
        What follows the ends: the last value, or the values in reverse order.

    Returns
    -------
    ndarray of shape (n_values,)
        Medians.

    Examples
    --------
    >>> running_median(np.array([1.0, 9.0, 2.0, 3.0]), 3, "edge")
    array([1., 2., 3., 3.])
    """
    half = size // 2
    # The filter of SciPy 1.15 to 1.17 writes outside its memory if there are fewer
    # values than it has places.
    padded = np.pad(values, half, mode=beyond)
    return median_filter(padded, size)[half : half + len(values)]
