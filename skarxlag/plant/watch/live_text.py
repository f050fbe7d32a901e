"""From the lines of a running source to samples and their times."""

import csv
import re
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ..readers.formats.contents import ContentError
from ..readers.formats.facts import is_number, number
from ..readers.formats.text_layout import stream_head, text_layout
from .live_samples import Channels, Samples, chosen_channels
from .live_times import StreamTimes

#: Descriptions of what could not be read.
_BAD_LINES = "lines that are no numbers"
_BAD_TIMES = "times that could not be read"
#: Longest line, in bytes.
_LONGEST_LINE = 2**20
#: Some loggers end each line with a separator.
_AT_LINE_END = re.compile(rb"[;,][ \t\r]*(\n|$)")


class TextSamples(Samples):
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
        self._channel = channel
        self._times = times
        self._speed = speed
        self._usual = usual
        super().__init__()

    @property
    def channels(self) -> list[tuple[str, str | None]]:
        """Names and units of the channels, none before the first lines."""
        if self._layout is None:
            return []
        return [(name, self._layout.units.get(name)) for name in self._chosen]

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
        lines = []
        self._rest = self._rest + data
        if self._layout is None and self._learn(self._rest, is_end):
            self._rest = self._rest.split(b"\n", self._layout.n_head_lines)[-1]
        if self._layout is not None:
            *lines, self._rest = self._rest.split(b"\n")
            if is_end:
                lines = [*lines, self._rest]
                self._rest = b""
        if len(self._rest) > _LONGEST_LINE:
            raise _no_numbers(f"{len(self._rest)} bytes without a line of numbers")
        return lines

    def _learn(self, head, is_end=False):
        """Infer the layout; return whether there are enough lines."""
        *lines, rest = head.split(b"\n")
        lines += [rest] if is_end and rest else []
        # The layout must not depend on how many lines came together.
        n_lines = stream_head([line.decode("utf-8", "replace") for line in lines])
        if n_lines is None and not (is_end and b"".join(lines).strip()):
            return False
        lines = lines[:n_lines]
        text = _AT_LINE_END.sub(b"\n", b"\n".join([*lines, b""]))
        # A stream that is already running begins with the end of a line.
        try:
            self._layout = text_layout(text, True, may_be_cut=True)
        except csv.Error as error:
            raise ContentError(f"{error}, expected csv lines") from error
        self.unread[_BAD_LINES] += self._layout.n_ignored
        self._names = self._layout.names
        rows = [self._fields(line) for line in lines]
        n_head = self._layout.n_head_lines
        self._head_rows = [sorted(row) for row in rows[:n_head]]
        self._choose_columns([row for row in rows[n_head:] if row])
        return True

    def _choose_columns(self, rows):
        """Choose the columns, and make sure that they hold numbers."""
        layout = self._layout
        samples = list(filter(None, map(self._by_name, rows)))
        self._chosen = chosen_channels(
            layout.names, self._channel, self._speed, self._usual
        )
        self._time = self._times.find(layout, samples, self._chosen)
        if self._time in self._chosen and self._channel is None:
            self._chosen.remove(self._time)
        fields = [[sample[name] for name in self._chosen] for sample in samples]
        are_numbers = (
            all(is_number(field, layout.decimal) for field in row) for row in fields
        )
        if rows and not any(are_numbers):
            line = layout.separator.join(rows[0])[:40]
            raise _no_numbers(f"{line!r} is no line of {len(layout.names)} numbers")

    def _by_name(self, fields):
        is_whole = len(fields) == len(self._names)
        return dict(zip(self._names, fields, strict=True)) if is_whole else {}

    def _fields(self, line):
        text = line.decode("utf-8-sig", "replace").strip()
        separator = self._layout.separator
        fields = text.split(None if separator == r"\s+" else separator) if text else []
        if len(fields) == len(self._names) + 1 and not fields[-1].strip():
            fields.pop()
        return [field.strip().strip('"') for field in fields]

    def _row(self, fields):
        """Values and time of a line, NaN if they cannot be read; None for names and units."""
        sample = self._by_name(fields)
        time = np.nan
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
        """Return whether a line has names or units; names in another order move the columns."""
        has_names = {*self._chosen, self._time} <= {*fields, None}
        if not self._layout.has_header or not has_names:
            return sorted(fields) in self._head_rows
        self._names = fields
        return True


def _no_numbers(problem):
    return ContentError(
        f"{problem}, expected csv lines in UTF-8; raw samples need --dtype"
    )
