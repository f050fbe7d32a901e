"""The channel of times of a file, and the check that its times are even."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .contents import ContentError, Contents
from .facts import RATE_TOLERANCE, SECONDS, letters, names_times, time_unit_in_name
from .times import (
    COARSE_TOLERANCE,
    DAY,
    LATE,
    LATE_STEPS,
    changes,
    in_seconds,
    last_decimal,
    rate_of_times,
)

#: Times from which the sampling rate is computed, and more if they are too coarse.
_N_PROBED = 10_000
_N_COARSE = 1_000_000
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
#: Sampling rate in Hz above which such numbers are days: seconds of half a day and more
#: are not counted in microseconds.
_HIGHEST_RATE = 1e6
#: Other units than seconds in which times without a unit may be.
_OTHER_UNITS = (1e-3, 1e-6, 1e-9, 60.0, 3600.0, DAY)
#: Last times of a block, which show the decimals that are written.
_N_LAST = 100
#: Steps of the last decimal from which two equal times are not the same by rounding.
_FINE = 1.5
#: Sampling rate in Hz below which times without a unit are not taken for seconds.
_LOWEST_RATE = 10.0


@dataclass(frozen=True)
class TimeAxis:
    """Channel of times. They are those of all channels of its length.

    Attributes
    ----------
    name : str
        Its name.
    length : int or None
        Samples. None if all channels of the file are equally long.
    sampling_rate : float or None
        In Hz. None if all times are equal.
    start : float or None
        Seconds since 1970 at the first sample; None if the times are not dates.
    resolution : float
        Seconds of the smallest step.
    scale : float
        Seconds of the unit of the values.
    has_equal : bool
        Whether equal times are usual, because they were rounded.
    last_digit : float or None
        Seconds of the last written decimal, if a text has the same one everywhere.
    problem : str
        Why equal times do not come from rounding, else empty.
    """

    name: str
    length: int | None
    sampling_rate: float | None
    start: float | None = None
    resolution: float = 0.0
    scale: float = 1.0
    has_equal: bool = False
    last_digit: float | None = None
    problem: str = ""


class EvenTimes:
    """Check that the times of a file are even, block by block.

    A sample of unknown time follows the sample before. Equal times were rounded. No
    step from one time to the next may fall, or be late by more than the tolerance. The
    rate over ten to twenty seconds must agree with the sampling rate within 1 % and the
    rounding of the times, and no time may stay the same for more than ten seconds.

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
        written = axis.last_digit or last_decimal(times[-_N_LAST:])
        is_fine = 0 < written < 1 / self._rate / _FINE
        changed = changes(seconds)
        is_equal = np.diff(seconds) == 0
        # The last known time is there twice.
        is_equal[: len(self._samples) // 2] = False
        if is_fine and not axis.has_equal and is_equal.any():
            i = int(np.argmax(is_equal)) + 1
            raise ContentError(_equal_times(axis.name, int(samples[i]), seconds[i]))
        self._samples = samples[[changed[-1], -1]]
        self._seconds = seconds[[changed[-1], -1]]
        resolution = max(axis.resolution, written)
        self._check_steps(samples[changed], seconds[changed], resolution)
        self._check_rate(samples[changed], seconds[changed], samples[-1])

    def _check_steps(self, samples, seconds, resolution):
        """Refuse a step that falls or is late."""
        steps = np.diff(seconds)
        late = steps - np.maximum(np.diff(samples) / self._rate, resolution)
        tolerance = max(LATE / self._rate, LATE_STEPS * resolution)
        is_break = (late > tolerance) | (steps < 0)
        if is_break.any():
            i = np.argmax(is_break)
            raise ContentError(
                f"{self._axis.name!r} is not evenly spaced: {steps[i]:g} s before sample "
                f"{samples[i + 1]}, expected {1 / self._rate:g} s"
            )

    def _check_rate(self, samples, seconds, last):
        """Refuse times of another rate, and those that stand still up to the last sample."""
        part = (samples - samples[0]) // int(_MEASURED_FOR * self._rate + 1)
        origin = np.searchsorted(part, part - 1)
        n_samples = samples - samples[origin]
        passed = seconds - seconds[origin]
        expected = n_samples / self._rate
        largest = np.abs(np.diff(seconds)).max(initial=0)
        is_wrong = np.abs(passed - expected) > DRIFT * expected + 2 * largest
        is_wrong &= n_samples >= _SHORTEST
        n_equal = np.diff(samples, append=last)
        is_still = n_equal > _MEASURED_FOR * self._rate
        if not (is_wrong | is_still).any():
            return
        i = np.argmax(is_wrong | is_still)
        sample, n, time = samples[i], n_samples[i], passed[i]
        if is_still[i]:
            sample, n, time = samples[i] + n_equal[i], n_equal[i], 0.0
        raise ContentError(
            f"{self._axis.name!r} is not evenly spaced: {n} samples before sample "
            f"{sample} take {time:g} s, expected {n / self._rate:g} s at {self._rate:g} Hz"
        )


def even_rate(name: str, times: NDArray[Any]) -> float | None:
    """Return the sampling rate of times in seconds, and refuse those that are not even."""
    changed = changes(times)
    rate, _ = rate_of_times(times, np.arange(len(times)), changed)
    if not np.isfinite(rate):
        return None
    axis = TimeAxis(name, len(times), rate, has_equal=len(changed) < len(times))
    EvenTimes(axis, rate).check(times)
    return rate


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
    """
    if len(contents.channels) < 2:
        return None
    axes = (
        _axis(contents, name, stated_rate)
        for name, channel in contents.channels.items()
        if names_times(name) or _scale(name, channel.unit) is not None
    )
    return next((axis for axis in axes if axis is not None), None)


def _scale(name, unit):
    """Return the seconds of the stated unit, None if none is stated, NaN of another unit."""
    unit = unit or time_unit_in_name(name)
    if unit is None:
        return None
    scale = SECONDS.get(unit.strip().lower(), np.nan)
    return scale if np.isfinite(scale) or names_times(name) else None


def _axis(contents, name, stated_rate, n_probed=_N_PROBED):
    """Return the axis of a channel, judged by its first times; None if it has no times."""
    length = contents.channels[name].length
    scale = _scale(name, contents.channels[name].unit)
    is_stated = scale is not None
    (values,) = next(contents.read([name], n_probed), [np.zeros(0)])
    values = np.asarray(values[:n_probed])
    times, kind = in_seconds(values, scale if is_stated else 1.0)
    timed = np.flatnonzero(np.isfinite(times))
    if len(timed) < 2:
        return None
    if kind == "number" and not is_stated:
        scale = _guessed_scale(times[timed], stated_rate)
        times = times * scale
        is_count = np.median(np.diff(times[timed])) == 1
        if scale == 1 and (values.dtype.kind in "iu" or is_count):
            return None
    changed = changes(times)
    steps = np.diff(times[changed])
    is_constant = len(steps) == 0
    if not is_constant and max(np.mean(steps > 0), np.mean(steps < 0)) < _ONE_WAY:
        return None
    rate, tolerance = rate_of_times(times, timed, changed)
    if tolerance >= RATE_TOLERANCE and len(times) == n_probed < _N_COARSE:
        return _axis(contents, name, stated_rate, _N_COARSE)
    if is_constant:
        # A letter may stand for another quantity, such as a torque.
        return None if letters(name) == "t" else TimeAxis(name, length, None)
    is_seconds = kind == "number" and not is_stated and scale == 1
    if is_seconds and rate < _LOWEST_RATE and stated_rate is None:
        return None
    last_digit = contents.channels[name].last_digit
    if last_digit is not None and kind == "number":
        last_digit *= scale
    problem = _problem_of_equal(contents, name, times, last_digit)
    if tolerance > COARSE_TOLERANCE and not problem:
        return None
    return TimeAxis(
        name,
        length,
        rate,
        float(times[changed[0]] - changed[0] / rate) if kind == "date" else None,
        float(np.abs(steps).min()),
        scale if kind == "number" else 1.0,
        len(changed) < len(timed),
        last_digit,
        problem,
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
    known = times[np.isfinite(times)]
    starts = changes(known)
    sizes = np.diff(starts, append=len(known))
    if len(starts) == len(known) or len(sizes) < 3:
        return ""
    repeats = np.delete(np.arange(len(known)), starts)
    others = [
        other
        for other, channel in contents.channels.items()
        if other != name and channel.length == contents.channels[name].length
    ]
    columns = next(contents.read(others, len(times)), [])
    columns = dict(zip(others, map(np.asarray, columns), strict=True))
    sample = int(repeats[0])
    if len(known) == len(times) and _are_repeated([*columns.values()], repeats):
        return _equal_times(name, sample, known[sample])
    usual = np.median(np.abs(np.diff(known[starts])))
    ends = known[:_N_LAST], known[-_N_LAST:]
    written = [last_digit] if last_digit else [*map(last_decimal, ends)]
    is_fine = min(written) > 0 and max(written) < usual / _FINE
    is_slow_clock = sizes[1:-1].min() > 2 and np.ptp(sizes[1:-1]) > 0
    if not is_fine or is_slow_clock:
        return ""
    n_equal = int(sizes[0])
    for other, column in columns.items():
        tags = column[: len(column) // n_equal * n_equal].reshape(-1, n_equal)
        if len({*tags[0].tolist()}) == n_equal > 1 and np.all(tags == tags[0]):
            shown = ", ".join(map(str, tags[0].tolist()))
            return (
                f"{name!r} has several rows of one time, told apart by the column "
                f"{other!r} ({shown}): make one column of each"
            )
    return _equal_times(name, sample, known[sample])


def _are_repeated(columns, repeats):
    """Return whether rows of equal times are equal, unlike most others."""
    varying = [c for c in columns if np.mean(c[1:] == c[:-1]) < 0.5]
    is_equal = [np.all(c[repeats] == c[repeats - 1]) for c in varying]
    return bool(varying) and all(is_equal)


def _equal_times(name, sample, time):
    return (
        f"{name!r} is {time:.10g} s in samples {sample - 1} and {sample}, though times are "
        "written more finely than samples follow: remove rows that are repeated, and make "
        "one column of each sensor"
    )
