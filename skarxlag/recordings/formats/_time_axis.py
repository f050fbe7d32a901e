"""The channel of times of a file, and the sampling rate that it states."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._clock import Clock, changes
from ._contents import Channel, ContentError, Contents
from ._facts import (
    RATE_TOLERANCE,
    SECONDS,
    letters,
    names_times,
    rounded,
    seconds_of_dates,
)
from ._fields import number, unit_in_name

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
    """Channel of times.

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

    def covers(self, name: str, channel: Channel) -> bool:
        """Return whether the times belong to another channel."""
        return name != self.name and channel.length == self.length


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

    def check(self, values: Any, start: int) -> None:
        """Refuse times that are not even, in themselves or after the block before.

        Parameters
        ----------
        values : ndarray of shape (n_samples,)
            Times of the next block.
        start : int
            Position of the first of them.
        """
        name = self._axis.name
        times, _ = _in_seconds(values, self._axis.unit)
        if times is None:
            raise ContentError(f"channel {name!r} is not numeric, expected times")
        rate = self._clock.rate
        compared = self._clock.compare(times)
        breaks = np.flatnonzero(compared.is_break)
        wrong = compared.wrong
        if breaks.size:
            place = start + compared.places[breaks[0]]
            if wrong is None or place <= wrong.place:
                raise ContentError(
                    f"{name!r} is not evenly spaced: {compared.steps[breaks[0]]:g} s "
                    f"before sample {place}, expected {1 / rate:g} s"
                )
        if wrong is not None:
            raise ContentError(
                f"{name!r} is not evenly spaced: {wrong.n_samples} samples before "
                f"sample {wrong.place} take {wrong.seconds:g} s, expected "
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


def _axis(contents, name):
    channel = contents.channels[name]
    unit = channel.unit or unit_in_name(name)
    for n_probed in (_N_PROBED, _N_COARSE):
        (values,) = next(contents.read([name], n_probed), [np.zeros(0)])
        values = np.asarray(values[:n_probed])
        times, is_date = _in_seconds(values, unit)
        if times is None or np.isfinite(times).sum() < 2:
            return None
        is_integer = values.dtype.kind in "iu"
        if not unit and not is_date and (is_integer or _usual_step(times) == 1):
            return None
        places = changes(times)
        first = places[0]
        steps = np.diff(times[places])
        if len(steps) == 0 and n_probed == _N_PROBED == len(times):
            continue
        if len(steps) == 0:
            # A letter may stand for another quantity, such as a torque.
            if letters(name) == "t":
                return None
            return TimeAxis(name, channel.length, None, None, 0.0, None)
        if max(np.mean(steps > 0), np.mean(steps < 0)) < _ONE_WAY:
            return None
        rate, tolerance = _rate_of_times(places, times)
        if tolerance < RATE_TOLERANCE or len(times) < n_probed:
            break
    if tolerance > _COARSE_TOLERANCE:
        return None
    start = float(times[first] - first / rate) if is_date else None
    resolution = float(np.abs(steps).min())
    return TimeAxis(name, channel.length, rate, start, resolution, unit)


def _usual_step(times):
    return np.median(np.diff(times[np.isfinite(times)]))


def _rate_of_times(places, times):
    """Return the sampling rate of times that change at places, and its relative tolerance."""
    timed = np.flatnonzero(np.isfinite(times))
    is_coarse = len(places) < len(timed)
    # Coarse times are equal for several samples. How long the first and last of them
    # were equal is unknown, so the rate is that between two changes, which are known to
    # about a sample.
    ends = places[[1, -1]] if is_coarse else timed[[0, -1]]
    n_steps = np.diff(ends)[0]
    seconds = np.diff(times[ends])[0]
    steps = np.diff(times[places])
    n_between = np.diff(places)
    usual = np.median(steps / n_between)
    resolution = np.abs(steps).min()
    late = steps - np.maximum(n_between * usual, resolution)
    if np.any(steps <= 0) or np.any(
        late > np.maximum(_LATE * usual, _LATE_STEPS * resolution)
    ):
        # A gap or a jump is no time that samples took.
        return rounded(1 / abs(usual), RATE_TOLERANCE / 2), RATE_TOLERANCE / 2
    if n_steps == 0:
        return np.nan, np.inf
    tolerance = (
        1.5 / n_steps
        if is_coarse
        else max(1e-5, 2 * np.spacing(times[ends[1]]) / seconds)
    )
    return rounded(n_steps / seconds, tolerance), tolerance


def _in_seconds(values: Any, unit: str | None) -> tuple[NDArray[Any] | None, bool]:
    """Return times in seconds, NaN if unknown, or None if none is known, and if dates."""
    values = np.asarray(values)
    if values.dtype.kind in "mM":
        is_known = ~np.isnat(values)
        seconds = values.astype(f"{values.dtype.kind}8[ns]").astype(np.int64) / 1e9
        return np.where(is_known, seconds, np.nan), values.dtype.kind == "M"
    if values.dtype.kind in "OU":
        seconds = seconds_of_dates(values)
        if not np.isnan(seconds).all():
            return seconds, True
        # Texts among numbers are unknown times.
        values = np.array([number(str(value)) for value in values.tolist()])
        if np.isnan(values).all():
            return None, False
    scale = SECONDS.get(unit.strip().lower()) if unit else 1.0
    if values.dtype.kind not in "fiu" or scale is None:
        return None, False
    return values.astype(np.float64) * scale, False
