"""Times of samples: the channel that holds them, their rate, and whether they are even."""

from dataclasses import dataclass
from decimal import Decimal
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .contents import ContentError, Contents
from .facts import (
    RATE_TOLERANCE,
    SECONDS,
    names_times,
    parse_number,
    rounded,
    seconds_of_date,
    seconds_of_day,
    time_unit_in_name,
)

DAY = 86400.0
#: Times from which the sampling rate is computed, and more if they are too coarse.
_N_PROBED = 10_000
_N_COARSE = 1_000_000
#: Coarse times give a sampling rate if it is known to this share.
_COARSE_TOLERANCE = 5e-3
#: Samples and steps of times by which one may be late.
_LATE = 0.6
_LATE_STEPS = 0.5
#: Share of the steps of times that have the same sign. The others are jumps of the
#: clock.
_ONE_WAY = 0.9
#: Share by which the rate of the times may differ from the sampling rate, apart from
#: rounding; seconds over which it is measured; and samples before it is checked.
DRIFT = 0.01
_MEASURED_FOR = 10.0
_SHORTEST = 100
#: Numbers since 1970 in units below the second: from which number on, and the unit.
_SINCE_1970 = {1e17: 1e-9, 1e14: 1e-6, 1e11: 1e-3}
#: Days of spreadsheets since 1900 and of MATLAB since the year 0, for about a century.
_DAYS = ((20_000, 80_000), (690_000, 760_000))
#: Sampling rates in Hz beyond which times without a unit are not taken for seconds.
#: Seconds of half a day and more are not counted in microseconds.
_LOWEST_RATE = 10.0
_HIGHEST_RATE = 1e6
#: Other units than seconds in which times without a unit may be.
_OTHER_UNITS = (1e-3, 1e-6, 1e-9, 60.0, 3600.0, DAY)
#: Last times that show the number of decimals that are written, and last steps that show
#: how coarse times became.
_N_WRITTEN = 100
_N_LAST = 10
#: Steps of the last decimal from which two equal times are not the same by rounding, and
#: seconds below which a decimal was computed, not written.
_FINE = 1.5
_FINEST = 1e-10


@dataclass(frozen=True)
class TimeAxis:
    """Channel of times. They are those of all channels of its length.

    Attributes
    ----------
    name : str
        Its name.
    length : int or None
        Samples. None if all channels of the file are equally long.
    sampling_rate : float
        In Hz.
    start : float or None
        Seconds since 1970 at the first sample; None if the times are not dates.
    resolution : float
        Seconds of the smallest step.
    scale : float
        Seconds of the unit of the values.
    """

    name: str
    length: int | None
    sampling_rate: float
    start: float | None = None
    resolution: float = 0.0
    scale: float = 1.0


class EvenTimes:
    """Check that the times of a file are even, block by block.

    A sample of unknown time follows the sample before. Equal times were rounded. No
    step from one time to the next may fall, or be late by more than the tolerance. The
    rate over the last ten seconds must agree with the sampling rate within 1 % and the
    rounding of the times.

    Parameters
    ----------
    axis : TimeAxis
        The channel of times.
    rate : float
        Sampling rate in Hz.
    """

    def __init__(self, axis: TimeAxis, rate: float) -> None:
        self._axis = axis
        self._rate = rate
        self._n_samples = 0
        # Samples and seconds of the last known time: the first sample that has it, and
        # the last one.
        self._samples = np.empty(0, dtype=int)
        self._seconds = np.empty(0)

    def check(self, values: Any) -> None:
        """Refuse times that are not even, in themselves or after the block before.

        Parameters
        ----------
        values : ndarray of shape (n_samples,)
            Times of the next block.
        """
        axis = self._axis
        times, _ = in_seconds(values, axis.scale, self._seconds[-1:])
        known = np.flatnonzero(np.isfinite(times))
        samples = np.append(self._samples, known + self._n_samples)
        seconds = np.append(self._seconds, times[known])
        self._n_samples += len(times)
        if not len(samples):
            return
        changed = changes(seconds)
        self._samples = samples[[changed[-1], -1]]
        self._seconds = seconds[[changed[-1], -1]]
        steps = np.diff(seconds[changed])
        n_steps = np.diff(samples[changed])
        is_break = _breaks(steps, n_steps, 1 / self._rate, axis.resolution)
        if is_break.any():
            i = np.argmax(is_break)
            raise ContentError(
                f"{axis.name!r} is not evenly spaced: {steps[i]:g} s before sample "
                f"{samples[changed[i + 1]]}, expected {1 / self._rate:g} s"
            )
        checked = np.append(changed, -1)
        largest = np.abs(steps).max(initial=axis.resolution)
        self._check_rate(samples[checked], seconds[checked], largest)

    def _check_rate(self, samples, seconds, largest):
        """Refuse times of another rate, and those that stand still."""
        before = samples - int(_MEASURED_FOR * self._rate)
        origin = np.maximum(np.searchsorted(samples, before, side="right") - 1, 0)
        n_samples = samples - samples[origin]
        passed = seconds - seconds[origin]
        expected = n_samples / self._rate
        is_wrong = np.abs(passed - expected) > DRIFT * expected + 2 * largest
        is_wrong &= n_samples >= _SHORTEST
        if is_wrong.any():
            i = np.argmax(is_wrong)
            raise ContentError(
                f"{self._axis.name!r} is not evenly spaced: {n_samples[i]} samples before "
                f"sample {samples[i]} take {passed[i]:g} s, expected {expected[i]:g} s at "
                f"{self._rate:g} Hz"
            )


