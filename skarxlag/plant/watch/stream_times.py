"""Times that the lines of a pipe state."""

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
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
    rate : float
        Sampling rate in Hz.
    tolerance : float
        Seconds by which the step from one time to the next may be wrong.
    shortest : int
        Samples before which the sampling rate of the times is not checked.
    """

    def __init__(
        self, column: str | None, rate: float, tolerance: float, shortest: int
    ) -> None:
        self._column = column
        self._rate = rate
        self._clock = Clock(rate, tolerance, shortest)
        # A clock drifts against the sampling rate, by less than the tolerance until it
        # is stated.
        self._every = rate * min(_STATED_EVERY, tolerance / (2 * DRIFT))
        # Last sample, counted from the first, whose time was stated.
        self._stated: int | None = None
        self._parts: list[str] = []

    def find(
        self, layout: TextLayout, rows: list[dict[str, str]], taken: list[str]
    ) -> str | None:
        """Return the name of the column of times, None without one.

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
        name = None
        if self._column is None:
            free = (name for name in layout.names if name not in taken)
            name = next(filter(names_times, free), None)
        elif self._column != NO_TIMES:
            name = choose_channel(layout.names, self._column)
        if name is None:
            return None
        dates = date_columns(layout.names, rows[0])
        parts = dates if name in dates else [name]
        unit = layout.units.get(name, "").lower()
        values = [number(" ".join(row[part] for part in parts)) for row in rows]
        # Dates have no unit, whatever the header states.
        scale = SECONDS.get("s" if np.isnan(values).all() else unit or "s")
        # As in files: whole numbers without a unit may count samples.
        is_counter = not unit and all(value.is_integer() for value in values)
        if self._column is None and (scale is None or is_counter):
            return None
        if scale is None:
            raise ContentError(
                f"column {name!r} is in {unit!r}, expected one of {', '.join(SECONDS)}"
            )
        self._parts = parts
        self._scale = scale
        return name

    def _seconds(self, frame):
        """Return the times of samples in seconds; NaN if they cannot be read."""
        columns = [frame[part] for part in self._parts]
        if len(columns) == 1 and columns[0].dtype == np.float64:
            seconds = columns[0].to_numpy() * self._scale
        else:
            texts = (" ".join(map(str, parts)) for parts in zip(*columns, strict=True))
            seconds = np.array([self._second(text) for text in texts])
        return np.where(np.abs(seconds) < _LARGEST, seconds, np.nan)

    def _second(self, text):
        value = number(text) * self._scale
        return seconds_of_date(text) if math.isnan(value) else value

    def cut(
        self, samples: NDArray[Any], frame: pd.DataFrame
    ) -> Iterator[tuple[NDArray[Any], float | None]]:
        """Yield parts of a block that begin at a known time.

        The parts do not depend on how the stream is divided into blocks.

        Parameters
        ----------
        samples : ndarray of shape (n_channels, n_samples)
            The block.
        frame : DataFrame
            Its lines.

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
        if not self._parts:
            yield samples, None
            return
        n_before = self._clock.n_samples
        compared = self._clock.compare(self._seconds(frame))
        if compared.wrong is not None:
            n_samples = compared.wrong.n_samples
            raise ContentError(
                f"{n_samples} samples take {compared.wrong.seconds:g} s by their times, "
                f"expected {n_samples / self._rate:g} s at {self._rate:g} Hz: the sampling "
                "rate is another, lines are missing, or the name of the column lacks its "
                "unit as in 'time (ms)'; --time-column none ignores the times"
            )
        cuts: dict[int, float | None] = {0: None}
        columns = (compared.samples, compared.seconds, compared.is_break)
        for i, time, is_break in zip(*map(np.ndarray.tolist, columns), strict=True):
            if self._stated is None:
                # Unknown times before the first known one follow from it.
                cuts[0] = time - i / self._rate
            elif is_break or n_before + i - self._stated >= self._every:
                cuts[i] = time
            else:
                continue
            self._stated = n_before + i
        for start, end in pairwise([*cuts, samples.shape[1]]):
            yield samples[:, start:end], cuts[start]
