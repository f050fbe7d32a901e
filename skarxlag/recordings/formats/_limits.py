"""Bounds on what a file may unpack to, known before it is unpacked."""

import io
from pathlib import Path
from typing import Any

from ._contents import ContentError

#: Text, sensor noise and pauses compress by less than this. Deflate reaches 1000.
_RATIO = 100
_ALWAYS_ALLOWED = 2**28


def unpacked_limit(n_bytes: int) -> int:
    """Bytes that a compressed file of `n_bytes` may hold."""
    return max(_ALWAYS_ALLOWED, _RATIO * n_bytes)


def check_unpacked(path: Path, unpacked: int) -> None:
    """Refuse a compressed file that holds more than is plausible for a recording.

    Parameters
    ----------
    path : Path
        The compressed file.
    unpacked : int
        Bytes that it states to hold.

    Raises
    ------
    ContentError
        If that is more than 256 MiB and more than 100 times the size of the file.
    """
    n_bytes = path.stat().st_size
    if unpacked > unpacked_limit(n_bytes):
        raise ContentError(
            f"{n_bytes} bytes would unpack to {unpacked}, which is refused: expected at most "
            f"{_ALWAYS_ALLOWED} bytes or {_RATIO} times the size of the file"
        )


class BoundedReader(io.RawIOBase):
    """A stream that is unpacked while it is read, up to the bound for its file.

    The length is not known in advance for gzip, so it is counted.
    """

    def __init__(self, stream: Any, path: Any) -> None:
        self._stream, self._path, self._count = stream, path, 0

    def readable(self) -> bool:
        """As of a file."""
        return True

    def readinto(self, buffer: Any) -> int:
        """As of a file."""
        n_bytes = self._stream.readinto(buffer)
        self._count += n_bytes
        check_unpacked(self._path, self._count)
        return n_bytes
