"""From the bytes of a running source to samples."""

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..recordings.formats._layout import text_layout
from ..recordings.formats._naming import choose_channel
from ..recordings.formats._time_axis import names_times
from ..recordings.formats.raw import frame_type

#: Lines from which the layout of a text is told: names, units, and two of samples.
_HEAD_LINES = 4
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
    n_bad : int
        Always 0: any bytes are samples.
    """

    n_bad = 0

    def __init__(self, dtype: str, channel: Any = None) -> None:
        self._frame = frame_type(dtype)
        self._names = chosen_channels(list(self._frame.names), channel)
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
        frames = np.frombuffer(data[:n_whole], self._frame)
        with np.errstate(invalid="ignore"):
            return np.stack([frames[name].astype(np.float64) for name in self._names])


class TextSamples:
    """Lines of numbers, one for each moment.

    Separator, names and units are told from the first lines, as `read_recording` tells them. Where
    the comma does not separate, it may be the decimal sign. A later line that cannot be read
    becomes a missing sample, so that the time goes on.

    Parameters
    ----------
    channel : str, list of str, or None
        Columns that are wanted, in their order; None for all but that of times.

    Attributes
    ----------
    n_bad : int
        Lines that could not be read.
    """

    n_bad: int

    def __init__(self, channel: Any = None) -> None:
        self.n_bad, self._channel = 0, channel
        self.begin()

    def begin(self, head: bytes = b"") -> None:
        """Forget what waits and what is known: a source begins.

        Parameters
        ----------
        head : bytes
            The beginning of the source, where only what comes behind it will be parsed.
        """
        self._rest, self._layout = b"", None
        if head and self._learn(head):
            self._n_to_skip = 0

    @property
    def n_pending(self) -> int:
        """Bytes that wait for the rest."""
        return len(self._rest)

    def parse(self, data: bytes, *, is_end: bool = False) -> NDArray[Any]:
        """Samples of shape (n_channels, n_samples); a line that is not whole yet waits."""
        data = self._rest + data
        if self._layout is None and not self._learn(data, is_end):
            self._rest = data
            return np.empty((0, 0))
        *lines, self._rest = data.split(b"\n")
        if is_end and self._rest:
            lines, self._rest = [*lines, self._rest], b""
        lines, self._n_to_skip = lines[self._n_to_skip :], max(self._n_to_skip - len(lines), 0)
        texts = (line.decode("utf-8", "replace").strip() for line in lines)
        rows = [self._row(text) for text in texts if text]
        return np.array(rows, dtype=np.float64).reshape(len(rows), len(self._positions)).T

    def _learn(self, head, is_end=False):
        lines = head.removesuffix(b"\n").split(b"\n")
        n_telling = sum(bool(line.strip()) and line[:1] not in b"#%" for line in lines)
        n_whole = n_telling - (not head.endswith(b"\n"))
        if not n_telling or (n_whole < _HEAD_LINES and not is_end):
            return False
        is_whole = head.endswith(b"\n") or is_end
        self._layout = text_layout(_AT_LINE_END.sub(b"\n", head), is_whole)
        names = self._layout.names
        self._positions = [names.index(name) for name in chosen_channels(names, self._channel)]
        self._n_to_skip = self._layout.n_head_lines
        return True

    def _row(self, text):
        separator = self._layout.separator
        fields = text.split(None if separator == r"\s+" else separator)
        if len(fields) == len(self._layout.names) + 1 and not fields[-1].strip():
            fields.pop()
        try:
            if len(fields) != len(self._layout.names):
                raise ValueError
            if separator != ",":
                return [float(fields[i].replace(",", ".")) for i in self._positions]
            return [float(fields[i]) for i in self._positions]
        except ValueError:
            self.n_bad += 1
            return [np.nan] * len(self._positions)
