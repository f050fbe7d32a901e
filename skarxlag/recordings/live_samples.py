"""From the bytes of a running source to samples, and their times if it is text."""

import csv
import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .formats._clock import DRIFT, Clock
from .formats._contents import ContentError, choose_channel, choose_channels
from .formats._facts import SECONDS, names_speed, names_times, seconds_of_dates
from .formats.raw import frame_type
from .formats.text import TextLayout, date_columns, is_number, number, text_layout

#: Lines from which the layout of a text is inferred: names, units, and two of samples.
_HEAD_LINES = 4
#: Descriptions of what could not be read.
_BAD_LINES, _BAD_TIMES = "lines that are no numbers", "times that could not be read"
#: Longest line, in bytes.
_LONGEST_LINE = 2**20
#: Some loggers end each line with a separator.
_AT_LINE_END = re.compile(rb"[;,][ \t\r]*(\n|$)")
#: Name that stands for no column.
NO_TIMES = "none"
#: Larger numbers of seconds are not times, and their sums might overflow.
_LARGEST = 1e15
#: Seconds of samples after which a time is stated again.
_STATED_EVERY = 1.0

#: Names, positions or patterns of channels.
Channels = str | Sequence[str] | None


def chosen_channels(
    names: list[str],
    channel: Channels,
    speed: str | None = None,
    usual: Sequence[list[str]] = (),
) -> list[str]:
    """Return the names of the chosen channels.

    Parameters
    ----------
    names : list of str
        All channels.
    channel : str, list of str, or None
        As in `read_recording`; None takes all but those of times and of shaft speeds.
    speed : str or None
        Channel of the shaft speed or of pulses, which comes last.
    usual : sequence of list of str
        Choices, of which the first that is possible is taken if `channel` is None and
        there are more channels.

    Examples
    --------
    >>> chosen_channels(["time", "DE_time", "FE_time"], ["FE*", "1"])
    ['FE_time', 'DE_time']
    >>> chosen_channels(["time", "acc", "rpm"], None)
    ['acc']
    >>> chosen_channels(["key", "acc"], None, "k*")
    ['acc', 'key']
    """
    if channel is None:
        signals = [
            name for name in names if not names_times(name) and not names_speed(name)
        ]
        chosen = signals or names
        for own in usual:
            if len(own) < len([name for name in chosen if name != speed]):
                with suppress(ContentError):
                    chosen = choose_channels(names, own)
                    break
    else:
        chosen = choose_channels(names, channel)
    if speed is None:
        return chosen
    speed = choose_channel(names, speed)
    return [name for name in chosen if name != speed] + [speed]


class _Samples:
    """Parser of the bytes of a source, of which the last may wait for their rest."""

    def __init__(self) -> None:
        self.unread: Counter[str] = Counter()
        self.begin()

    def begin(self, head: bytes = b"") -> None:
        """Prepare for the first bytes of a source.

        Parameters
        ----------
        head : bytes
            The beginning of the source, if parsing starts after it.
        """
        self._rest = b""

    @property
    def advice(self) -> str:
        """Advice for the user if the number of channels is wrong."""
        return "--channel chooses"

    @property
    def n_pending(self) -> int:
        """Bytes of a sample or line that has not arrived in whole."""
        return len(self._rest)


