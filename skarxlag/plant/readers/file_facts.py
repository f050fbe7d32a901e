"""One visit to a file: its facts, its speed, and then its samples."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .formats.contents import ContentError, Contents
from .formats.description import Description, agreed, describe, signal_blocks
from .formats.facts import names_speed
from .speeds import SpeedProfile

Channels = str | int | Sequence[Any] | None
#: Seconds over which a channel of speeds is averaged.
_MEAN_SECONDS = 0.01
#: Samples of a channel of speeds that are read at a time.
_BLOCK = 2**20


class FileFacts(NamedTuple):
    """Facts of a file, which are read before its samples.

    Attributes
    ----------
    channel : str, int, sequence of these, or None
        The chosen channels, as they were stated.
    channels : list of tuple of str
        Name and unit of each of them. The unit is None if the file states none.
    sampling_rate : float or None
        Of the chosen channels, in Hz; None if the file does not state it.
    speed : float, SpeedProfile or None
        See `stated_speed`; None if it was not requested.
    """

    channel: Channels
    channels: list[tuple[str, str | None]]
    sampling_rate: float | None
    speed: float | SpeedProfile | None


def facts_and_samples(
    contents: Contents,
    choices: Sequence[Any],
    n_samples: int | None,
    stated_rate: float | None,
    reads_speed: bool,
) -> Iterator[Any]:
    """Yield the `FileFacts` of a file, then blocks of the chosen channels.

    Parameters
    ----------
    contents : Contents
        Of the file.
    choices : sequence
        Ways to state the channels, as `read_recording` takes them. The first that the
        file has is taken.
    n_samples : int or None
        Samples in a block at most, if the format can be read in parts.
    stated_rate : float or None
        Sampling rate in Hz that the user states. It decides if the file states several,
        and times that state none are compared with it.
    reads_speed : bool
        Whether the facts include the shaft speed.

    Yields
    ------
    FileFacts, then ndarray of float64, shape (n_samples,) or (n_channels, n_samples)
        The facts, and the samples.
    """
    description = describe(contents, stated_rate)
    channel = first_fitting(description, choices)
    speed = None
    if reads_speed:
        speed = stated_speed(contents, description, channel, stated_rate)
    names = description.choose(channel)
    channels = [(name, description.channels[name].unit) for name in names]
    rates = {name: description.sampling_rate(name, stated_rate) for name in names}
    rate = agreed("sampling rates, in Hz", rates)
    yield FileFacts(channel, channels, rate, speed)
    yield from signal_blocks(contents, description, channel, n_samples, stated_rate)


def first_fitting(description: Description, choices: Sequence[Channels]) -> Channels:
    """Return the first way to state channels that a file has, or the last of all."""
    for channel in choices[:-1]:
        with suppress(ContentError):
            description.choose(channel)
            return channel
    return choices[-1]


def speed_alone(
    contents: Contents, channel: Channels, stated_rate: float | None
) -> Iterator[list[Any]]:
    """Yield a list of the shaft speed that a file states, see `stated_speed`."""
    # None would end the replies of another process.
    yield [
        stated_speed(contents, describe(contents, stated_rate), channel, stated_rate)
    ]


def stated_speed(
    contents: Contents,
    description: Description,
    channel: Channels,
    stated_rate: float | None,
) -> float | SpeedProfile | None:
    """Return the shaft speed that a file states.

    A file states it in a number such as ``rpm`` or ``X105RPM``: a variable, an
    attribute or a property. Otherwise, the channel that is called ``rpm`` or has the
    unit rpm is read.

    Parameters
    ----------
    contents : Contents
        Of the file.
    description : Description
        Its facts.
    channel : str, int, sequence of these, or None
        The chosen channels, of which the first counts.
    stated_rate : float or None
        Of the signal in Hz, if the file does not state it.

    Returns
    -------
    float, SpeedProfile or None
        In rev/min; None if the file does not state it. Means over 10 ms of a channel,
        or one mean if its sampling rate is not known.
    """
    names = description.names(channel)
    numbers = {description.channels[name].rpm for name in names} - {None}
    if numbers:
        return numbers.pop() if len(numbers) == 1 else None
    speeds = (
        name
        for name, facts in description.channels.items()
        if names_speed(name, facts.unit)
    )
    name = next(speeds, None)
    if name is None:
        return None
    rate = description.sampling_rate(name)
    if rate is None:
        # Channels of different lengths last equally long.
        lengths = {name: description.channels[name].length or 1 for name in names}
        longest = max(lengths, key=lengths.__getitem__)
        rate = description.sampling_rate(longest, stated_rate) or stated_rate
        if rate is not None:
            rate *= (description.channels[name].length or 1) / lengths[longest]
    n_mean = max(int(_MEAN_SECONDS * (rate or 0)), 1)
    n_samples = n_mean * max(_BLOCK // n_mean, 1)
    blocks = signal_blocks(contents, description, name, n_samples, None)
    rpm = _means(blocks, n_mean)
    if not len(rpm):
        raise ContentError(f"channel {name!r} is shorter than {_MEAN_SECONDS:g} s")
    if rate is None:
        return float(rpm.mean())
    return SpeedProfile((np.arange(len(rpm)) + 0.5) * n_mean / rate, rpm)


def _means(blocks, n_samples) -> NDArray[Any]:
    """Return the means of so many consecutive samples."""
    means = []
    rest = np.empty(0)
    for block in blocks:
        samples = np.concatenate([rest, block])
        n_whole = len(samples) // n_samples * n_samples
        means.append(samples[:n_whole].reshape(-1, n_samples).mean(axis=1))
        # Without the copy, a few samples would keep the whole block in memory.
        rest = samples[n_whole:].copy()
    return np.concatenate(means)
