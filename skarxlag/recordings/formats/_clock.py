"""Times of samples, compared with their sampling rate: one rule for files and streams."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

#: Share by which the rate of the times may differ from the sampling rate, apart from
#: rounding.
DRIFT = 0.01
#: Seconds over which the rate is measured. Equal times over more samples are a clock
#: that stands.
MEASURED_FOR = 10.0
#: So many wrong steps in a row come from another sampling rate, not from gaps.
_WRONG_STEPS = 10


class WrongRate(NamedTuple):
    """Times that contradict the sampling rate.

    Attributes
    ----------
    place : int
        Sample at which this is noticed, counted from the first of the source.
    n_samples : int
        Samples before it.
    seconds : float
        Seconds that these samples take by their times.
    """

    place: int
    n_samples: int
    seconds: float


class Compared(NamedTuple):
    """Times of a block that were compared with the sampling rate.

    Attributes
    ----------
    places : ndarray of int of shape (n_changes,)
        Samples of the block whose time is known and differs from the one before.
    seconds : ndarray of shape (n_changes,)
        Their times.
    steps : ndarray of shape (n_changes,)
        Seconds since the change before; NaN for the first of the source.
    is_break : ndarray of bool of shape (n_changes,)
        Whether the step is wrong: there is a gap, or the clock was set back.
    wrong : WrongRate or None
        First times of another sampling rate.
    """

    places: NDArray[Any]
    seconds: NDArray[Any]
    steps: NDArray[Any]
    is_break: NDArray[Any]
    wrong: WrongRate | None


def changes(times: NDArray[Any], before: float = np.nan) -> NDArray[Any]:
    """Return the places of times that are known and differ from the last known one.

    Parameters
    ----------
    times : ndarray of shape (n_samples,)
        In seconds, NaN if unknown.
    before : float
        The last known time before them.

    Examples
    --------
    >>> changes(np.array([0.5, 0.5, np.nan, 0.5, 0.6, np.nan]))
    array([0, 4])
    """
    places = np.flatnonzero(np.isfinite(times))
    return places[np.diff(times[places], prepend=before) != 0]


@dataclass
class Clock:
    """Clock of a source, from block to block.

    A sample of unknown time follows the sample before. Equal times were rounded. The
    step from one time to the next is a break if it is wrong by more than the tolerance.
    Between breaks, the rate of the times must agree with the sampling rate within 1 %
    and the rounding of the times, and a time must not stay the same for more than ten
    seconds. The result does not depend on how the source is divided into blocks.

    Parameters
    ----------
    rate : float
        Sampling rate in Hz.
    tolerance : float
        Seconds by which a step may be wrong.
    shortest : int
        Samples before which the rate of the times is not measured.
    may_fall : bool, default=True
        Whether a step back within the tolerance is no break.
    resolution : float, default=0.0
        Seconds to which times are rounded: a step of this size is right after any
        number of samples.
    """

    rate: float
    tolerance: float
    shortest: int
    may_fall: bool = True
    resolution: float = 0.0

    def __post_init__(self) -> None:
        # Place and time of the last change, and of that from which the rate is
        # measured.
        self._last: tuple[int, float] | None = None
        self._origin: tuple[int, float] | None = None
        self._n_samples = self._n_wrong = self._last_known = 0
        self._largest_step = 0.0

    def compare(self, times: NDArray[Any]) -> Compared:
        """Compare the times of the next block, in seconds and NaN if unknown."""
        last = self._last or (0, np.nan)
        places = changes(times, last[1])
        seconds = times[places]
        where = places + self._n_samples
        n_steps = np.diff(where, prepend=last[0])
        steps = np.diff(seconds, prepend=last[1])
        late = steps - np.maximum(n_steps / self.rate, self.resolution)
        is_break = np.abs(late) > self.tolerance
        if not self.may_fall:
            is_break = (late > self.tolerance) | (steps < 0)
        wrong = [self._other_rate(where, seconds, steps, is_break)]
        if is_break.any():
            wrong.append(self._all_wrong(where, n_steps, steps, is_break))
        elif len(places) > 0:
            self._n_wrong = 0
        if len(places) < len(times):
            wrong.append(self._standing(np.flatnonzero(np.isfinite(times)), places))
        elif len(times) > 0:
            self._last_known = self._n_samples + len(times) - 1
        if len(places) > 0:
            self._last = int(where[-1]), float(seconds[-1])
        self._n_samples += len(times)
        first = min(filter(None, wrong), default=None)
        return Compared(places, seconds, steps, is_break, first)

    def _standing(self, timed, places):
        """Return the end of a time that stays the same for too long."""
        offset = self._n_samples
        ends = np.append(self._last_known, timed + offset)
        starts = np.append(
            offset if self._last is None else self._last[0], places + offset
        )
        n_equal = np.append(ends[np.searchsorted(timed, places)], ends[-1]) - starts
        self._last_known = int(ends[-1])
        bad = np.flatnonzero(n_equal > MEASURED_FOR * self.rate)
        if bad.size == 0:
            return None
        n_samples = int(n_equal[bad[0]])
        return WrongRate(int(starts[bad[0]]) + n_samples, n_samples, 0.0)

    def _all_wrong(self, where, n_steps, steps, is_break):
        """Return the step with which so many in a row are wrong."""
        place = np.arange(1, len(is_break) + 1)
        last_right = np.maximum.accumulate(np.where(is_break, -self._n_wrong, place))
        n_wrong = place - last_right
        self._n_wrong = int(n_wrong[-1])
        bad = np.flatnonzero(n_wrong >= _WRONG_STEPS)
        if bad.size == 0:
            return None
        return WrongRate(int(where[bad[0]]), int(n_steps[bad[0]]), float(steps[bad[0]]))

    def _other_rate(self, where, seconds, steps, is_break):
        """Return the first change at which the rate since the origin is wrong."""
        start = 0
        long = MEASURED_FOR * self.rate
        ends = np.append(np.flatnonzero(is_break), len(where))
        while start < len(where):
            if self._origin is None or is_break[start]:
                self._measure_from(where, seconds, start)
                start += 1
                continue
            stop = int(ends[np.searchsorted(ends, start, side="right")])
            n_samples = where[start:stop] - self._origin[0]
            stop = min(stop, start + int(np.searchsorted(n_samples, long)) + 1)
            n_samples = n_samples[: stop - start]
            passed = seconds[start:stop] - self._origin[1]
            sizes = np.maximum(np.abs(steps[start:stop]), self._largest_step)
            largest = np.maximum.accumulate(sizes)
            expected = n_samples / self.rate
            is_wrong = np.abs(passed - expected) > DRIFT * expected + 2 * largest
            bad = np.flatnonzero(is_wrong & (n_samples >= self.shortest))
            if bad.size > 0:
                place = int(where[start + bad[0]])
                return WrongRate(place, int(n_samples[bad[0]]), float(passed[bad[0]]))
            self._largest_step = float(largest[-1])
            if n_samples[-1] >= long:
                self._measure_from(where, seconds, stop - 1)
            start = stop
        return None

    def _measure_from(self, where, seconds, i):
        self._origin = (int(where[i]), float(seconds[i]))
        self._largest_step = 0.0
