"""Times of a running source of text."""

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..readers.formats.clock import DRIFT, Clock
from ..readers.formats.contents import ContentError, choose_channel
from ..readers.formats.facts import SECONDS, names_times, number, seconds_of_date
from ..readers.formats.text import date_columns
from ..readers.formats.text_layout import TextLayout

#: Name that stands for no column.
NO_TIMES = "none"
#: Larger numbers of seconds are not times, and their sums might overflow.
_LARGEST = 1e15
#: Seconds of samples after which a time is stated again.
_STATED_EVERY = 1.0


class StreamTimes:
    """Parser of the column of times of a stream.

    Parameters
    ----------
    column : str or None
        Name, position or pattern of the column. None takes the first with a name such
        as ``time`` whose values are seconds or dates; `NO_TIMES` takes none.
    sampling_rate : float
        In Hz, that of the samples.
    tolerance : float
        Seconds by which the step from one time to the next may be wrong.
    shortest : int
        Samples before which the sampling rate of the times is not checked.
    """

    def __init__(
        self, column: str | None, sampling_rate: float, tolerance: float, shortest: int
    ):
        self._column = column
        self._rate = sampling_rate
        self._tolerance = tolerance
        self._shortest = shortest
        # A clock drifts against the sampling rate, by less than the tolerance until it
        # is stated.
        self._every = sampling_rate * min(_STATED_EVERY, tolerance / (2 * DRIFT))

    def find(
        self, layout: TextLayout, rows: list[dict[str, str]], taken: list[str]
    ) -> str | None:
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
        self._clock = Clock(self._rate, self._tolerance, self._shortest)
        # Last sample, counted from the first, whose time was stated.
        self._stated = None
        name = self._name(layout.names, taken)
        if name is None:
            return None
        parts = date_columns(layout.names, rows[0]) if rows else []
        self._parts = parts if name in parts else [name]
        unit = layout.units.get(name, "").lower()
        values = [number(self._text(r)) for r in rows]
        # Dates have no unit, whatever the header states.
        is_date = len(values) > 0 and np.isnan(values).all()
        self._scale = SECONDS.get("s" if is_date else unit or "s")
        # As in files: whole numbers without a unit may count samples.
        is_counter = not unit and all(value.is_integer() for value in values)
        if self._column is None and (self._scale is None or is_counter):
            return None
        if self._scale is None:
            raise ContentError(
                f"column {name!r} is in {unit!r}, expected one of {', '.join(SECONDS)}"
            )
        return name

    def _name(self, names, taken):
        if self._column == NO_TIMES:
            return None
        if self._column is not None:
            return choose_channel(names, self._column)
        free = (name for name in names if name not in taken)
        return next(filter(names_times, free), None)

    def seconds(self, row: dict[str, str]) -> float:
        """Return the time of a line by its fields in seconds, NaN if they hold none."""
        text = self._text(row)
        value = number(text) * self._scale
        if math.isnan(value):
            value = seconds_of_date(text)
        return value if abs(value) < _LARGEST else math.nan

    def _text(self, row):
        """Return the field of the column, or date and time of day of two columns."""
        return " ".join(row[name] for name in self._parts)

    def cut(
        self, samples: NDArray[Any], times: NDArray[Any]
    ) -> Iterator[tuple[Any, float | None]]:
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
            If the times are those of another sampling rate, or stand still.
        """
        n_before = self._clock.n_samples
        compared = self._clock.compare(times)
        if compared.wrong is not None:
            self._refuse(compared.wrong)
        cuts: dict[int, float | None] = {0: None}
        columns = (compared.samples, compared.seconds, compared.is_break)
        for i, time, is_break in zip(*map(np.ndarray.tolist, columns), strict=True):
            sample = n_before + i
            if self._stated is None:
                # Unknown times before the first known one follow from it.
                cuts[0] = time - i / self._rate
            elif is_break or sample - self._stated >= self._every:
                cuts[i] = time
            else:
                continue
            self._stated = sample
        for start, end in pairwise([*cuts, len(times)]):
            yield samples[:, start:end], cuts[start]

    def _refuse(self, wrong):
        n_samples = wrong.n_samples
        raise ContentError(
            f"{n_samples} samples take {wrong.seconds:g} s by their times, expected "
            f"{n_samples / self._rate:g} s at {self._rate:g} Hz: the sampling rate is "
            "another, lines are missing, or the name of the column lacks its unit as in "
            "'time (ms)'; --time-column none ignores the times"
        )
