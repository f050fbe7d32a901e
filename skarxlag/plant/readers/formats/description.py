"""Description of one file: its channels, their selection, their rate, and their samples."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import isclose
from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .contents import (
    Channel,
    ContentError,
    Contents,
    choose_channels,
    listed,
    one_rate,
)
from .facts import RATE_TOLERANCE, names_speed, names_times
from .times import DRIFT, EvenTimes, TimeAxis, find_time_axis


@dataclass(frozen=True)
class Description:
    """Facts of a file, without its samples.

    Attributes
    ----------
    channels : dict of str to Channel
        By name, in the order of the file, with the facts that the file states of them.
    axis : TimeAxis or None
        Channel of times.
    refused : dict of str to str
        Arrays that are not channels, and the reason.
    advice : str
        Advice for a user who has to choose a channel, else empty.
    """

    channels: dict[str, Channel]
    axis: TimeAxis | None
    refused: dict[str, str]
    advice: str

    def check_channels(self) -> None:
        """Refuse a file without channels, and give the reason."""
        if not self.channels:
            reason = "holds no numeric array of more than one value"
            raise ContentError(next(iter(self.refused.values()), reason))

    def choose(self, channel: Any) -> list[str]:
        """Return the names of the chosen channels, as `read_recording` takes them."""
        self.check_channels()
        if channel is None:
            return [self._only_signal()]
        if isinstance(channel, str) and channel in self.refused:
            raise ContentError(self.refused[channel])
        names = choose_channels(list(self.channels), channel)
        if not names:
            raise ContentError(
                f"channel is an empty sequence; available: {listed(self.channels)}"
            )
        return names

    def _only_signal(self):
        signals = [
            name
            for name in self.channels
            if self.axis is None or not (name == self.axis.name or names_times(name))
        ]
        if len(signals) > 1:
            signals = [
                name
                for name in signals
                if not names_speed(name, self.channels[name].unit)
            ]
        if len(signals) != 1:
            advice = f"; {self.advice}" if self.advice else ""
            raise ContentError(
                "several channels and none chosen; available: "
                f"{listed(self.channels)}{advice}"
            )
        return signals[0]

    def names(self, channel: Any = None) -> list[str]:
        """Return the name of the first chosen channel, or those of all."""
        names = list(self.channels)
        return names if channel is None else choose_channels(names, channel)[:1]

    def times_of(self, names: list[str]) -> TimeAxis | None:
        """Return the channel of times if one of the chosen channels is timed by it."""
        lengths = {self.channels[name].length for name in names}
        is_timed = self.axis is not None and self.axis.length in lengths
        return self.axis if is_timed else None

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
        axis = self.times_of([name])
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
        axis = self.times_of([name])
        start = self.channels[name].start
        return axis.start if axis is not None and start is None else start


def describe(contents: Contents, stated_rate: float | None = None) -> Description:
    """Return what a file states, after a look at its first times."""
    axis = find_time_axis(contents, stated_rate)
    return Description(contents.channels, axis, contents.refused, contents.advice)


def agreed(what: str, values: dict[str, Any]) -> Any:
    """Return the value that all channels have, None if there is none."""
    values = {name: value for name, value in values.items() if value is not None}
    if len(set(values.values())) > 1:
        stated = ", ".join(f"{name} {value:g}" for name, value in values.items())
        raise ContentError(f"the chosen channels have different {what}: {stated}")
    return next(iter(values.values()), None)


def is_single(channel: Any) -> bool:
    """Return whether a choice is one channel, which is read as one dimension."""
    return channel is None or isinstance(channel, str | Integral)


def _is_near(value, other, tolerance):
    return other is not None and isclose(value, other, rel_tol=tolerance)


def descriptions(contents: Contents) -> Iterator[Description]:
    """Yield what a file states."""
    yield describe(contents)


def signal_blocks(
    contents: Contents,
    description: Description,
    channel: Any,
    n_samples: int | None,
    stated_rate: float | None,
) -> Iterator[NDArray[Any]]:
    """Yield blocks of the chosen channels.

    Parameters
    ----------
    contents : Contents
        Of the file.
    description : Description
        Its facts.
    channel : object
        As in `read_recording`.
    n_samples : int or None
        Samples in a block at most, if the format can be read in parts.
    stated_rate : float or None
        Sampling rate in Hz that the user states. It decides if the file states several,
        and times that state none are compared with it.

    Yields
    ------
    ndarray of float64, shape (n_samples,) or (n_channels, n_samples)
        The next samples.
    """
    names = description.choose(channel)
    lengths = {name: description.channels[name].length for name in names}
    agreed("lengths, in samples", lengths)
    rates = {name: description.sampling_rate(name, stated_rate) for name in names}
    rate = agreed("sampling rates, in Hz", rates) or stated_rate
    axis = description.times_of(names)
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
        yield signals[0] if is_single(channel) else np.stack(signals)
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
