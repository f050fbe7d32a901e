"""Times of a stream of text, one in each line."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .formats._contents import ContentError, choose_channel
from .formats._facts import SECONDS, names_times, seconds_of_dates

#: Name that stands for no column.
NO_TIMES = "none"
#: Larger numbers of seconds are not times, and their sums might overflow.
_LARGEST = 1e15
#: Seconds of samples after which a time is stated again: a clock drifts against the sampling rate.
_STATED_EVERY = 1.0
#: Seconds of samples on which the sampling rate of the times is measured.
_MEASURED_FOR = 10.0
#: Share by which the rate of the times may differ from the stated one, apart from rounding.
_RATE_TOLERANCE = 0.01
#: So many wrong steps in a row come from another sampling rate, not from a gap.
_WRONG_STEPS = 10


class StreamTimes:
    """Parser of the column of times of a stream.

    Parameters
    ----------
    column : str or None
        Name, position or pattern of the column. None takes the first with a name such as ``time``
        whose values are seconds or dates; `NO_TIMES` takes none.
    sampling_rate : float
        In Hz, that of the samples.
    tolerance : float
        Seconds by which the step from one time to the next may be wrong.
    window_length : int
        Samples before which the sampling rate of the times is not checked.

    Attributes
    ----------
    n_bad : int
        Times that could not be read.
    """

    n_bad: int

    def __init__(
        self, column: str | None, sampling_rate: float, tolerance: float, window_length: int
    ) -> None:
        self.n_bad = 0
        self._column, self._rate, self._tolerance = column, sampling_rate, tolerance
        self._shortest = window_length
        self.begin()

    def begin(self) -> None:
        """Prepare for the first samples of a source."""
        # Place and time of the sample whose time was stated last, of the one from which the rate is
        # measured, and of the last known one; places count from the first sample of the next block.
        self._anchor = self._origin = self._last = None
        self._largest_step, self._n_wrong = 0.0, 0

    def find(
        self, names: list[str], units: dict[str, str], rows: list[list[str]], taken: list[int]
    ) -> int | None:
        """Return the position of the column of times, None if there is none.

        Parameters
        ----------
        names : list of str
            Columns of the stream.
        units : dict of str to str
            By column, if stated.
        rows : list of list of str
            Fields of the first lines of samples.
        taken : list of int
            Columns that hold the signal.

        Raises
        ------
        ContentError
            If the chosen column does not exist or has an unknown unit.
        """
        if self._column == NO_TIMES:
            return None
        if self._column is not None:
            name = choose_channel(names, self._column)
        else:
            found = [n for i, n in enumerate(names) if names_times(n) and i not in taken]
            if not found:
                return None
            name = found[0]
        position = names.index(name)
        texts = [row[position] for row in rows if len(row) == len(names)]
        unit = units.get(name, "").strip().lower()
        numbers = [_number(text) for text in texts]
        if np.isfinite(seconds_of_dates(texts))[[n is None for n in numbers]].any():
            unit = "s"
        self._scale = SECONDS.get(unit or "s")
        if self._column is None:
            # As in files: whole numbers without a unit may count samples.
            is_counter = not unit and all(n is not None and n.is_integer() for n in numbers)
            return None if self._scale is None or is_counter else position
        if self._scale is None:
            raise ContentError(f"column {name!r} is in {unit!r}, expected one of {[*SECONDS]}")
        return position

    def seconds(self, text: str) -> float:
        """Return a field of the column in seconds, NaN if it is not a time."""
        value = _number(text)
        value = seconds_of_dates([text])[0] if value is None else value * self._scale
        if not abs(value) < _LARGEST:
            self.n_bad += 1
            return math.nan
        return float(value)

    def cut(self, samples: NDArray[Any], times: NDArray[Any]) -> Iterator[tuple[Any, float | None]]:
        """Yield parts of a block that begin at a known time, as `TextSamples.parts` does.

        The parts do not depend on how the stream is divided into blocks.

        Parameters
        ----------
        samples : ndarray of shape (n_channels, n_samples)
            The block.
        times : ndarray of shape (n_samples,)
            In seconds, NaN if unknown.

        Yields
        ------
        samples : ndarray of shape (n_channels, n_samples)
            The part.
        time : float or None
            Of its first sample; None if it follows the sample before.

        Raises
        ------
        ContentError
            If the times are those of another sampling rate.
        """
        n_samples, first = samples.shape[1], 0
        cuts, stated = [0], [None]
        # A time that is equal to the one before was rounded.
        known = np.flatnonzero(np.isfinite(times))
        before = np.nan if self._last is None else self._last[1]
        known = known[np.diff(times[known], prepend=before) != 0]
        for place, time in zip(known.tolist(), times[known].tolist(), strict=True):
            now = (place, time)
            if self._anchor is None:
                # Unknown times before the first known one follow from it.
                first, time_of_first = 0, time - place / self._rate
                self._anchor = self._origin = now
            elif self._is_leap(place, time):
                first, time_of_first = now
                self._anchor, self._origin, self._largest_step = now, now, 0.0
            else:
                self._check_rate(place, time)
                if place - self._origin[0] >= _MEASURED_FOR * self._rate:
                    self._origin, self._largest_step = now, 0.0
                if self._has_drifted(place, time):
                    first, time_of_first = self._anchor = now
            self._last = now
            if self._anchor != now:
                continue
            if first == cuts[-1]:
                stated[-1] = time_of_first
            else:
                cuts.append(first)
                stated.append(time_of_first)
        if self._anchor is not None:
            self._anchor, self._origin, self._last = (
                (place - n_samples, time)
                for place, time in (self._anchor, self._origin, self._last)
            )
        for start, end, time in zip(cuts, [*cuts[1:], n_samples], stated, strict=True):
            yield samples[:, start:end], time

    def _is_leap(self, place, time):
        last_place, last_time = self._last
        step, expected = time - last_time, (place - last_place) / self._rate
        if abs(step - expected) <= self._tolerance:
            self._largest_step, self._n_wrong = max(self._largest_step, abs(step)), 0
            return False
        self._n_wrong += 1
        if self._n_wrong >= _WRONG_STEPS:
            raise ContentError(
                f"{self._n_wrong} times in a row step by {step:g} s where {expected:g} s are "
                "expected; is their unit missing, as in 'time (ms)'? --time-column none ignores "
                "them"
            )
        return True

    def _has_drifted(self, place, time):
        n_samples, seconds = place - self._anchor[0], time - self._anchor[1]
        late = seconds - n_samples / self._rate
        return n_samples >= _STATED_EVERY * self._rate or abs(late) > self._tolerance / 2

    def _check_rate(self, place, time):
        n_samples, seconds = place - self._origin[0], time - self._origin[1]
        expected = n_samples / self._rate
        allowed = _RATE_TOLERANCE * expected + 2 * self._largest_step
        if n_samples >= self._shortest and abs(seconds - expected) > allowed:
            raise ContentError(
                f"{n_samples} samples take {seconds:g} s by their times, expected {expected:g} at "
                f"{self._rate:g} Hz: another sampling rate, or lines are missing; --time-column "
                "none ignores the times"
            )


def _number(text):
    try:
        return float(text.replace(",", "."))
    except ValueError:
        return None
