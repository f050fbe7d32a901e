"""Times of a stream of text, one in each line."""

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .formats._contents import ContentError, choose_channel
from .formats._facts import SECONDS, names_times, seconds_of_dates
from .formats.text import TextLayout, number

#: Name that stands for no column.
NO_TIMES = "none"
#: Larger numbers of seconds are not times, and their sums might overflow.
_LARGEST = 1e15
#: Seconds of samples after which a time is stated again, and on which the rate is measured.
_STATED_EVERY, _MEASURED_FOR = 1.0, 10.0
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
    shortest : int
        Samples before which the sampling rate of the times is not checked.
    """

    def __init__(self, column: str | None, sampling_rate: float, tolerance: float, shortest: int):
        self._column, self._rate, self._tolerance = column, sampling_rate, tolerance
        self._shortest = shortest
        # A clock drifts against the sampling rate, by less than the tolerance until it is stated.
        self._every = sampling_rate * min(_STATED_EVERY, tolerance / (2 * _RATE_TOLERANCE))

    def find(self, layout: TextLayout, rows: list[dict[str, str]], taken: list[str]) -> str | None:
        """Prepare for a source, and return the name of its column of times, None without one.

        Parameters
        ----------
        layout : TextLayout
            Columns of the source, and their units.
        rows : list of dict of str to str
            Fields of the first lines of samples, by column.
        taken : list of str
            Columns that hold the signal.

        Raises
        ------
        ContentError
            If the chosen column does not exist or has an unknown unit.
        """
        # Place and time of the last sample of known time, and of that from which the rate is
        # measured. Places count from the first sample of the source.
        self._last = self._origin = None
        self._stated = self._n_samples = self._n_wrong = 0
        self._largest_step = 0.0
        if self._column is None:
            name = next((n for n in layout.names if names_times(n) and n not in taken), None)
        else:
            name = None if self._column == NO_TIMES else choose_channel(layout.names, self._column)
        if name is None:
            return None
        unit, values = layout.units.get(name, "").lower(), [number(row[name]) for row in rows]
        # Dates have no unit, whatever the header states.
        is_date = len(values) > 0 and np.isnan(values).all()
        self._scale = SECONDS.get("s" if is_date else unit or "s")
        # As in files: whole numbers without a unit may count samples.
        is_counter = not unit and all(value.is_integer() for value in values)
        if self._column is None and (self._scale is None or is_counter):
            return None
        if self._scale is None:
            raise ContentError(f"column {name!r} is in {unit!r}, expected one of {[*SECONDS]}")
        return name

    def seconds(self, text: str) -> float:
        """Return a field of the column in seconds, NaN if it is not a time."""
        value = number(text) * self._scale
        value = float(seconds_of_dates([text])[0]) if math.isnan(value) else value
        return value if abs(value) < _LARGEST else math.nan

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
        cuts = {0: None}
        for i, time in enumerate(times.tolist()):
            is_first = self._last is None
            if math.isfinite(time) and self._must_be_stated(self._n_samples + i, time):
                # Unknown times before the first known one follow from it.
                cuts |= {0: time - i / self._rate} if is_first else {i: time}
        self._n_samples += len(times)
        for start, end in pairwise([*cuts, len(times)]):
            yield samples[:, start:end], cuts[start]

    def _must_be_stated(self, place, time):
        """Return whether a known time is the first, follows a leap, or is due after a pause."""
        before, last = self._last or (place, math.nan)
        # A time that is equal to the one before was rounded.
        if time == last:
            return False
        n_samples, seconds = place - before, time - last
        is_leap = not abs(seconds - n_samples / self._rate) <= self._tolerance
        if is_leap:
            self._n_wrong += self._last is not None
            if self._n_wrong >= _WRONG_STEPS:
                self._refuse(n_samples, seconds)
            self._origin, self._largest_step = (place, time), 0.0
        else:
            self._largest_step, self._n_wrong = max(self._largest_step, abs(seconds)), 0
            self._check_rate(place, time)
        self._last = place, time
        is_stated = is_leap or place - self._stated >= self._every
        self._stated = place if is_stated else self._stated
        return is_stated

    def _check_rate(self, place, time):
        n_samples, seconds = place - self._origin[0], time - self._origin[1]
        allowed = _RATE_TOLERANCE * n_samples / self._rate + 2 * self._largest_step
        if n_samples >= self._shortest and abs(seconds - n_samples / self._rate) > allowed:
            self._refuse(n_samples, seconds)
        if n_samples >= _MEASURED_FOR * self._rate:
            self._origin, self._largest_step = (place, time), 0.0

    def _refuse(self, n_samples, seconds):
        raise ContentError(
            f"{n_samples} samples take {seconds:g} s by their times, expected "
            f"{n_samples / self._rate:g} at {self._rate:g} Hz: another sampling rate, missing "
            "lines, or no unit as in 'time (ms)'; --time-column none ignores the times"
        )
