"""Extremes, steps and runs of the samples of signals, in one pass over each signal."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .arrays import Array
from .compiled import compiled


class SampleStatistics(NamedTuple):
    """Statistics of signals, each an array of shape (n_signals,).

    Parameters
    ----------
    span : ndarray
        Largest sample less the smallest.
    n_extreme : ndarray
        Number of samples that are the largest, and of those that are the smallest.
    n_leaps : ndarray
        Number of steps from one sample to the next that are a large share of the span.
    n_held : ndarray
        Number of steps that count as none.
    longest_run : ndarray
        Samples in the longest run without a step.
    smallest_step : ndarray
        Smallest step that counts; infinite if there is none.
    """

    span: NDArray[np.float64]
    n_extreme: NDArray[np.float64]
    n_leaps: NDArray[np.float64]
    n_held: NDArray[np.float64]
    longest_run: NDArray[np.float64]
    smallest_step: NDArray[np.float64]


def sample_statistics(
    signals: Array, leap: float, still: float, rounding: float
) -> SampleStatistics:
    """Compute statistics of the samples of each signal, and of the steps between them.

    Parameters
    ----------
    signals : ndarray of shape (n_signals, n_samples)
        Finite signals, at least one sample each.
    leap : float
        Share of the span beyond which a step is a leap.
    still, rounding : float
        A step counts as none up to this share of the root-mean-square step, and up to
        this size.

    Returns
    -------
    SampleStatistics
        The statistics.

    Examples
    --------
    >>> found = sample_statistics(np.array([[0.0, 0.0, 0.0, 4.0, 3.0]]), 0.75, 1e-4, 0.0)
    >>> [int(value[0]) for value in found]
    [4, 4, 1, 2, 3, 1]
    """
    signals = np.ascontiguousarray(signals, dtype=np.float64)
    statistics = np.empty((len(SampleStatistics._fields), len(signals)))
    _fill_statistics(signals, leap, still, rounding, statistics)
    return SampleStatistics(*statistics)


@compiled
def _fill_statistics(signals, leap, still, rounding, statistics):
    n_signals, n_samples = signals.shape
    for w in range(n_signals):
        highest = lowest = signals[w, 0]
        energy = 0.0
        for k in range(1, n_samples):
            highest = max(highest, signals[w, k])
            lowest = min(lowest, signals[w, k])
            step = signals[w, k] - signals[w, k - 1]
            energy += step * step
        span = highest - lowest
        least = max(still * math.sqrt(energy / n_samples), rounding)
        n_extreme = n_leaps = n_held = 0
        for k in range(n_samples):
            n_extreme += int(signals[w, k] == highest)
            n_extreme += int(signals[w, k] == lowest)
        run = longest_run = 1
        smallest_step = np.inf
        for k in range(1, n_samples):
            step = abs(signals[w, k] - signals[w, k - 1])
            n_leaps += step > leap * span
            run += 1
            if step <= least:
                n_held += 1
            else:
                smallest_step = min(smallest_step, step)
                run = 1
            longest_run = max(longest_run, run)
        statistics[0, w] = span
        statistics[1, w] = n_extreme
        statistics[2, w] = n_leaps
        statistics[3, w] = n_held
        statistics[4, w] = longest_run
        statistics[5, w] = smallest_step
