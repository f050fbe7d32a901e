"""What every reader gives: the channels of a file, and what the file states about them."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import DTypeLike


class ContentError(ValueError):
    """A file that can be read but does not hold what is asked for; it is not damaged."""


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
        stands for one block of everything. Formats that can only be read whole ignore `n_samples`.
    sampling_rates : mapping of str to float
        In Hz, by channel, where the file states it.
    units : mapping of str to str
        By channel, where the file states it.
    starts : mapping of str to float
        Seconds since 1970 at the first sample, by channel, where the file states a date.
    lengths : mapping of str to int, or None
        Samples in each channel. None where all are equally long.
    refused : mapping of str to str
        Arrays that are no channels, such as square matrices, and why.
    """

    channels: Sequence[str]
    read: Callable[[list[str], int | None], Iterator[list[Any]]]
    sampling_rates: Mapping[str, float] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    lengths: Mapping[str, int] | None = None
    refused: Mapping[str, str] = field(default_factory=dict)
    starts: Mapping[str, float] = field(default_factory=dict)


class ArrayChannel:
    """One row or column of an array that may lie on disk (NumPy, HDF5)."""

    def __init__(self, array: Any, index: Any) -> None:
        self.array, self.index = array, index

    def __len__(self) -> Any:
        return self.array.shape[self.index.index(None)]

    def __getitem__(self, part: Any) -> Any:
        return self.array[tuple(part if i is None else i for i in self.index)]


def array_channels(name: str, array: Any) -> dict[str, Any]:
    """Channels of one array: its rows or its columns, whichever are longer.

    Parameters
    ----------
    name : str
        Name of the array. The channels of a matrix are ``name[0]``, ``name[1]``, ...; without a
        name they are ``0``, ``1``, ...
    array : array-like with `shape`
        With one dimension or more.

    Returns
    -------
    dict of str to ArrayChannel
    """
    shape = array.shape
    long = [axis for axis, size in enumerate(shape) if size != 1]
    if len(long) > 2 or (len(long) == 2 and shape[long[0]] == shape[long[1]]):
        raise ContentError(
            f"array {name!r} of shape {shape}: expected a vector, or a matrix that is longer in "
            "time than in channels"
        )
    index: list[int | None] = [0] * len(shape)
    if len(long) < 2 or 0 in shape:
        index[shape.index(0) if 0 in shape else max(long, default=0)] = None
        return {name or "0": ArrayChannel(array, index)}
    time, across = sorted(long, key=lambda axis: -shape[axis])
    index[time] = None
    channels = {}
    for i in range(shape[across]):
        index[across] = i
        channels[f"{name}[{i}]" if name else str(i)] = ArrayChannel(array, list(index))
    return channels


def channels_or_refusal(name: str, array: Any, refused: dict[str, str]) -> dict[str, ArrayChannel]:
    """The channels of an array; of one that has none, the reason is put into `refused`."""
    try:
        return array_channels(name, array)
    except ContentError as error:
        refused[name] = str(error)
        return {}


def array_blocks(
    channels: Mapping[str, Any], names: Sequence[str], n_samples: int | None
) -> Iterator[list[Any]]:
    """Blocks of some of the channels, each of which has a length and can be sliced."""
    n_total = common_length({name: len(channels[name]) for name in names}, names)
    for part in slices(n_total, n_samples):
        yield [channels[name][part] for name in names]


def common_length(lengths: Mapping[str, int], names: Sequence[str]) -> int:
    """Samples in each of the channels, which must be equally many."""
    own = {name: lengths[name] for name in names}
    if len(set(own.values())) > 1:
        raise ContentError(f"channels of different length, in samples: {own}")
    return own[names[0]]


def rechunked(arrays: Iterable[np.ndarray], n_samples: int) -> Iterator[np.ndarray]:
    """Join arrays and cut them anew, into pieces of equal length and a rest."""
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