class RawSamples(_Samples):
    """Parser of interleaved binary samples.

    Parameters
    ----------
    dtype : str
        Type of one sample of all channels, such as ``<i2``, or ``(4,)<f4`` for four
        channels.
    channel : str, list of str, or None
        Chosen channels, in their order; None for all.
    speed : str or None
        Channel of the shaft speed or of pulses, which becomes the last row of the
        samples.
    usual : sequence of list of str
        As in `chosen_channels`.

    Attributes
    ----------
    unread : Counter of str
        Bytes at the end that do not make a whole sample.
    """

    def __init__(
        self,
        dtype: str,
        channel: Channels = None,
        speed: str | None = None,
        usual: Sequence[list[str]] = (),
    ) -> None:
        self._frame = frame_type(dtype)
        self._names = chosen_channels(list(self._frame.names), channel, speed, usual)
        super().__init__()

    @property
    def channels(self) -> list[tuple[str, str | None]]:
        """Names of the channels, and None for their units."""
        return [(name, None) for name in self._names]

    def parts(
        self, data: bytes, *, is_end: bool = False
    ) -> Iterator[tuple[Any, float | None]]:
        """Yield samples of shape (n_channels, n_samples), and None for their time."""
        data = self._rest + data
        n_whole = len(data) // self._frame.itemsize * self._frame.itemsize
        self._rest = data[n_whole:]
        self.unread["bytes of a sample that is not whole"] = (
            len(self._rest) if is_end else 0
        )
        frames = np.frombuffer(data[:n_whole], self._frame)
        with np.errstate(invalid="ignore"):
            yield (
                np.stack([frames[name].astype(np.float64) for name in self._names]),
                None,
            )


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
        self._column, self._rate, self._tolerance = column, sampling_rate, tolerance
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
        # Samples so far, and the last place, counted from the first, at which a time
        # was stated.
        self._n_samples, self._stated = 0, None
        if self._column is None:
            name = next(
                (n for n in layout.names if names_times(n) and n not in taken), None
            )
        else:
            name = (
                None
                if self._column == NO_TIMES
                else choose_channel(layout.names, self._column)
            )
        if name is None:
            return None
        parts = date_columns(layout.names, rows[0]) if rows else []
        self._parts = parts if name in parts else [name]
        unit, values = (
            layout.units.get(name, "").lower(),
            [number(self._text(r)) for r in rows],
        )
        # Dates have no unit, whatever the header states.
        is_date = len(values) > 0 and np.isnan(values).all()
        self._scale = SECONDS.get("s" if is_date else unit or "s")
        # As in files: whole numbers without a unit may count samples.
        is_counter = not unit and all(value.is_integer() for value in values)
        if self._column is None and (self._scale is None or is_counter):
            return None
        if self._scale is None:
            raise ContentError(
                f"column {name!r} is in {unit!r}, expected one of {[*SECONDS]}"
            )
        return name

    def seconds(self, row: dict[str, str]) -> float:
        """Return the time of a line by its fields in seconds, NaN if they hold none."""
        value = number(text := self._text(row)) * self._scale
        value = float(seconds_of_dates([text])[0]) if math.isnan(value) else value
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
        found, cuts = self._clock.compare(times), {0: None}
        if found.wrong is not None:
            self._refuse(found.wrong)
        columns = (found.places, found.seconds, found.is_break)
        for i, time, is_break in zip(*map(np.ndarray.tolist, columns), strict=True):
            place, is_first = self._n_samples + i, self._stated is None
            if is_first or is_break or place - self._stated >= self._every:
                # Unknown times before the first known one follow from it.
                cuts |= {0: time - i / self._rate} if is_first else {i: time}
                self._stated = place
        self._n_samples += len(times)
        for start, end in pairwise([*cuts, len(times)]):
            yield samples[:, start:end], cuts[start]

    def _refuse(self, wrong):
        _, n_samples, seconds = wrong
        expected = f"{n_samples / self._rate:g} at {self._rate:g} Hz"
        found = f"{n_samples} samples take {seconds:g} s by their times, expected {expected}"
        advice = "a unit is missing as in 'time (ms)', or use --time-column none"
        raise ContentError(
            f"{found}: another sampling rate, lines are missing, {advice}"
        )


