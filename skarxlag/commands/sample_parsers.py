"""From the bytes of a running source to samples."""

import re
from typing import Any

import numpy as np

from ..recordings.formats.raw import frame_type

_SEPARATORS = re.compile(r"[,;\s]+")


class RawSamples:
    """Interleaved binary samples of a stated type.

    Parameters
    ----------
    dtype : str
        Type of one sample of all channels, such as ``<i2``, or ``(4,)<f4`` for four channels.
    columns : list of int or None
        Channels that are wanted, in their order; None for all.

    Attributes
    ----------
    n_bad : int
        Always 0: any bytes are samples.
    """

    n_bad = 0

    def __init__(self, dtype: str, columns: list[int] | None) -> None:
        self._frame = frame_type(dtype)
        names = list(self._frame.names)
        self._names = names if columns is None else [names[column] for column in columns]
        self._rest = b""

    @property
    def n_pending(self) -> Any:
        """Bytes that wait for the rest."""
        return len(self._rest)

    def parse(self, data: Any, *, is_end: Any = False) -> Any:
        """Samples of shape (n_channels, n_samples); a sample that is not whole yet waits."""
        data = self._rest + data
        n_whole = len(data) // self._frame.itemsize * self._frame.itemsize
        self._rest = data[n_whole:]
        frames = np.frombuffer(data[:n_whole], self._frame)
        return np.stack([frames[name].astype(np.float64) for name in self._names])


class TextSamples:
    """Lines of numbers, one for each moment, separated by commas, semicolons or white space.

    A first line that holds no numbers is the header. Any other line that cannot be read becomes a
    missing sample, so that the time goes on.

    Parameters
    ----------
    columns : list of int or None
        Columns that are wanted, in their order; None for all.

    Attributes
    ----------
    n_bad : int
        Lines that could not be read.
    """

    n_bad: int

    def __init__(self, columns: list[int] | None) -> None:
        self.n_bad = 0
        self._columns, self._n_columns, self._is_first = columns, None, True
        self._rest = b""

    @property
    def n_pending(self) -> Any:
        """Bytes that wait for the rest."""
        return len(self._rest)

    def parse(self, data: Any, *, is_end: Any = False) -> Any:
        """Samples of shape (n_channels, n_samples); a line that is not whole yet waits."""
        *lines, self._rest = (self._rest + data).split(b"\n")
        if is_end and self._rest:
            lines, self._rest = [*lines, self._rest], b""
        rows = [self._row(line.decode("utf-8", "replace").strip()) for line in lines]
        rows = [row for row in rows if row is not None]
        n_wanted = self._n_columns or 0 if self._columns is None else len(self._columns)
        rows = [row or [np.nan] * n_wanted for row in rows]
        return np.array(rows, dtype=np.float64).reshape(len(rows), n_wanted).T

    def _row(self, line):
        """Wanted numbers of a line; none where it cannot be read, None where it is no sample."""
        if not line:
            return None
        is_first, self._is_first = self._is_first, False
        try:
            numbers = [float(field) for field in _SEPARATORS.split(line.strip(",;"))]
            wanted = numbers if self._columns is None else [numbers[i] for i in self._columns]
        except (ValueError, IndexError):
            if is_first:
                return None
            self.n_bad += 1
            return []
        if self._n_columns is None:
            self._n_columns = len(numbers)
        if len(numbers) != self._n_columns:
            self.n_bad += 1
            return []
        return wanted
