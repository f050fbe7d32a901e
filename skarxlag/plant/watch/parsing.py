"""From the bytes of a pipe to samples and their times."""

import codecs
import csv
import io
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ..readers.formats.contents import ContentError, choose_channel, choose_channels
from ..readers.formats.facts import names_speed, names_times
from ..readers.formats.raw import frame_type
from ..readers.formats.text_layout import (
    TextLayout,
    split_rows,
    stream_head,
    text_layout,
)
from .stream_times import StreamTimes

#: Lines from which the layout of a text is inferred, at most.
_HEAD_LINES = 6
#: Longest line in bytes.
_LONGEST = 2**20

#: Samples of shape (n_channels, n_samples), and the time of the first, if it is stated.
Part = tuple[NDArray[Any], float | None]


def chosen_names(
    names: list[str], channel: Any, speed: str | None, usual: list[list[str]]
) -> list[str]:
    """Return the names of the channels of the signal, and that of the shaft speed as the last.

    Parameters
    ----------
    names : list of str
        All channels.
    channel : str, list of str, or None
        As in `read_recording`; None takes all but those of times and of shaft speeds.
    speed : str or None
        Channel of the shaft speed or of pulses.
    usual : list of list of str
        Choices, of which the first that is possible is taken if `channel` is None and
        there are more channels.

    Examples
    --------
    >>> chosen_names(["time", "DE_time", "FE_time"], ["FE*", "1"], None, [])
    ['FE_time', 'DE_time']
    >>> chosen_names(["time", "acc", "rpm"], None, "r*", [])
    ['acc', 'rpm']
    """
    if speed is not None:
        speed = choose_channel(names, speed)
    if channel is not None:
        chosen = choose_channels(names, channel)
    else:
        chosen = [name for name in names if not names_times(name)]
        chosen = [name for name in chosen if not names_speed(name)] or names
        n_signals = len([name for name in chosen if name != speed])
        for choice in usual:
            if len(choice) < n_signals:
                with suppress(ContentError):
                    chosen = choose_channels(names, choice)
                    break
    return [name for name in chosen if name != speed] + ([speed] if speed else [])


class RawParser:
    """Parser of interleaved binary samples.

    Parameters
    ----------
    dtype : str
        Type of one sample of all channels, such as ``<i2``, or ``(4,)<f4`` for four
        channels.
    choose : callable
        Returns the names of the chosen channels, given those of all.

    Attributes
    ----------
    channels : list of tuple
        Names of the channels, and None for their units.
    """

    def __init__(self, dtype: str, choose: Callable[[list[str]], list[str]]) -> None:
        self._frame = frame_type(dtype)
        self._rest = b""
        self.channels = [(name, None) for name in choose(list(self._frame.names))]

    def parts(self, data: bytes, is_end: bool) -> Iterator[Part]:
        """Yield the samples of the next bytes; one that is not whole waits for its rest."""
        data = self._rest + data
        n_whole = len(data) - len(data) % self._frame.itemsize
        self._rest = data[n_whole:]
        frames = np.frombuffer(data[:n_whole], self._frame)
        if len(frames) > 0:
            samples = [frames[name].astype(np.float64) for name, _ in self.channels]
            yield np.stack(samples), None


