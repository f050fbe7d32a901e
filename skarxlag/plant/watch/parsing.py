"""From the bytes of a pipe to samples."""

import csv
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ..readers.formats.contents import ContentError, choose_channel, choose_channels
from ..readers.formats.facts import names_speed, names_times
from ..readers.formats.raw import frame_type
from ..readers.formats.text_layout import TextLayout, text_layout

#: Lines from which the layout of a text is inferred. A window has more samples.
_HEAD_LINES = 200
#: Longest line in bytes.
_LONGEST = 2**20


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
        Channel of the shaft speed.
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
    advice : str
        Advice for the user if the number of channels is wrong.
    """

    advice = ""

    def __init__(self, dtype: str, choose: Callable[[list[str]], list[str]]) -> None:
        self._frame = frame_type(dtype)
        self._rest = b""
        self.channels = [(name, None) for name in choose(list(self._frame.names))]

    def samples(self, data: bytes, is_end: bool) -> NDArray[Any]:
        """Return the samples of the next bytes; one that is not whole waits for its rest.

        The array has shape (n_channels, n_samples).
        """
        data = self._rest + data
        n_whole = len(data) - len(data) % self._frame.itemsize
        self._rest = data[n_whole:]
        frames = np.frombuffer(data[:n_whole], self._frame)
        return np.stack([frames[name].astype(float) for name, _ in self.channels])


class TextParser:
    """Parser of lines of numbers, one line for each moment.

    Separator, names and units are inferred from the first 200 lines, as in
    `read_recording`. Lines further above, such as those that a board prints when it
    starts, are left out. A later line that cannot be read becomes
    a missing sample, so that time goes on. Blank lines are left out, and so are names
    and units that come again.

    Parameters
    ----------
    choose : callable
        Returns the names of the chosen columns, given those of all.

    Attributes
    ----------
    channels : list of tuple
        Names and units of the chosen columns; empty before the first samples.
    advice : str
        Advice for the user if the number of channels is wrong.
    """

    def __init__(self, choose: Callable[[list[str]], list[str]]) -> None:
        self._choose = choose
        self._rest = b""
        self._first_lines: list[str] = []
        self._layout: TextLayout | None = None
        self._head: set[str] = set()
        self.channels: list[tuple[str, str | None]] = []
        self.advice = ""

    def samples(self, data: bytes, is_end: bool) -> NDArray[Any]:
        """Return the samples of the next bytes, of shape (n_channels, n_samples).

        Raises
        ------
        ContentError
            If the bytes are not text with lines of numbers, or lack a column.
        """
        whole, sign, self._rest = (self._rest + data).rpartition(b"\n")
        if len(self._rest) > _LONGEST:
            raise _no_numbers(self._rest.decode(errors="replace"))
        if is_end:
            whole += sign + self._rest
        text = whole.decode(errors="replace")
        lines = [line.rstrip("\r ") for line in text.split("\n") if line.strip()]
        if self._layout is None:
            self._first_lines += lines
            lines = self._after_head(is_end)
        return self._numbers([line for line in lines if line not in self._head])

    def _after_head(self, is_end):
        """Infer the layout, and return the lines of samples so far; none if it is unknown."""
        lines = self._first_lines
        # The layout must not depend on how many lines came together.
        if not lines or (len(lines) < _HEAD_LINES and not is_end):
            return []
        lines[0] = lines[0].removeprefix("\ufeff")
        text = "".join(line.rstrip(";,") + "\n" for line in lines[:_HEAD_LINES])
        try:
            layout = text_layout(text.encode(), True, may_be_cut=True)
        except (ContentError, csv.Error) as error:
            raise _no_numbers(lines[0]) from error
        if "number" not in layout.kinds or "\0" in text:
            raise _no_numbers(lines[0])
        names = self._choose(list(layout.channels))
        self.channels = [(name, layout.channels[name].unit) for name in names]
        self.advice = layout.advice
        self._layout = layout
        self._head = {*lines[: layout.n_head_lines]}
        return lines[layout.n_head_lines :]

    def _numbers(self, lines):
        """Return the numbers of the chosen columns, NaN in a line with surplus fields."""
        if not lines:
            return np.empty((len(self.channels), 0))
        layout = self._layout
        n_fields = len(layout.channels)
        separator = None if layout.separator == r"\s+" else layout.separator
        rows = []
        for line in lines:
            text = line.replace('"', "").replace(layout.decimal, ".")
            fields = text.split(separator)
            is_whole = not any(fields[n_fields:])
            rows.append([*fields, *[""] * n_fields] if is_whole else [""] * n_fields)
        columns = dict(zip(layout.channels, zip(*rows, strict=False), strict=False))
        return np.stack(
            [
                pd.to_numeric(pd.Series(columns[name]), errors="coerce").astype(float)
                for name, _ in self.channels
            ]
        )


def _no_numbers(line):
    return ContentError(
        f"{line[:40]!r} is no line of numbers, expected csv lines in UTF-8; raw samples "
        "need --dtype"
    )