class TextSamples(_Samples):
    """Parser of lines of numbers, one line for each moment.

    Separator, names and units are inferred from the first lines, as in
    `read_recording`. If the comma does not separate, it may be the decimal sign. A
    later line that cannot be read becomes a missing sample, so that time goes on. Names
    and units that come again are left out; names in another order move the columns. A
    cut first line is left out, too.

    Parameters
    ----------
    channel : None, str, or list of str
        Chosen columns, in their order; None for all but those of times and shaft
        speeds.
    times : StreamTimes
        Parser of the column of times.
    speed : str or None
        Column of shaft speeds or of pulses, which becomes the last row of the samples.
    usual : sequence of list of str
        As in `chosen_channels`.

    Attributes
    ----------
    unread : Counter of str
        Lines and times that could not be read.
    """

    def __init__(
        self,
        channel: Channels,
        times: StreamTimes,
        speed: str | None = None,
        usual: Sequence[list[str]] = (),
    ) -> None:
        self._channel, self._times, self._speed = channel, times, speed
        self._usual = usual
        super().__init__()

    @property
    def channels(self) -> list[tuple[str, str | None]]:
        """Names and units of the channels, none before the first lines."""
        layout = self._layout
        return (
            [(name, layout.units.get(name)) for name in self._chosen] if layout else []
        )

    @property
    def advice(self) -> str:
        """Advice for the user if the number of channels is wrong."""
        return (self._layout and self._layout.advice) or super().advice

    def begin(self, head: bytes = b"") -> None:
        """Prepare for the first bytes of a source, which `head` may show."""
        super().begin()
        self._layout = self._time = None
        if head:
            self._learn(head)

    def parts(
        self, data: bytes, *, is_end: bool = False
    ) -> Iterator[tuple[Any, float | None]]:
        """Yield samples, in parts that begin at a known time.

        Parameters
        ----------
        data : bytes
            The next bytes.
        is_end : bool
            Whether they are the last.

        Yields
        ------
        samples : ndarray of shape (n_channels, n_samples)
            The next samples.
        time : float or None
            Seconds at the first sample; None if it follows the sample before.

        Raises
        ------
        ContentError
            If the stream is not text with lines of numbers, lacks a column, or has the
            times of another sampling rate.
        """
        rows = [
            self._row(fields) for fields in map(self._fields, self._lines(data, is_end))
        ]
        if self._layout is None:
            return
        rows = [row for row in rows if row]
        values = np.array(rows, dtype=np.float64).reshape(-1, len(self._chosen) + 1)
        yield from self._times.cut(values[:, :-1].T, values[:, -1])

    def _lines(self, data, is_end):
        """Whole lines after the header; none as long as the layout is unknown."""
        lines, self._rest = [], self._rest + data
        if self._layout is None and self._learn(self._rest, is_end):
            self._rest = self._rest.split(b"\n", self._layout.n_head_lines)[-1]
        if self._layout is not None:
            *lines, self._rest = self._rest.split(b"\n")
            if is_end:
                lines, self._rest = [*lines, self._rest], b""
        if len(self._rest) > _LONGEST_LINE:
            raise _no_numbers(f"{len(self._rest)} bytes without a line of numbers")
        return lines

    def _learn(self, head, is_end=False):
        """Infer the layout; return whether there are enough lines."""
        *lines, rest = head.split(b"\n")
        lines += [rest] if is_end and rest else []
        telling = [
            i for i, line in enumerate(lines) if line.strip() and line[:1] not in b"#%"
        ]
        if not telling or (len(telling) < _HEAD_LINES and not is_end):
            return False
        # The layout must not depend on how many lines came together.
        lines = lines[: telling[:_HEAD_LINES][-1] + 1]
        whole = _AT_LINE_END.sub(b"\n", b"\n".join([*lines, b""]))
        # A stream that is already running begins with the end of a line.
        try:
            self._layout = text_layout(whole, True, may_be_cut=True)
        except csv.Error as error:
            raise ContentError(f"{error}, expected csv lines") from error
        self.unread[_BAD_LINES] += self._layout.n_ignored
        self._names = self._layout.names
        rows, n_head = [self._fields(line) for line in lines], self._layout.n_head_lines
        self._head_rows = [sorted(row) for row in rows[:n_head]]
        self._choose_columns([row for row in rows[n_head:] if row])
        return True

    def _choose_columns(self, rows):
        """Choose the columns, and make sure that they hold numbers."""
        layout, samples = self._layout, list(filter(None, map(self._by_name, rows)))
        options = self._channel, self._speed, self._usual
        self._chosen = chosen_channels(layout.names, *options)
        self._time = self._times.find(layout, samples, self._chosen)
        if self._time in self._chosen and self._channel is None:
            self._chosen.remove(self._time)
        fields = [[sample[name] for name in self._chosen] for sample in samples]
        if rows and not any(
            all(is_number(f, layout.decimal) for f in row) for row in fields
        ):
            line = layout.separator.join(rows[0])[:40]
            raise _no_numbers(f"{line!r} is no line of {len(layout.names)} numbers")

    def _by_name(self, fields):
        is_whole = len(fields) == len(self._names)
        return dict(zip(self._names, fields, strict=True)) if is_whole else {}

    def _fields(self, line):
        text, separator = (
            line.decode("utf-8-sig", "replace").strip(),
            self._layout.separator,
        )
        fields = text.split(None if separator == r"\s+" else separator) if text else []
        if len(fields) == len(self._names) + 1 and not fields[-1].strip():
            fields.pop()
        return [field.strip().strip('"') for field in fields]

    def _row(self, fields):
        """Values and time of a line, NaN if they cannot be read; None for names and units."""
        sample, time = self._by_name(fields), np.nan
        texts = [sample.get(name, "") for name in self._chosen]
        if not all(text and is_number(text, ",") for text in texts):
            if not fields or self._comes_again(fields):
                return None
            self.unread[_BAD_LINES] += 1
            texts = [""] * len(texts)
        if sample and self._time is not None:
            time = self._times.seconds(sample)
            self.unread[_BAD_TIMES] += np.isnan(time)
        return [*map(number, texts), time]

    def _comes_again(self, fields):
        """Whether a line holds names or units; names in another order move the columns."""
        if not self._layout.has_header or not {*self._chosen, self._time} <= {
            *fields,
            None,
        }:
            return sorted(fields) in self._head_rows
        self._names = fields
        return True


def _no_numbers(found):
    return ContentError(
        f"{found}, expected csv lines in UTF-8; raw samples need --dtype"
    )
