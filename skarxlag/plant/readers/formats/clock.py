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
#: So many breaks in a row come from another sampling rate, not from gaps.
_BREAKS_IN_A_ROW = 10


class WrongRate(NamedTuple):
    """Times that contradict the sampling rate.

    Attributes
    ----------
    sample : int
        Sample at which this is noticed, counted from the first of the source.
    n_samples : int
        Samples before it.
    seconds : float
        Seconds that these samples take by their times.
    """

    sample: int
    n_samples: int
    seconds: float


class Compared(NamedTuple):
    """Times of a block that were compared with the sampling rate.

    Attributes
    ----------
    samples : ndarray of int of shape (n_changes,)
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

    samples: NDArray[Any]
    seconds: NDArray[Any]
    steps: NDArray[Any]
    is_break: NDArray[Any]
    wrong: WrongRate | None


def changes(times: NDArray[Any], before: float = np.nan) -> NDArray[Any]:
    """Return the samples whose time is known and differs from the last known one.

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
    samples = np.flatnonzero(np.isfinite(times))
    return samples[np.diff(times[samples], prepend=before) != 0]


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

    Attributes
    ----------
    n_samples : int
        Samples of the blocks that were compared.
    """

    rate: float
    tolerance: float
    shortest: int
    may_fall: bool = True
    resolution: float = 0.0

    def __post_init__(self) -> None:
        self.n_samples: int = 0
        # Sample and time of the last change, and of the one from which the rate is
        # measured, with the largest step since then.
        self._last = (0, np.nan)
        self._origin = (0, np.nan)
        self._largest_step = 0.0
        # Breaks in a row, and the last sample of known time.
        self._n_breaks = 0
        self._last_timed = 0

    def compare(self, times: NDArray[Any]) -> Compared:
        """Compare the times of the next block, in seconds and NaN if unknown."""
        last_sample, last_seconds = self._last
        in_block = changes(times, last_seconds)
        seconds = times[in_block]
        samples = in_block + self.n_samples
        n_steps = np.diff(samples, prepend=last_sample)
        steps = np.diff(seconds, prepend=last_seconds)
        late = steps - np.maximum(n_steps / self.rate, self.resolution)
        is_break = np.abs(late) > self.tolerance
        if not self.may_fall:
            is_break = (late > self.tolerance) | (steps < 0)
        wrong = [self._standing(times, in_block)]
        if len(samples) > 0:
            wrong.append(self._other_rate(samples, seconds, steps, is_break))
            wrong.append(self._all_breaks(samples, n_steps, steps, is_break))
            self._last = (int(samples[-1]), float(seconds[-1]))
        self.n_samples += len(times)
        first = min(filter(None, wrong), default=None)
        return Compared(in_block, seconds, steps, is_break, first)

    def _standing(self, times, in_block):
        """Return the end of a time that stays the same for too long."""
        timed = np.flatnonzero(np.isfinite(times))
        ends = np.append(self._last_timed, timed + self.n_samples)
        starts = np.append(self._last[0], in_block + self.n_samples)
        n_equal = np.append(ends[np.searchsorted(timed, in_block)], ends[-1]) - starts
        self._last_timed = int(ends[-1])
        is_wrong = n_equal > MEASURED_FOR * self.rate
        return _first_wrong(is_wrong, starts + n_equal, n_equal, np.zeros(len(starts)))

    def _all_breaks(self, samples, n_steps, steps, is_break):
        """Return the step with which so many in a row are breaks."""
        order = np.arange(1, len(is_break) + 1)
        last_right = np.maximum.accumulate(np.where(is_break, -self._n_breaks, order))
        n_breaks = order - last_right
        self._n_breaks = int(n_breaks[-1])
        return _first_wrong(n_breaks >= _BREAKS_IN_A_ROW, samples, n_steps, steps)

    def _other_rate(self, samples, seconds, steps, is_break):
        """Return the first change at which the rate since the origin is wrong."""
        longest = MEASURED_FOR * self.rate
        origins = is_break | np.isnan(steps)
        ends = np.append(np.flatnonzero(origins), len(samples))
        start = 0
        while start < len(samples):
            if origins[start]:
                self._measure_from(samples[start], seconds[start])
                start += 1
                continue
            stop = int(ends[np.searchsorted(ends, start)])
            n_samples = samples[start:stop] - self._origin[0]
            n_measured = int(np.searchsorted(n_samples, longest)) + 1
            n_samples = n_samples[:n_measured]
            part = slice(start, start + len(n_samples))
            passed = seconds[part] - self._origin[1]
            sizes = np.maximum(np.abs(steps[part]), self._largest_step)
            largest = np.maximum.accumulate(sizes)
            expected = n_samples / self.rate
            is_wrong = np.abs(passed - expected) > DRIFT * expected + 2 * largest
            is_wrong &= n_samples >= self.shortest
            wrong = _first_wrong(is_wrong, samples[part], n_samples, passed)
            if wrong is not None:
                return wrong
            self._largest_step = float(largest[-1])
            start = part.stop
            if n_samples[-1] >= longest:
                self._measure_from(samples[start - 1], seconds[start - 1])
        return None

    def _measure_from(self, sample, seconds):
        self._origin = (int(sample), float(seconds))
        self._largest_step = 0.0


def _first_wrong(is_wrong, samples, n_samples, seconds):
    """Return the first of the wrong times, None if none is wrong."""
    if not is_wrong.any():
        return None
    i = np.argmax(is_wrong)
    return WrongRate(int(samples[i]), int(n_samples[i]), float(seconds[i]))
