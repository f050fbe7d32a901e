"""The channels of one file: their names, how they are read, and what the file states."""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import DTypeLike

#: A compressed file may unpack to so many bytes, or to so many times its size. Text, sensor noise
#: and pauses compress by less than 100; deflate reaches 1000.
_ALWAYS_ALLOWED, _RATIO = 2**28, 100


class ContentError(ValueError):
    """An intact file does not hold what is asked for."""


@dataclass
class Contents:
    """The channels of one file.

    Attributes
    ----------
    channels : sequence of str
        Names of the channels, in the order of the file.
    read : callable
        ``read(names, n_samples)`` yields one list of equally long arrays (or pandas Series) for
        each block, in the order of `names`, with at most `n_samples` values in each array. None
        requests one block of everything. Formats that are only read whole ignore `n_samples`.
    sampling_rates : mapping of str to float
        In Hz, by channel, if the file states it.
    units : mapping of str to str
        By channel, if the file states it.
    lengths : mapping of str to int, or None
        Samples in each channel. None if all are equally long.
    refused : mapping of str to str
        Arrays that are not channels, such as square matrices, and the reason.
    starts : mapping of str to float
        Seconds since 1970 at the first sample, by channel, if the file states a date.
    speeds : mapping of str to float
        Shaft speed in rev/min, by channel, if the file states it.
    """

    channels: Sequence[str]
    read: Callable[[list[str], int | None], Iterator[list[Any]]]
    sampling_rates: Mapping[str, float] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    lengths: Mapping[str, int] | None = None
    refused: Mapping[str, str] = field(default_factory=dict)
    starts: Mapping[str, float] = field(default_factory=dict)
    speeds: Mapping[str, float] = field(default_factory=dict)


def choose_channel(names: list[str], channel: str | int) -> str:
    """Return the name of a channel.

    Parameters
    ----------
    names : list of str
        The channels of the file, in its order.
    channel : str or int
        The whole name; the position, counted from 0, also as a text of digits; or a pattern, in
        which ``*`` stands for any characters and ``?`` for one.

    Examples
    --------
    >>> choose_channel(["X097_DE_time", "X097_FE_time"], "*_DE_time")
    'X097_DE_time'
    """
    is_text = isinstance(channel, str)
    if is_text and channel in names:
        return channel
    is_position = isinstance(channel, Integral) or (is_text and channel.isdecimal())
    if is_position and 0 <= int(channel) < len(names):
        return names[int(channel)]
    if is_text and ("*" in channel or "?" in channel):
        pattern = re.escape(str(channel)).replace(r"\*", ".*").replace(r"\?", ".")
        matching = [name for name in names if re.fullmatch(pattern, name)]
        if len(matching) == 1:
            return matching[0]
        if matching:
            raise ContentError(f"channel {channel!r} fits several channels: {listed(matching)}")
    raise ContentError(f"no channel {channel!r}; available: {listed(names)}")


def listed(names: Iterable[str]) -> str:
    """Format names for an error message, at most 20 of them."""
    texts = [repr(name) for name in names]
    return ", ".join(texts[:20]) + (f" and {len(texts) - 20} more" if len(texts) > 20 else "")


def common_length(lengths: Mapping[str, int], names: Sequence[str]) -> int:
    """Return the number of samples of some channels, which must be equally long."""
    own = {name: lengths[name] for name in names}
    if len(set(own.values())) > 1:
        raise ContentError(f"channels of different length, in samples: {own}")
    return own[names[0]]


def slices(n_total: int, n_samples: int | None) -> Iterator[slice]:
    """Yield slices that cover all samples; one empty slice if there is no sample."""
    step = max(n_total if n_samples is None else n_samples, 1)
    return (slice(start, start + step) for start in range(0, max(n_total, 1), step))


def joined_streams(
    streams: Iterable[Iterable[np.ndarray]], n_samples: int
) -> Iterator[list[np.ndarray]]:
    """Yield one block after another of streams that come in pieces of any length."""
    pieces = [_rechunked(stream, n_samples) for stream in streams]
    return (list(block) for block in zip(*pieces, strict=True))


def _rechunked(arrays, n_samples):
    waiting, count = [], 0
    for array in arrays:
        while len(array):
            part = array[: n_samples - count]
            waiting.append(part)
            array, count = array[len(part) :], count + len(part)
            if count == n_samples:
                yield np.concatenate(waiting)
                waiting, count = [], 0
    if count:
        yield np.concatenate(waiting)


def is_numeric(dtype: DTypeLike) -> bool:
    """Return whether an array of this type can be a channel."""
    return np.dtype(dtype).kind in "fiuc"


def check_unpacked(n_packed: int, n_unpacked: int) -> None:
    """Refuse a compressed file that holds more bytes than a recording of its size can.

    Parameters
    ----------
    n_packed, n_unpacked : int
        Bytes of the file, and bytes that it holds.

    Raises
    ------
    ContentError
        If it holds more than 256 MiB and more than 100 times the size of the file.
    """
    if n_unpacked > max(_ALWAYS_ALLOWED, _RATIO * n_packed):
        raise ContentError(
            f"{n_packed} bytes would unpack to {n_unpacked}, which is refused: expected at most "
            f"{_ALWAYS_ALLOWED} bytes or {_RATIO} times the size of the file"
        )
