"""Binary files without a header, whose type the user states."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from .arrays import NamedArrays
from .contents import ContentError, Contents, Format

FORMAT = Format((".bin", ".raw"))

_MOST_CHANNELS = 4096


def contents(path: Path, dtype: str | None = None) -> Iterator[Contents]:
    """Return the channels ``0``, ``1``, ... of interleaved samples, or the fields of a type.

    Parameters
    ----------
    path : Path
        The file.
    dtype : str
        Type of one sample of all channels, as NumPy writes it: ``<i2`` is one channel
        of 16-bit integers with the lowest byte first, ``(4,)<f4`` are four channels of
        interleaved 32-bit floating-point numbers.
    """
    if dtype is None:
        raise ContentError(
            "raw binary states no type; expected dtype, such as '<i2' or '(4,)<f4'"
        )
    frame = frame_type(dtype)
    n_bytes = path.stat().st_size
    if n_bytes % frame.itemsize:
        raise ContentError(
            f"{n_bytes} bytes are no multiple of the {frame.itemsize} bytes of dtype "
            f"{dtype!r}"
        )

    def mapped(name):
        # Called for each block, as in npy. An empty file cannot be mapped.
        return (
            np.memmap(path, frame, "r")[name] if n_bytes else np.zeros(0, frame)[name]
        )

    arrays = NamedArrays(mapped)
    for name in frame.names:
        arrays.add(name, (n_bytes // frame.itemsize,))
    yield arrays.contents()


def frame_type(text: str) -> np.dtype[Any]:
    """Structured type of one sample of all channels, from what the user states."""
    message = (
        f"dtype is {text!r}, expected real numbers such as '<i2', of at most "
        f"{_MOST_CHANNELS} channels"
    )
    try:
        dtype = np.dtype(text)
    except (TypeError, ValueError, SyntaxError) as error:
        raise ContentError(message) from error
    if dtype.names is None and np.prod(dtype.shape) <= _MOST_CHANNELS:
        n_channels = int(np.prod(dtype.shape, dtype=int))
        dtype = np.dtype([(str(i), dtype.base) for i in range(n_channels)])
    kinds = [field for field, *_ in (dtype.fields or {}).values()]
    if not kinds or not all(kind.kind in "fiu" for kind in kinds):
        raise ContentError(message)
    return dtype