def _breaks(steps, n_samples, period, resolution):
    """Return which steps fall, or are later than the samples in them."""
    # Times of few digits lose decimals as they grow, which the last steps show.
    if len(steps) >= _N_LAST:
        resolution = max(resolution, np.abs(steps[-_N_LAST:]).min())
    late = steps - np.maximum(n_samples * period, resolution)
    return (steps <= 0) | (late > max(_LATE * period, _LATE_STEPS * resolution))


def find_time_axis(
    contents: Contents, stated_rate: float | None = None
) -> TimeAxis | None:
    """Find the channel of times, None if there is none.

    Its name is one such as ``time``, ``t`` or ``seconds``, or its unit is one of time.
    Its values are numbers, dates, or texts of dates or times of day, most of which
    rise, or most of which fall. Some may be unknown. Integers without a unit are not
    times, unless they count since 1970: they may count samples.

    Numbers without a unit are seconds. They are smaller units if they are so large that
    they count these since 1970; days of a spreadsheet if seconds would give a sampling
    rate above 1 MHz; and the unit that gives the stated rate, if one does. Seconds that
    would give a rate below 10 Hz, which no analysis of bearings uses, are not times.

    Parameters
    ----------
    contents : Contents
        Of the file.
    stated_rate : float or None
        Sampling rate in Hz that the user states.

    Raises
    ------
    ContentError
        If equal times do not come from rounding, and give another rate than the stated
        one.
    """
    if len(contents.channels) < 2:
        return None
    axes = (_axis(contents, name, stated_rate) for name in contents.channels)
    return next((axis for axis in axes if axis is not None), None)


def _axis(contents, name, stated_rate, n_probed=_N_PROBED):
    """Return the axis of a channel, judged by its first times; None if it has no times."""
    channel = contents.channels[name]
    unit = channel.unit or time_unit_in_name(name)
    scale = SECONDS.get((unit or "").strip().lower(), np.nan)
    if np.isnan(scale) and not names_times(name):
        return None
    (values,) = next(contents.read([name], n_probed), [np.zeros(0)])
    values = np.asarray(values[:n_probed])
    times, kind = in_seconds(values, scale if unit else 1.0)
    timed = np.flatnonzero(np.isfinite(times))
    if len(timed) < 2:
        return None
    is_guessed = kind == "number" and unit is None
    if is_guessed:
        scale = _guessed_scale(times[timed], stated_rate)
        times = times * scale
        is_count = np.median(np.diff(times[timed])) == 1
        if scale == 1 and (values.dtype.kind in "iu" or is_count):
            return None
    changed = changes(times)
    steps = np.diff(times[changed])
    if len(steps) and max(np.mean(steps > 0), np.mean(steps < 0)) < _ONE_WAY:
        return None
    rate, tolerance = rate_of_times(times)
    if tolerance >= RATE_TOLERANCE and len(times) == n_probed < _N_COARSE:
        return _axis(contents, name, stated_rate, _N_COARSE)
    is_slow = is_guessed and scale == 1 and rate < _LOWEST_RATE and stated_rate is None
    if is_slow or not len(steps):
        return None
    scale = scale if kind == "number" else 1.0
    digit = channel.last_digit and channel.last_digit * scale
    problem = _problem_of_equal(contents, name, times, digit)
    is_stated = stated_rate is not None and abs(rate / stated_rate - 1) <= DRIFT
    if problem and not is_stated:
        raise ContentError(problem)
    if tolerance > _COARSE_TOLERANCE:
        return None
    return TimeAxis(
        name,
        channel.length,
        rate,
        float(times[changed[0]] - changed[0] / rate) if kind == "date" else None,
        float(np.abs(steps).min()),
        scale,
    )


def _guessed_scale(times, stated_rate):
    """Return the seconds of the unit of times that state none."""
    first = abs(times[0])
    for least, scale in _SINCE_1970.items():
        if first >= least:
            return scale
    steps = np.abs(np.diff(times))
    step = float(np.median(steps[steps > 0])) if steps.any() else np.nan
    if step < 1 / _HIGHEST_RATE and any(low < first < high for low, high in _DAYS):
        return DAY
    if stated_rate is not None:
        for scale in _OTHER_UNITS:
            if abs(stated_rate * step * scale - 1) < 0.01:
                return scale
    return 1.0


