"""Times of samples: in seconds, and the sampling rate that they state."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .facts import RATE_TOLERANCE, number, rounded, seconds_of_date, seconds_of_day

DAY = 86400.0
#: Samples and steps of times by which one may be late.
LATE = 0.6
LATE_STEPS = 0.5
#: Coarse times give a sampling rate if it is known to this share.
COARSE_TOLERANCE = 5e-3
#: Parts of the times of which each has its own number of decimals, and times that show
#: it.
_N_PARTS = 16
_N_WRITTEN = 500


def changes(times: NDArray[Any]) -> NDArray[Any]:
    """Return the samples whose time is known and differs from the last known one.

    Examples
    --------
    >>> changes(np.array([0.5, 0.5, np.nan, 0.5, 0.6, np.nan]))
    array([0, 4])
    """
    samples = np.flatnonzero(np.isfinite(times))
    return samples[np.diff(times[samples], prepend=np.nan) != 0]


def last_decimal(times: NDArray[Any]) -> float:
    """Return the last decimal to which times were written, 0 if they have too many.

    Examples
    --------
    >>> last_decimal(np.array([0.25, 0.5, 13.5])), last_decimal(np.array([1 / 3, 2.0]))
    (0.01, 0.0)
    """
    finite = times[np.isfinite(times)][-_N_WRITTEN:]
    if len(finite) and abs(finite[0]) > 1e8:
        # Seconds since 1970 are known to about a microsecond.
        finite = np.round(finite - np.floor(finite[0]), 6)
    for n in range(10):
        if np.allclose(finite, finite.round(n), rtol=4e-16, atol=1e-13):
            return 10.0**-n
    return 0.0


def rate_of_times(
    times: NDArray[Any], timed: NDArray[Any], changed: NDArray[Any]
) -> tuple[float, float]:
    """Return the sampling rate of times, and its relative tolerance.

    `timed` are the samples of known times, and `changed` those of them whose time
    differs from the one before.
    """
    steps = np.diff(times[changed])
    if len(steps) == 0:
        return np.nan, np.inf
    period, tolerance = _growing_steps(times[timed], timed)
    if tolerance < COARSE_TOLERANCE:
        return rounded(1 / period, tolerance), tolerance
    n_between = np.diff(changed)
    usual = np.median(steps / n_between)
    resolution = np.abs(steps).min()
    late = steps - np.maximum(n_between * usual, resolution)
    is_late = late > np.maximum(LATE * usual, LATE_STEPS * resolution)
    if np.any((steps <= 0) | is_late):
        # A gap or a jump is no time that samples took.
        return rounded(1 / abs(usual), RATE_TOLERANCE / 2), RATE_TOLERANCE / 2
    # Coarse times are equal for several samples. How long the first and last of them
    # were equal is unknown, so the rate is that between two changes, which are known to
    # about a sample.
    is_coarse = len(changed) < len(timed)
    ends = changed[[1, -1]] if is_coarse else timed[[0, -1]]
    n_steps = ends[1] - ends[0]
    if n_steps == 0:
        return np.nan, np.inf
    seconds = times[ends[1]] - times[ends[0]]
    tolerance = max(1e-5, 2 * np.spacing(times[ends[1]]) / seconds)
    if is_coarse:
        tolerance = 1.5 / n_steps
    return rounded(n_steps / seconds, tolerance), tolerance


def _growing_steps(times, samples):
    """Return the period of times whose last decimal becomes coarser, and its tolerance.

    Times of few digits, such as ``1.35E+01``, lose decimals as they grow. Each of them
    limits the period, by half of its own last decimal. The tolerance is infinite if
    the last decimal does not grow, or no period fits all times.
    """
    parts = np.array_split(times, _N_PARTS)
    decimals = [last_decimal(part) for part in parts if len(part) > 1]
    if len(decimals) < _N_PARTS or not 0 < decimals[0] < decimals[-1]:
        return np.nan, np.inf
    size = np.floor(np.log10(np.maximum(np.abs(times), decimals[0])))
    half = np.maximum(decimals[-1] * 10 ** (size - size[-1]), decimals[0]) / 2
    passed = (times - times[0])[1:]
    n = (samples - samples[0])[1:]
    slack = (half + half[0])[1:] * (1 + 1e-9)
    low = np.max((passed - slack) / n)
    high = np.min((passed + slack) / n)
    if not 0 < low <= high:
        return np.nan, np.inf
    return (low + high) / 2, max((high - low) / (high + low), 1e-9)


def in_seconds(values: Any, scale: float, before: Any = ()) -> tuple[NDArray[Any], str]:
    """Return times in seconds, NaN if unknown, and whether they are numbers, dates or of day."""
    values = np.asarray(values)
    kind = values.dtype.kind
    if kind in "mM":
        seconds = values.astype(f"{kind}8[ns]").astype(np.int64) / 1e9
        is_known = ~np.isnat(values)
        return np.where(is_known, seconds, np.nan), "date" if kind == "M" else "day"
    if kind in "OUT":
        texts = values.tolist()
        seconds = np.array([seconds_of_date(text) for text in texts])
        if not np.isnan(seconds).all():
            return seconds, "date"
        seconds = np.array([seconds_of_day(text) for text in texts])
        if not np.isnan(seconds).all():
            return _over_midnight(seconds, before), "day"
        values = np.array([number(str(text)) for text in texts])
    elif kind not in "fiu":
        return np.full(len(values), np.nan), "number"
    return values.astype(np.float64) * scale, "number"


def _over_midnight(seconds, before):
    """Return times of day that rise over midnight, after the last one before."""
    is_known = np.isfinite(seconds)
    known = np.append(before, seconds[is_known])
    seconds[is_known] = np.unwrap(known, period=DAY)[len(before) :]
    return seconds
