"""From the bytes of a running source to samples."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .formats._contents import ContentError, choose_channel
from .formats._facts import names_times
from .formats.raw import frame_type
from .formats.text import is_number, text_layout
from .live_times import StreamTimes

#: Lines from which the layout of a text is told: names, units, and two of samples.
_HEAD_LINES = 4
#: Bytes beyond which a line is none.
_LONGEST_LINE = 2**20
#: Some loggers end each line with a separator.
_AT_LINE_END = re.compile(rb"[;,][ \t\r]*(\n|$)")


def chosen_channels(names: list[str], channel: str | Sequence[str] | None) -> list[str]:
    """Names of the channels that are asked for.

    Parameters
    ----------
    names : list of str
        What there is.
    channel : str, list of str, or None
        As in `read_recording`; None takes all but the times.

    Examples
    --------
    >>> chosen_channels(["time", "DE_time", "FE_time"], ["FE*", "1"])
    ['FE_time', 'DE_time']
    >>> chosen_channels(["time", "acc"], None)
    ['acc']
    """
    if channel is None:
        return [name for name in names if not names_times(name) or len(names) == 1]
    wanted = [channel] if isinstance(channel, str) else channel
    return [choose_channel(names, each) for each in wanted]


class RawSamples:
    """Interleaved binary samples of a stated type.

    Parameters
    ----------
    dtype : str
        Type of one sample of all channels, such as ``<i2``, or ``(4,)<f4`` for four channels.
    channel : str, list of str, or None
        Channels that are wanted, in their order; None for all.

    Attributes
    ----------
    n_cut : int
        Bytes at the end that are no whole sample.
    """

    n_cut: int

    def __init__(self, dtype: str, channel: str | Sequence[str] | None = None) -> None:
        self._frame = frame_type(dtype)
        if any(self._frame[name].kind == "c" for name in self._frame.names):
            raise ContentError(f"dtype is {dtype!r}, expected real numbers such as '<f4'")
        self._names = chosen_channels(list(self._frame.names), channel)
        self.n_cut = 0
        self.begin()

    def begin(self, head: bytes = b"") -> None:
        """Forget what waits for its rest: a source begins."""
        self._rest = b""

    @property
    def n_pending(self) -> int:
        """Bytes that wait for the rest."""
        return len(self._rest)

    def parse(self, data: bytes, *, is_end: bool = False) -> NDArray[Any]:
        """Samples of shape (n_channels, n_samples); a sample that is not whole yet waits."""
        data = self._rest + data
        n_whole = len(data) // self._frame.itemsize * self._frame.itemsize
        self._rest = data[n_whole:]
        self.n_cut = len(self._rest) if is_end else 0
        frames = np.frombuffer(data[:n_whole], self._frame)
        with np.errstate(invalid="ignore"):
            return np.stack([frames[name].astype(np.float64) for name in self._names])

    def parts(
        self, data: bytes, *, is_end: bool = False
    ) -> Iterator[tuple[NDArray[Any], float | None]]:
        """Samples, and None for their time, which raw samples do not state."""
        yield self.parse(data, is_end=is_end), None


class TextSamples:
    """Lines of numbers, one for each moment.

    Separator, names and units are told from the first lines, as `read_recording` tells them. Where
    the comma does not separate, it may be the decimal sign. A later line that cannot be read
    becomes a missing sample, so that the time goes on. Names and units that come again are left
    out, and names in another order move the columns. A first line of which the beginning is
    missing is left out, too.

    Parameters
    ----------
    channel : str, list of str, or None
        Columns that are wanted, in their order; None for all but that of times.
    times : StreamTimes or None
        Reads the column of times; None where there shall be none.

    Attributes
    ----------
    n_bad : int
        Lines that could not be read.
    """

    n_bad: int

    def __init__(
        self, channel: str | Sequence[str] | None = None, times: StreamTimes | None = None
    ) -> None:
        self.n_bad, self._channel, self._times = 0, channel, times
        self.begin()

    @property
    def n_bad_times(self) -> int:
        """Times that could not be read."""
        return 0 if self._times is None else self._times.n_bad

    def begin(self, head: bytes = b"") -> None:
        """Forget what waits and what is known: a source begins.

        Parameters
        ----------
        head : bytes
            The beginning of the source, where only what comes behind it will be parsed.
        """
        self._rest, self._layout, self._is_in_long_line = b"", None, False
        if self._times is not None:
            self._times.begin()
        if head and self._learn(head):
            self._n_to_skip = 0

    @property
    def n_pending(self) -> int:
        """Bytes that wait for the rest."""
        return len(self._rest)

    def parts(
        self, data: bytes, *, is_end: bool = False
    ) -> Iterator[tuple[NDArray[Any], float | None]]:
        """Samples, cut where the time of the first one has to be told, and that time.

        Parameters
        ----------
        data : bytes
            What has come.
        is_end : bool
            Whether nothing will come any more.

        Yields
        ------
        samples : ndarray of shape (n_channels, n_samples)
            The next samples.
        time : float or None
            Seconds at which the first was taken; None where it follows what came before.

        Raises
        ------
        ContentError
            If the stream is no text with lines of numbers, lacks a column, or has the times of
            another sampling rate.
        """
        rows = self._rows(data, is_end)
        if self._time is None:
            yield rows.T, None
        else:
            yield from self._times.cut(rows[:, :-1].T, rows[:, -1])

    def parse(self, data: bytes, *, is_end: bool = False) -> NDArray[Any]:
        """Samples of shape (n_channels, n_samples); a line that is not whole yet waits."""
        return np.concatenate([part for part, _ in self.parts(data, is_end=is_end)], axis=1)

    def _rows(self, data, is_end):
        data = self._rest + data
        if self._layout is None and not self._learn(data, is_end):
            self._rest, self._time = data, None
            if len(data) > _LONGEST_LINE:
                raise ContentError(
                    f"{len(data)} bytes without lines of numbers, expected csv lines; raw samples "
                    "need --dtype"
                )
            return np.empty((0, 0))
        *lines, self._rest = data.split(b"\n")
        if is_end and self._rest:
            lines, self._rest = [*lines, self._rest], b""
        if self._is_in_long_line and lines:
            lines, self._is_in_long_line = lines[1:], False
        if len(self._rest) > _LONGEST_LINE:
            # What a logger has lost: it must not fill the memory.
            self.n_bad += not self._is_in_long_line
            self._rest, self._is_in_long_line = b"", True
        lines, self._n_to_skip = lines[self._n_to_skip :], max(self._n_to_skip - len(lines), 0)
        rows = [self._row(text) for text in map(_text, lines) if text]
        rows = [row for row in rows if row is not None]
        n_columns = len(self._positions) + (self._time is not None)
        return np.array(rows, dtype=np.float64).reshape(len(rows), n_columns)

    def _learn(self, head, is_end=False):
        *lines, rest = head.split(b"\n")
        lines += [rest] if is_end and rest else []
        telling = [i for i, line in enumerate(lines) if line.strip() and line[:1] not in b"#%"]
        if not telling or (len(telling) < _HEAD_LINES and not is_end):
            return False
        # The layout must not depend on how many lines came together.
        lines = lines[: telling[:_HEAD_LINES][-1] + 1]
        whole = _AT_LINE_END.sub(b"\n", b"\n".join([*lines, b""]))
        # A stream that is already running begins with the end of a line.
        self._layout = text_layout(whole, True, may_be_cut=True)
        if self._layout.encoding == "utf-16":
            raise ContentError("the text is UTF-16, expected UTF-8")
        self.n_bad += self._layout.n_ignored
        self._n_to_skip = self._layout.n_head_lines
        texts = [_text(line) for line in lines]
        self._head_rows = [sorted(self._names(text)) for text in texts[: self._n_to_skip] if text]
        self._place_columns([self._fields(text) for text in texts[self._n_to_skip :] if text])
        return True

    def _place_columns(self, rows):
        """Find the columns, and make sure that they hold numbers."""
        names, units, decimal = self._layout.names, self._layout.units, self._layout.decimal
        self._positions = [names.index(name) for name in chosen_channels(names, self._channel)]
        self._time = None
        if self._times is not None:
            self._time = self._times.find(names, units, rows, self._positions)
        if self._time in self._positions and self._channel is None:
            self._positions.remove(self._time)
        if rows and not any(
            len(row) == len(names) and all(is_number(row[i], decimal) for i in self._positions)
            for row in rows
        ):
            line = self._layout.separator.join(rows[0])
            raise ContentError(
                f"{line[:40]!r} is no line of {len(names)} numbers, expected csv lines; raw "
                "samples need --dtype"
            )

    def _fields(self, text):
        separator = self._layout.separator
        fields = text.split(None if separator == r"\s+" else separator)
        if len(fields) == len(self._layout.names) + 1 and not fields[-1].strip():
            fields.pop()
        return fields

    def _row(self, text):
        fields = self._fields(text)
        time = [] if self._time is None else [np.nan]
        try:
            # Python takes 1_000 for a number.
            if len(fields) != len(self._layout.names) or "_" in text:
                raise ValueError
            if self._time is not None:
                time = [self._times.seconds(fields[self._time])]
            if self._layout.separator != ",":
                return [float(fields[i].replace(",", ".")) for i in self._positions] + time
            return [float(fields[i]) for i in self._positions] + time
        except ValueError:
            if self._comes_again(text):
                return None
            self.n_bad += 1
            return [np.nan] * len(self._positions) + time

    def _comes_again(self, text):
        """Whether a line holds names or units; names in another order move the columns."""
        names, before = self._names(text), self._layout.names
        used = [before[i] for i in (*self._positions, self._time) if i is not None]
        if self._layout.has_header and set(used) <= set(names):
            self._layout = replace(self._layout, names=names)
            self._positions = [names.index(before[i]) for i in self._positions]
            self._time = None if self._time is None else names.index(before[self._time])
            return True
        return sorted(names) in self._head_rows

    def _names(self, text):
        return [field.strip().strip('"') for field in self._fields(text)]


def _text(line):
    return line.decode("utf-8", "replace").strip().removeprefix("\ufeff")
