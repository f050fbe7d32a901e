"""One visit to a file: its channels, their facts, and then the samples of some of them."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import isclose
from numbers import Integral
from typing import Any, NamedTuple

import numpy as np

from .formats.contents import (
    Channel,
    ContentError,
    Contents,
    choose_channels,
    listed,
    one_rate,
)
from .formats.facts import RATE_TOLERANCE, names_speed, names_times
from .formats.times import DRIFT, EvenTimes, TimeAxis, find_time_axis
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


@dataclass(frozen=True)
class Description:
    """Channels of a file, and what it states about them, without its samples.

    Attributes
    ----------
    channels, refused, advice
        As in `Contents`.
    axis : TimeAxis or None
        Channel of times.
    """

    channels: dict[str, Channel]
    refused: dict[str, str]
    advice: str
    axis: TimeAxis | None

    def choose(self, channel: Channels) -> list[str]:
        """Return the names of the chosen channels, as `read_recording` takes them."""
        self.check_channels()
        if isinstance(channel, str) and channel in self.refused:
            raise ContentError(self.refused[channel])
        if channel is None:
            return [self._only_signal()]
        names = choose_channels(list(self.channels), channel)
        if not names:
            raise ContentError(
                f"channel is an empty sequence; available: {listed(self.channels)}"
            )
        return names

    def check_channels(self) -> None:
        """Refuse a file without channels, and give the reason."""
        if not self.channels:
            reason = "holds no numeric array of more than one value"
            raise ContentError(next(iter(self.refused.values()), reason))

    def _only_signal(self):
        channels = self.channels
        signals = list(channels)
        if self.axis is not None:
            times = {self.axis.name, *filter(names_times, signals)}
            signals = [name for name in signals if name not in times]
        if len(signals) > 1:
            signals = [
                name for name in signals if not names_speed(name, channels[name].unit)
            ]
        if len(signals) != 1:
            raise ContentError(
                "several channels and none chosen; available: "
                f"{listed(channels)}{self.advice and f'; {self.advice}'}"
            )
        return signals[0]

    def names(self, channel: Channels = None) -> list[str]:
        """Return the name of the first chosen channel, or those of all."""
        names = list(self.channels)
        return names if channel is None else choose_channels(names, channel)[:1]

    def times_of(self, name: str) -> TimeAxis | None:
        """Return the channel of times if it times a channel."""
        length = self.channels[name].length
        return self.axis if self.axis and self.axis.length == length else None

    def sampling_rate(self, name: str, stated: float | None = None) -> float | None:
        """Return the sampling rate of a channel in Hz, None if it is not known.

        Parameters
        ----------
        name : str
            The channel.
        stated : float or None
            Rate that the user states. It decides if the file states several.
        """
        rates = self.channels[name].rates
        axis = self.times_of(name)
        if axis is not None:
            by_times = axis.sampling_rate
            if axis.problem and not _is_near(by_times, stated, DRIFT):
                raise ContentError(axis.problem)
            if not any(_is_near(by_times, rate, DRIFT) for rate in rates.values()):
                tolerance = DRIFT if axis.problem else RATE_TOLERANCE
                is_stated = _is_near(by_times, stated, tolerance)
                by_times = stated if is_stated else by_times
                rates = rates | {f"the times {axis.name!r}": by_times}
        return one_rate(rates, stated)

    def start(self, name: str) -> float | None:
        """Return the date of the first sample in seconds since 1970, None if it is not known."""
        axis = self.times_of(name)
        start = self.channels[name].start
        return axis.start if axis is not None and start is None else start


def _is_near(value, other, tolerance):
    return other is not None and isclose(value, other, rel_tol=tolerance)


def described(
    contents: Contents,
    channel: Channels = None,
    stated_rate: float | None = None,
    reads_speed: bool = False,
) -> Iterator[tuple[Description, float | SpeedProfile | None]]:
    """Yield what a file states, and its shaft speed if it is requested."""
    description = _describe(contents, stated_rate)
    speed = None
    if reads_speed:
        speed = stated_speed(contents, description, channel, stated_rate)
    yield description, speed


def _describe(contents, stated_rate):
    axis = find_time_axis(contents, stated_rate)
    return Description(contents.channels, contents.refused, contents.advice, axis)


def facts_and_samples(
    contents: Contents,
    choices: Sequence[Channels],
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
    description = _describe(contents, stated_rate)
    channel = _first_fitting(description, choices)
    names = description.choose(channel)
    speed = None
    if reads_speed:
        speed = stated_speed(contents, description, channel, stated_rate)
    channels = [(name, contents.channels[name].unit) for name in names]
    rates = {name: description.sampling_rate(name, stated_rate) for name in names}
    rate = _agreed("sampling rates, in Hz", rates)
    yield FileFacts(channel, channels, rate, speed)
    is_single = channel is None or isinstance(channel, str | Integral)
    for block in _blocks(contents, description, names, n_samples, rate or stated_rate):
        yield block[0] if is_single else np.stack(block)


def _first_fitting(description, choices):
    """Return the first way to state channels that a file has, or the last of all."""
    for channel in choices[:-1]:
        with suppress(ContentError):
            description.choose(channel)
            return channel
    return choices[-1]


def _agreed(what, values):
    """Return the value that all channels have, None if there is none."""
    values = {name: value for name, value in values.items() if value is not None}
    if len(set(values.values())) > 1:
        stated = ", ".join(f"{name} {value:g}" for name, value in values.items())
        raise ContentError(f"the chosen channels have different {what}: {stated}")
    return next(iter(values.values()), None)


def _blocks(contents, description, names, n_samples, rate):
    """Yield the signals of channels, block by block, and check their times at a rate."""
    lengths = {name: contents.channels[name].length for name in names}
    _agreed("lengths, in samples", lengths)
    axis = description.times_of(names[0])
    times = None
    read_names = names
    # Times in another unit than the rate show no gaps.
    if axis and not axis.problem and _is_near(axis.sampling_rate, rate, DRIFT):
        times = EvenTimes(axis, rate)
        read_names = list(dict.fromkeys([*names, axis.name]))
    start = 0
    for block in contents.read(read_names, n_samples):
        if not len(block[0]):
            continue
        values = dict(zip(read_names, block, strict=True))
        signals = [_as_signal(name, values[name], start) for name in names]
        if times is not None:
            times.check(values[axis.name])
        yield signals
        start += len(signals[0])
    if start == 0:
        raise ContentError(f"channel {names[0]!r} is empty")


def _as_signal(name, values, start):
    if values.dtype == object:
        import pandas as pd

        is_text = np.isnan(pd.to_numeric(values, errors="coerce")) & ~pd.isna(values)
        i = np.argmax(is_text)
        raise ContentError(
            f"channel {name!r} is not numeric: {values[i]!r:.80} at sample {start + i}"
        )
    if values.dtype.kind not in "fiu":
        raise ContentError(
            f"channel {name!r} is of type {values.dtype}, expected real numbers"
        )
    with np.errstate(invalid="ignore"):
        signal = np.array(values, dtype=np.float64)
    bad = np.flatnonzero(~np.isfinite(signal))
    if bad.size:
        raise ContentError(
            f"channel {name!r} has missing, NaN or infinite values, the first at "
            f"sample {start + bad[0]}"
        )
    return signal


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
    channels = contents.channels
    names = description.names(channel)
    numbers = {channels[name].rpm for name in names} - {None}
    if numbers:
        return numbers.pop() if len(numbers) == 1 else None
    speeds = (name for name in channels if names_speed(name, channels[name].unit))
    name = next(speeds, None)
    if name is None:
        return None
    rate = description.sampling_rate(name)
    if rate is None:
        # Channels of different lengths last equally long.
        longest = max(names, key=lambda name: channels[name].length or 1)
        rate = description.sampling_rate(longest, stated_rate) or stated_rate
        if rate is not None:
            rate *= (channels[name].length or 1) / (channels[longest].length or 1)
    n_mean = max(int(_MEAN_SECONDS * (rate or 0)), 1)
    n_samples = n_mean * max(_BLOCK // n_mean, 1)
    means = []
    rest = np.empty(0)
    for (block,) in _blocks(contents, description, [name], n_samples, rate):
        samples = np.concatenate([rest, block])
        n_whole = len(samples) // n_mean * n_mean
        means.append(samples[:n_whole].reshape(-1, n_mean).mean(axis=1))
        # Without the copy, a few samples would keep the whole block in memory.
        rest = samples[n_whole:].copy()
    rpm = np.concatenate(means)
    if not len(rpm):
        raise ContentError(f"channel {name!r} is shorter than {_MEAN_SECONDS:g} s")
    if rate is None:
        return float(rpm.mean())
    return SpeedProfile((np.arange(len(rpm)) + 0.5) * n_mean / rate, rpm)
