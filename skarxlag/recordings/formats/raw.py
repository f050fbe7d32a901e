"""Binary files without a header, whose type the user states."""

from pathlib import Path
from typing import Any

import numpy as np

from ._contents import Channel, ContentError, Contents, Format, is_numeric, slices

FORMAT = Format("raw binary, with a stated `dtype`", (".bin", ".raw"), states="nothing")

_MOST_CHANNELS = 4096


def contents(path: Path, dtype: str | None = None) -> Contents:
    """Return the channels ``0``, ``1``, ... of interleaved samples, or the fields of a type.

    Parameters
    ----------
    path : Path
        The file.
    dtype : str
        Type of one sample of all channels, as NumPy writes it: ``<i2`` is one channel of 16-bit
        integers with the lowest byte first, ``(4,)<f4`` are four channels of interleaved 32-bit
        floating-point numbers.
    """
    if dtype is None:
        raise ContentError(
            "raw binary states no type; expected dtype, such as '<i2' or '(4,)<f4' for four "
            "interleaved channels"
        )
    frame = frame_type(dtype)
    n_bytes = path.stat().st_size
    if n_bytes % frame.itemsize:
        raise ContentError(
            f"{n_bytes} bytes are no multiple of the {frame.itemsize} bytes of dtype {dtype!r}"
        )
    n_frames = n_bytes // frame.itemsize

    def read(names, n_samples):
        for part in slices(n_frames, n_samples):
            count = part.stop - part.start
            frames = np.fromfile(path, frame, count, offset=part.start * frame.itemsize)
            yield [frames[name] for name in names]

    return Contents({name: Channel() for name in frame.names}, read)


def frame_type(text: str) -> np.dtype[Any]:
    """Structured type of one sample of all channels, from what the user states."""
    try:
        dtype = np.dtype(text)
    except (TypeError, ValueError, SyntaxError) as error:
        raise ContentError(f"dtype is {text!r}, expected a type such as '<i2'") from error
    if dtype.names is None:
        base, shape = dtype.base, dtype.shape
        n_channels = int(np.prod(shape, dtype=int))
        if n_channels > _MOST_CHANNELS:
            raise ContentError(f"dtype is {text!r}, expected at most {_MOST_CHANNELS} channels")
        dtype = np.dtype([(str(i), base) for i in range(n_channels)])
    kinds = [field for field, *_ in dtype.fields.values()] if dtype.fields else []
    if not kinds or not all(is_numeric(kind) and kind.itemsize for kind in kinds):
        raise ContentError(f"dtype is {text!r}, expected numeric channels such as '<i2'")
    return dtype
