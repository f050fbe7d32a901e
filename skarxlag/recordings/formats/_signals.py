"""Read the chosen channels of a file block by block."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._clock import DRIFT
from ._contents import ContentError, Contents, choose_channels, listed
from ._facts import RATE_TOLERANCE, names_speed, names_times
from ._time_axis import find_time_axis


def signal_blocks(
    contents: Contents,
    channel: str | int | Sequence[Any] | None,
    n_samples: int | None,
    stated_rate: float | None = None,
) -> Iterator[tuple[NDArray[Any], float | None]]:
    """Yield blocks of the chosen channels as floating-point numbers.

    Parameters
    ----------
    contents : Contents
        Of the file.
    channel : str, int, sequence of these, or None
        As in `read_recording`.
    n_samples : int or None
        Samples in a block at most, if the format can be read in parts.
    stated_rate : float or None
        Sampling rate in Hz that the user states. It decides if the file states several,
        and times that state none are compared with it.

    Yields
    ------
    signal : ndarray of float64, shape (n_samples,) or (n_channels, n_samples)
        The next samples.
    sampling_rate : float or None
        In Hz, if the file states it.
    """
    if not contents.channels:
        reasons = [
            *contents.refused.values(),
            "holds no numeric array of more than one value",
        ]
        raise ContentError(reasons[0])
    axis = find_time_axis(contents)
    names, is_single = _chosen_names(contents, channel, axis)
    chosen = {name: contents.channels[name] for name in names}
    _agreed("length, in samples", {name: each.length for name, each in chosen.items()})
    rate = _stated_by_file(chosen, stated_rate)
    is_timed = axis is not None and any(
        each is axis.channel or axis.covers(each) for each in chosen.values()
    )
    if is_timed:
        rate = _agreed_with_times(rate, axis, stated_rate)
        # Times of another rate have a unit that is not known, and show no gaps.
        is_usable = axis.sampling_rate is None or _is_near(
            axis.sampling_rate, rate, DRIFT
        )
        axis.begin((rate or stated_rate) if is_usable else None)
        chosen.setdefault(axis.name, axis.channel)
    start = 0
    for block in contents.read(list(chosen), n_samples):
        if not len(block[0]):
            continue
        by_name = dict(zip(chosen, block, strict=True))
        signals = [_as_signal(name, by_name[name], start) for name in names]
        if is_timed:
            axis.check(by_name[axis.name], start)
        yield signals[0] if is_single else np.stack(signals), rate
        start += len(signals[0])
    if start == 0:
        raise ContentError(f"channel {names[0]!r} is empty")


def describe_chosen(
    contents: Contents, channel: Any
) -> Iterator[tuple[str, str | None]]:
    """Yield name and unit of the channels that `signal_blocks` reads, in their order."""
    axis = find_time_axis(contents) if channel is None else None
    for name in _chosen_names(contents, channel, axis)[0]:
        yield name, contents.channels[name].unit


def describe_channels(
    contents: Contents, channel: Any = None
) -> Iterator[dict[str, Any]]:
    """Yield the facts of every channel, and whether it is chosen first; None chooses all."""
    axis, names = find_time_axis(contents), list(contents.channels)
    if channel is not None:
        names = choose_channels(names, channel)[:1]
    for name, found in contents.channels.items():
        row = {"channel": name, "is_chosen": name in names} | asdict(found)
        if axis is not None and axis.covers(found):
            row["sampling_rate"] = found.sampling_rate or axis.sampling_rate
            row["start"] = axis.start if found.start is None else found.start
        yield row


def _stated_by_file(chosen, stated_rate):
    """Return the sampling rate that numbers in the file state, None if there is none."""
    rates = {
        name: each.sampling_rate for name, each in chosen.items() if each.sampling_rate
    }
    for each in chosen.values():
        several = each.contradiction
        is_decided = any(
            _is_near(r, stated_rate, RATE_TOLERANCE) for r in several.values()
        )
        if several and not is_decided:
            found = ", ".join(f"{name} {rate:g} Hz" for name, rate in several.items())
            expected = "expected one, or --sampling-rate to state which is right"
            raise ContentError(f"states several sampling rates: {found}; {expected}")
    return _agreed("sampling rates, in Hz", rates)


def _agreed_with_times(rate, axis, stated_rate):
    """Return the sampling rate by numbers and times in the file, of which the user may choose."""
    by_times = axis.sampling_rate
    if rate is None or by_times is None:
        return by_times if rate is None else rate
    if _is_near(rate, by_times, DRIFT) or _is_near(rate, stated_rate, RATE_TOLERANCE):
        return rate
    if _is_near(by_times, stated_rate, RATE_TOLERANCE):
        return by_times
    found = f"{rate:g} Hz, but its times {axis.name!r} state {by_times:g} Hz"
    expected = "expected one, or --sampling-rate to state which is right"
    raise ContentError(f"the sampling rate is {found}; {expected}")


def _is_near(value, other, tolerance):
    return other is not None and abs(value - other) <= tolerance * max(value, other)


def _agreed(what, values):
    if len(set(values.values())) > 1:
        raise ContentError(f"channels of different {what}: {values}")
    return next(iter(values.values()), None)


def _chosen_names(contents, channel, axis):
    if isinstance(channel, str) and channel in contents.refused:
        raise ContentError(contents.refused[channel])
    names = list(contents.channels)
    if channel is not None:
        chosen = choose_channels(names, channel)
        if not chosen:
            raise ContentError(
                f"channel is an empty sequence; available: {listed(names)}"
            )
        return chosen, isinstance(channel, str | Integral)
    signals = [name for name in names if axis is None or not names_times(name)]
    if len(signals) > 1:
        signals = [
            name
            for name in signals
            if not names_speed(name, contents.channels[name].unit)
        ]
    if len(signals) != 1:
        advice = f"; {contents.advice}" if contents.advice else ""
        problem = f"several channels and none chosen; available: {listed(names)}"
        raise ContentError(f"{problem}{advice}")
    return signals, True


def _as_signal(name, values, start):
    where = f"channel {name!r}"
    if values.dtype == object:
        import pandas as pd

        is_text = np.isnan(pd.to_numeric(values, errors="coerce")) & ~pd.isna(values)
        i = np.argmax(is_text)
        raise ContentError(
            f"{where} is not numeric: {values[i]!r:.80} at sample {start + i}"
        )
    if values.dtype.kind not in "fiu":
        raise ContentError(f"{where} is of type {values.dtype}, expected real numbers")
    with np.errstate(invalid="ignore"):
        signal = np.array(values, dtype=np.float64)
    bad = np.flatnonzero(~np.isfinite(signal))
    if bad.size:
        first = f"the first at sample {start + bad[0]}"
        raise ContentError(f"{where} has missing, NaN or infinite values, {first}")
    return signal