class TextParser:
    """Parser of lines of numbers, one line for each moment.

    Separator, names and units are inferred from the first lines of numbers and the
    lines before them, as in `read_recording`. Lines further above, such as those that a
    board prints when it starts, are left out. A later line that cannot be read becomes
    a missing sample, so that time goes on. Blank lines are left out, and so are names
    and units that come again.

    Parameters
    ----------
    choose : callable
        Returns the names of the chosen columns, given those of all.
    times : StreamTimes
        Parser of the column of times.

    Attributes
    ----------
    channels : list of tuple
        Names and units of the chosen columns; empty before the first samples.
    advice : str
        Advice for the user if the number of channels is wrong.
    """

    def __init__(
        self, choose: Callable[[list[str]], list[str]], times: StreamTimes
    ) -> None:
        self._choose = choose
        self._times = times
        self._rest = b""
        self._first_lines: list[bytes] = []
        self._layout: TextLayout | None = None
        self._head: set[bytes] = set()
        self.channels: list[tuple[str, str | None]] = []
        self.advice = ""

    def parts(self, data: bytes, is_end: bool) -> Iterator[Part]:
        """Yield the samples of the next bytes, in parts that begin at a known time.

        Raises
        ------
        ContentError
            If the bytes are not text with lines of numbers, lack a column, or have the
            times of another sampling rate.
        """
        lines = (self._rest + data).split(b"\n")
        self._rest = b"" if is_end else lines.pop()
        lines = [line.rstrip(b"\r ") for line in lines if line.strip()]
        if self._layout is None:
            if lines and not self._first_lines:
                lines[0] = lines[0].removeprefix(codecs.BOM_UTF8)
            self._first_lines += lines
            lines = self._after_head(is_end)
        if len(self._rest) > _LONGEST:
            raise _no_numbers(self._rest)
        if lines := [line for line in lines if line not in self._head]:
            frame = _frame(lines, self._layout)
            samples = [self._numbers(frame[name]) for name, _ in self.channels]
            yield from self._times.cut(np.stack(samples), frame)

    def _after_head(self, is_end):
        """Infer the layout, and return the lines of samples so far; none if it is unknown."""
        lines = self._first_lines
        # The layout must not depend on how many lines came together.
        n_lines = stream_head([line.decode(errors="replace") for line in lines])
        if n_lines is None:
            if not (is_end and lines):
                return []
            n_lines = len(lines)
        # Of what a board prints at its start, only names and units are of use.
        start = max(n_lines - _HEAD_LINES, 0)
        text = b"\n".join(line.rstrip(b";,") for line in lines[start:n_lines])
        try:
            layout = text_layout(text + b"\n", True, may_be_cut=True)
        except (ContentError, csv.Error) as error:
            raise _no_numbers(lines[0]) from error
        kinds = dict(zip(layout.names, layout.kinds, strict=False))
        if "number" not in kinds.values() or b"\0" in text:
            raise _no_numbers(lines[0])
        names = self._choose(layout.names)
        samples = [
            dict(zip(layout.names, row, strict=False))
            for _, row in split_rows(
                text.decode(errors="replace").split("\n"), layout.separator
            )
        ][layout.n_head_lines :]
        time = self._times.find(layout, samples, names)
        if time in names and len(names) > 1:
            names.remove(time)
        self.channels = [(name, layout.units.get(name)) for name in names]
        self.advice = layout.advice
        self._layout = layout
        self._first_lines = []
        first = start + layout.n_head_lines
        self._head = {*lines[start:first]}
        return lines[first:]

    def _numbers(self, column):
        """Return the numbers of a column; NaN for texts."""
        if column.dtype == np.float64:
            return column.to_numpy()
        texts = column.astype(str).str.replace(self._layout.decimal, ".")
        return pd.to_numeric(texts, errors="coerce").to_numpy(np.float64)


def _no_numbers(line):
    return ContentError(
        f"{line[:40].decode(errors='replace')!r} is no line of numbers, expected csv "
        "lines in UTF-8; raw samples need --dtype"
    )


def _frame(lines, layout):
    """Return the columns of lines of samples. Those of a line with surplus fields are empty."""
    n_fields = len(layout.names) + 1
    # pandas takes the number of columns from the first line.
    first = " ".join(["0"] * n_fields)
    if layout.separator != r"\s+":
        first = layout.separator * (n_fields - 1)
    text = b"\n".join([first.encode(), *lines]).replace(b'"', b"")
    frame = pd.read_csv(
        io.BytesIO(text),
        sep=layout.separator,
        decimal=layout.decimal,
        names=[*layout.names, "surplus fields"],
        usecols=range(n_fields),
        header=None,
        index_col=False,
        quoting=csv.QUOTE_NONE,
        encoding_errors="replace",
        skip_blank_lines=False,
    )[1:]
    is_whole = frame.pop("surplus fields").isna()
    return frame.where(is_whole)
