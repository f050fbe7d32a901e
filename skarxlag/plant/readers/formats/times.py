"""The channel of times of a file, and the sampling rate that it states."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .clock import Clock, changes
from .contents import ContentError, Contents
from .facts import (
    RATE_TOLERANCE,
    SECONDS,
    letters,
    names_times,
    number,
    rounded,
    seconds_of_date,
    unit_in_name,
)

#: Times from which the sampling rate is computed, and more if they are too coarse.
_N_PROBED = 10_000
_N_COARSE = 1_000_000
#: Coarse times give a sampling rate if it is known to this share.
_COARSE_TOLERANCE = 5e-3
#: Share of the steps of times that have the same sign. The others are jumps of the
#: clock.
_ONE_WAY = 0.9
#: Samples and steps of times by which one may be late, and samples before the rate is
#: checked.
_LATE = 0.6
_LATE_STEPS = 0.5
_SHORTEST = 100


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
    unit : str or None
        Unit of the values.
    """

    name: str
    length: int | None
    sampling_rate: float | None
    start: float | None
    resolution: float
    unit: str | None


class EvenTimes:
    """Check that the times of a file are even, block by block.

    Parameters
    ----------
    axis : TimeAxis
        The channel of times.
    rate : float
        Sampling rate in Hz.
    """

    def __init__(self, axis: TimeAxis, rate: float) -> None:
        self._axis = axis
        self._clock = Clock(
            rate,
            tolerance=max(_LATE / rate, _LATE_STEPS * axis.resolution),
            shortest=_SHORTEST,
            may_fall=False,
            resolution=axis.resolution,
        )

    def check(self, values: Any) -> None:
        """Refuse times that are not even, in themselves or after the block before.

        Parameters
        ----------
        values : ndarray of shape (n_samples,)
            Times of the next block.
        """
        start = self._clock.n_samples
        times, _ = _in_seconds(values, self._axis.unit)
        compared = self._clock.compare(times)
        name = self._axis.name
        rate = self._clock.rate
        wrong = compared.wrong
        if compared.is_break.any():
            first = np.argmax(compared.is_break)
            sample = start + compared.samples[first]
            if wrong is None or sample <= wrong.sample:
                raise ContentError(
                    f"{name!r} is not evenly spaced: {compared.steps[first]:g} s "
                    f"before sample {sample}, expected {1 / rate:g} s"
                )
        if wrong is not None:
            raise ContentError(
                f"{name!r} is not evenly spaced: {wrong.n_samples} samples before "
                f"sample {wrong.sample} take {wrong.seconds:g} s, expected "
                f"{wrong.n_samples / rate:g} s at {rate:g} Hz"
            )


def find_time_axis(contents: Contents) -> TimeAxis | None:
    """Find the channel of times, None if there is none.

    Its name is one such as ``time``, ``t`` or ``seconds``. Its values are numbers,
    dates, or texts of dates, most of which rise, or most of which fall. Some may be
    unknown. Integers without a unit are not times: they may count samples.
    """
    if len(contents.channels) < 2:
        return None
    axes = (_axis(contents, name) for name in contents.channels if names_times(name))
    return next((axis for axis in axes if axis is not None), None)


def _axis(contents, name, n_probed=_N_PROBED):
    """Return the axis of a channel, judged by its first times; None if it has no times."""
    channel = contents.channels[name]
    unit = channel.unit or unit_in_name(name)
    (values,) = next(contents.read([name], n_probed), [np.zeros(0)])
    values = np.asarray(values[:n_probed])
    times, is_date = _in_seconds(values, unit)
    timed = np.flatnonzero(np.isfinite(times))
    if len(timed) < 2:
        return None
    if not unit and not is_date:
        is_integer = values.dtype.kind in "iu"
        if is_integer or np.median(np.diff(times[timed])) == 1:
            return None
    changed = changes(times)
    steps = np.diff(times[changed])
    is_constant = len(steps) == 0
    if not is_constant and max(np.mean(steps > 0), np.mean(steps < 0)) < _ONE_WAY:
        return None
    rate, tolerance = _rate_of_times(times, timed, changed)
    if tolerance >= RATE_TOLERANCE and len(times) == n_probed < _N_COARSE:
        return _axis(contents, name, _N_COARSE)
    if is_constant:
        # A letter may stand for another quantity, such as a torque.
        if letters(name) == "t":
            return None
        return TimeAxis(name, channel.length, None, None, 0.0, None)
    if tolerance > _COARSE_TOLERANCE:
        return None
    start = float(times[changed[0]] - changed[0] / rate) if is_date else None
    resolution = float(np.abs(steps).min())
    return TimeAxis(name, channel.length, rate, start, resolution, unit)


def _rate_of_times(times, timed, changed):
    """Return the sampling rate of times, and its relative tolerance.

    `timed` are the samples of known times, and `changed` those of them whose time
    differs from the one before.
    """
    steps = np.diff(times[changed])
    if len(steps) == 0:
        return np.nan, np.inf
    n_between = np.diff(changed)
    usual = np.median(steps / n_between)
    resolution = np.abs(steps).min()
    late = steps - np.maximum(n_between * usual, resolution)
    is_late = late > np.maximum(_LATE * usual, _LATE_STEPS * resolution)
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


def _in_seconds(values: Any, unit: str | None) -> tuple[NDArray[Any], bool]:
    """Return times in seconds, NaN if unknown, and whether they are dates."""
    values = np.asarray(values)
    kind = values.dtype.kind
    if kind in "mM":
        seconds = values.astype(f"{kind}8[ns]").astype(np.int64) / 1e9
        return np.where(np.isnat(values), np.nan, seconds), kind == "M"
    if kind in "OU":
        seconds = np.array([seconds_of_date(value) for value in values])
        if not np.isnan(seconds).all():
            return seconds, True
        # Texts among numbers are unknown times.
        values = np.array([number(str(value)) for value in values.tolist()])
    elif kind not in "fiu":
        return np.full(len(values), np.nan), False
    scale = SECONDS.get(unit.strip().lower(), np.nan) if unit else 1.0
    return values.astype(np.float64) * scale, False