def _problem_of_equal(contents, name, times, last_digit):
    """Return why equal times are not rounded, empty if they are or there are none."""
    samples = np.flatnonzero(np.isfinite(times))
    known = times[samples]
    starts = changes(known)
    sizes = np.diff(starts, append=len(known))
    if len(starts) == len(known) or len(sizes) < 3:
        return ""
    others = [
        other
        for other, channel in contents.channels.items()
        if other != name and channel.length == contents.channels[name].length
    ]
    columns = next(contents.read(others, len(times)), [])
    columns = {o: np.asarray(c)[samples] for o, c in zip(others, columns, strict=True)}
    repeats = np.delete(np.arange(len(known)), starts)
    first = int(repeats[0])
    sample = samples[first]
    n_equal = sizes[0]
    tags = [o for o, c in columns.items() if len({*c.tolist()}) == n_equal > 1]
    problem = (
        f"{name!r} is {known[first]:.10g} s in samples {sample - 1} and {sample}, though "
        "times are written more finely than samples follow: remove rows that are repeated, "
        f"and make one column of each {repr(tags[0]) if tags else 'sensor'}"
    )
    varying = [c for c in columns.values() if np.mean(c[1:] == c[:-1]) < 0.5]
    if varying and all(np.all(c[repeats] == c[repeats - 1]) for c in varying):
        return problem
    usual = np.median(np.abs(np.diff(known[starts])))
    written = last_digit or last_decimal(known[-_N_WRITTEN:])
    is_slow_clock = sizes[1:-1].min() > 2 and np.ptp(sizes[1:-1]) > 0
    is_finer = _FINEST < written < usual / _FINE
    return problem if is_finer and not is_slow_clock else ""


def changes(times: NDArray[Any]) -> NDArray[Any]:
    """Return the samples whose time is known and differs from the last known one.

    Examples
    --------
    >>> changes(np.array([0.5, 0.5, np.nan, 0.5, 0.6, np.nan]))
    array([0, 4])
    """
    samples = np.flatnonzero(np.isfinite(times))
    return samples[np.diff(times[samples], prepend=np.nan) != 0]


def last_decimal(numbers: NDArray[Any]) -> float:
    """Return the value of the last decimal of numbers, of which 15 digits are right.

    Examples
    --------
    >>> last_decimal(np.array([0.25, 0.1 + 0.2, 13.5]))
    0.01
    """
    digits = (Decimal(f"{number:.15g}").normalize() for number in numbers)
    return 10.0 ** min(digit.as_tuple().exponent for digit in digits)


def rate_of_times(times: NDArray[Any]) -> tuple[float, float]:
    """Return the sampling rate of times, and its relative tolerance.

    A straight line is fitted to the different times, each at the centre of the samples
    that have it. A gap or a jump is no time that samples took.

    Examples
    --------
    >>> rate_of_times(np.array([0.0, 0.02, 0.04, 60.06, 60.08]))
    (50.0, 1e-05)
    """
    known = np.flatnonzero(np.isfinite(times))
    changed = changes(times)
    if len(changed) < 2:
        return np.nan, np.inf
    n_steps = np.diff(changed)
    steps = np.diff(times[changed])
    usual = np.median(steps / n_steps)
    is_break = _breaks(steps, n_steps, usual, np.abs(steps).min())
    seconds = np.append(0, np.cumsum(np.where(is_break, usual * n_steps, steps)))
    before_change = known[np.searchsorted(known, changed[1:]) - 1]
    samples = (changed + np.append(before_change, known[-1])) / 2
    tolerance = 1e-5
    if len(changed) < len(known):
        # Coarse times: the first and the last of them may have had more samples.
        samples = samples[1:-1]
        seconds = seconds[1:-1]
        if len(samples) < 2:
            return np.nan, np.inf
        tolerance = 2 / np.sqrt(len(samples)) / np.ptp(samples)
    line = np.polyfit(samples, seconds, 1)
    error = np.std(seconds - np.polyval(line, samples)) / np.std(samples)
    relative = 2 * error / np.sqrt(len(samples)) / abs(line[0])
    tolerance = max(tolerance, relative)
    return rounded(1 / abs(line[0]), tolerance), tolerance


def in_seconds(values: Any, scale: float, before: Any = ()) -> tuple[NDArray[Any], str]:
    """Return times in seconds, NaN if unknown, and whether they are numbers, dates or of day.

    Times of day rise over midnight, after the last one `before`.
    """
    values = np.asarray(values)
    kind = values.dtype.kind
    if kind in "mM":
        seconds = values.astype(f"{kind}8[ns]").astype(np.int64) / 1e9
        is_known = ~np.isnat(values)
        return np.where(is_known, seconds, np.nan), "date" if kind == "M" else "day"
    if kind in "OUT":
        texts = [str(text) for text in values.tolist()]
        dates = np.array([seconds_of_date(text) for text in texts])
        if np.isfinite(dates).any():
            return dates, "date"
        clock = np.array([seconds_of_day(text) for text in texts])
        is_known = np.isfinite(clock)
        if is_known.any():
            known = np.append(before, clock[is_known])
            clock[is_known] = np.unwrap(known, period=DAY)[len(before) :]
            return clock, "day"
        values = np.array([parse_number(text) for text in texts])
    elif kind not in "fiu":
        return np.full(len(values), np.nan), "number"
    return values.astype(np.float64) * scale, "number"