def array_contents(
    channels: dict[str, Any], scalars: dict[str, float], refused: dict[str, str] | None = None
) -> Contents:
    """Contents of arrays in memory, with the sampling rate among the single numbers beside them.

    Parameters
    ----------
    channels : dict of str to ArrayChannel
        The channels by name.
    scalars : dict of str to float
        Single numbers by name. A name such as ``fs`` or ``run.SampleRate`` states the rate of the
        channels in the same place.
    refused : dict of str to str, default=None
        As in :class:`Contents`. None stands for no such array.
    """
    lengths = {name: len(channel) for name, channel in channels.items()}
    return Contents(
        list(channels),
        lambda names, n_samples: array_blocks(channels, names, n_samples),
        sampling_rates=stated_rates(lengths, scalars),
        lengths=lengths,
        refused=refused or {},
    )


def slices(n_total: int, n_samples: int | None) -> Iterator[slice]:
    """Slices that cover all samples; one empty slice where there is no sample."""
    step = max(n_total if n_samples is None else n_samples, 1)
    return (slice(start, start + step) for start in range(0, max(n_total, 1), step))


def is_numeric(dtype: DTypeLike) -> bool:
    """Whether an array of this type can be a channel."""
    return np.dtype(dtype).kind in "fiuc"


#: How files name the sampling rate, in lower case and without anything but letters.
_RATE_NAMES = {
    name + unit
    for unit in ("", "hz", "inhz")
    for name in (
        "fs",
        "sr",
        "fsample",
        "fsampling",
        "samplerate",
        "samplingrate",
        "samplefreq",
        "samplingfreq",
        "samplefrequency",
        "samplingfrequency",
    )
}


def letters(name: str) -> str:
    """A name without case, spaces, digits, units in brackets and signs."""
    return "".join(c for c in name.partition("(")[0].partition("[")[0].lower() if c.isalpha())


def stated_rates(
    lengths: dict[str, int], scalars: dict[str, float], separator: str = "."
) -> dict[str, float]:
    """Sampling rate of each channel, by the number beside it whose name is that of a rate.

    Names are paths such as ``run.signal`` and ``run.fs``. The number nearest to the channel on the
    way up to the root counts. It is the rate of the longest of the channels that it could belong
    to; shorter ones, such as a speed beside a vibration, have been sampled more slowly.

    Parameters
    ----------
    lengths : dict of str to int
        Samples in each channel.
    scalars : dict of str to float
        Single numbers by name.
    separator : str, default="."
        Between the parts of a name.

    Examples
    --------
    >>> stated_rates({"a.y": 5, "z": 9, "u": 7}, {"fs": 10.0, "a.SampleRate": 20.0, "a.load": 3.0})
    {'a.y': 20.0, 'z': 10.0}
    """
    by_place = {}
    for name, value in scalars.items():
        place, _, last = name.rpartition(separator)
        if letters(last.replace("(", "").replace("[", "")) in _RATE_NAMES and is_rate(value):
            by_place.setdefault(place, set()).add(float(value))
    found = {}
    for name in lengths:
        place = name
        while place:
            place = place.rpartition(separator)[0]
            # Two numbers that disagree state nothing.
            if len(by_place.get(place, ())) == 1:
                found[name] = place
                break
    longest = {}
    for name, place in found.items():
        longest[place] = max(longest.get(place, 0), lengths[name])
    return {
        name: next(iter(by_place[place]))
        for name, place in found.items()
        if lengths[name] == longest[place]
    }


def is_rate(value: Any) -> bool:
    """Whether a number can be a sampling rate."""
    return bool(np.isrealobj(value) and np.isfinite(value) and value > 0)


def rounded(value: float, tolerance: float) -> float:
    """The number of fewest digits within a relative tolerance.

    Examples
    --------
    >>> rounded(51199.87, 5e-6), rounded(97656.25, 1e-9)
    (51200.0, 97656.25)
    """
    digits = (float(f"{value:.{n}g}") for n in range(1, 18))
    return next(each for each in digits if abs(each - value) <= tolerance * value)
