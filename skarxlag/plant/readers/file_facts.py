"""One visit to a file: its channels, their facts, and then the samples of some of them."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from math import isclose
from numbers import Integral
from typing import Any, NamedTuple

import numpy as np

from .formats.contents import (
    ContentError,
    Contents,
    choose_channels,
    one_rate,
    quoted_names,
)
from .formats.facts import names_speed, names_times
from .formats.times import DRIFT, EvenTimes, find_time_axis
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
        See `FileVisit.speed`; None if it was not requested.
    """

    channel: Channels
    channels: list[tuple[str, str | None]]
    sampling_rate: float | None
    speed: float | SpeedProfile | None


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
        As in `FileVisit`.
    reads_speed : bool
        Whether the facts include the shaft speed.

    Yields
    ------
    FileFacts, then ndarray of float64, shape (n_samples,) or (n_channels, n_samples)
        The facts, and the samples.
    """
    visit = FileVisit(contents, stated_rate)
    channel = choices[-1]
    for choice in choices[:-1]:
        with suppress(ContentError):
            visit.choose(choice)
            channel = choice
            break
    names = visit.choose(channel)
    speed = visit.speed(channel) if reads_speed else None
    channels = [(name, contents.channels[name].unit) for name in names]
    rates = {name: visit.sampling_rate(name) for name in names}
    rate = _agreed("sampling rates, in Hz", rates)
    yield FileFacts(channel, channels, rate, speed)
    is_single = channel is None or isinstance(channel, str | Integral)
    for block in visit.blocks(names, n_samples, rate or stated_rate):
        yield block[0] if is_single else np.stack(block)


def answer(
    contents: Contents, stated_rate: float | None, method: str, *arguments: Any
) -> Iterator[list[Any]]:
    """Yield a list of what a method of `FileVisit` returns."""
    # None would end the replies of another process.
    yield [getattr(FileVisit(contents, stated_rate), method)(*arguments)]


class FileVisit:
    """Facts and samples of an open file.

    Parameters
    ----------
    contents : Contents
        Of the file.
    stated_rate : float or None
        Sampling rate in Hz that the user states. It decides if the file states several,
        and times that state none are compared with it.
    """

    def __init__(self, contents: Contents, stated_rate: float | None = None) -> None:
        self._contents = contents
        self._channels = contents.channels
        self._stated_rate = stated_rate
        self._axis = find_time_axis(contents, stated_rate)

    def choose(self, channel: Channels) -> list[str]:
        """Return the names of the chosen channels, as `read_recording` takes them."""
        self._check_channels()
        refused = self._contents.refused
        if isinstance(channel, str) and channel in refused:
            raise ContentError(refused[channel])
        if channel is None:
            return [self._only_signal()]
        names = choose_channels(list(self._channels), channel)
        if not names:
            raise ContentError(
                f"channel is an empty sequence; available: {quoted_names(self._channels)}"
            )
        return names

    def _check_channels(self):
        """Refuse a file without channels, and give the reason."""
        if not self._channels:
            reason = "holds no numeric array of more than one value"
            raise ContentError(next(iter(self._contents.refused.values()), reason))

    def _only_signal(self):
        signals = list(self._channels)
        if self._axis is not None:
            times = {self._axis.name, *filter(names_times, signals)}
            signals = [name for name in signals if name not in times]
        if len(signals) > 1:
            signals = [name for name in signals if not self._is_speed(name)]
        if len(signals) != 1:
            advice = self._contents.advice
            raise ContentError(
                "several channels and none chosen; available: "
                f"{quoted_names(self._channels)}{advice and f'; {advice}'}"
            )
        return signals[0]

    def _is_speed(self, name):
        return names_speed(name, self._channels[name].unit)

    def _first_or_all(self, channel):
        """Return the name of the first chosen channel, or those of all."""
        names = list(self._channels)
        return names if channel is None else choose_channels(names, channel)[:1]

    def _times_of(self, name):
        """Return the channel of times if it times a channel."""
        axis = self._axis
        return axis if axis and axis.length == self._channels[name].length else None

    def table(self) -> list[tuple[Any, ...]]:
        """Return name, sampling rate, unit and speed of each channel."""
        self._check_channels()
        times = self._axis and self._axis.name
        return [
            (
                name,
                None if name == times else self.sampling_rate(name),
                channel.unit,
                channel.rpm,
            )
            for name, channel in self._channels.items()
        ]

    def sampling_rate(self, name: str) -> float | None:
        """Return the sampling rate of a channel in Hz, None if it is not known."""
        rates = self._channels[name].rates
        stated = self._stated_rate
        axis = self._times_of(name)
        if axis is not None:
            by_times = axis.sampling_rate
            if not any(_is_near(by_times, rate, DRIFT) for rate in rates.values()):
                rates = rates | {f"the times {axis.name!r}": by_times}
        return one_rate(rates, stated)

    def start(self, channel: Channels) -> float | None:
        """Return the date of the first sample in seconds since 1970, None if it is not known.

        Of several channels, the first counts; None takes any that has a date.
        """
        for name in self._first_or_all(channel):
            axis = self._times_of(name)
            start = self._channels[name].start
            if start is None and axis is not None:
                start = axis.start
            if start is not None:
                return start
        return None

    def speed(self, channel: Channels) -> float | SpeedProfile | None:
        """Return the shaft speed that a file states.

        A file states it in a number such as ``rpm`` or ``X105RPM``: a variable, an
        attribute or a property. Otherwise, the channel that is called ``rpm`` or has
        the unit rpm is read.

        Parameters
        ----------
        channel : str, int, sequence of these, or None
            The chosen channels, of which the first counts.

        Returns
        -------
        float, SpeedProfile or None
            In rev/min; None if the file does not state it. Means over 10 ms of a
            channel, or one mean if its sampling rate is not known.
        """
        channels = self._channels
        names = self._first_or_all(channel)
        numbers = {channels[name].rpm for name in names} - {None}
        if numbers:
            return numbers.pop() if len(numbers) == 1 else None
        name = next(filter(self._is_speed, channels), None)
        if name is None:
            return None
        rate = FileVisit(self._contents).sampling_rate(name)
        if rate is None:
            # Channels of different lengths last equally long.
            longest = max(names, key=lambda name: channels[name].length or 1)
            rate = self.sampling_rate(longest) or self._stated_rate
            if rate is not None:
                rate *= (channels[name].length or 1) / (channels[longest].length or 1)
        n_mean = max(int(_MEAN_SECONDS * (rate or 0)), 1)
        blocks = [block for (block,) in self.blocks([name], _BLOCK, rate)]
        samples = np.concatenate(blocks)
        n_whole = len(samples) // n_mean * n_mean
        rpm = samples[:n_whole].reshape(-1, n_mean).mean(axis=1)
        if not len(rpm):
            raise ContentError(f"channel {name!r} is shorter than {_MEAN_SECONDS:g} s")
        if rate is None:
            return float(rpm.mean())
        return SpeedProfile((np.arange(len(rpm)) + 0.5) * n_mean / rate, rpm)

    def blocks(
        self, names: list[str], n_samples: int | None, rate: float | None
    ) -> Iterator[list[Any]]:
        """Yield the signals of channels, block by block, and check their times at a rate."""
        lengths = {name: self._channels[name].length for name in names}
        _agreed("lengths, in samples", lengths)
        axis = self._times_of(names[0])
        times = None
        read_names = names
        # Times in another unit than the rate show no gaps.
        if axis and _is_near(axis.sampling_rate, rate, DRIFT):
            times = EvenTimes(axis, rate)
            read_names = list(dict.fromkeys([*names, axis.name]))
        start = 0
        for block in self._contents.read(read_names, n_samples):
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


def _is_near(value, other, tolerance):
    return other is not None and isclose(value, other, rel_tol=tolerance)


def _agreed(what, values):
    """Return the value that all channels have, None if there is none."""
    values = {name: value for name, value in values.items() if value is not None}
    if len(set(values.values())) > 1:
        stated = ", ".join(f"{name} {value:g}" for name, value in values.items())
        raise ContentError(f"the chosen channels have different {what}: {stated}")
    return next(iter(values.values()), None)


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
