"""From the channels of a file to the signal that was asked for, block after block."""

from collections.abc import Iterator, Sequence
from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._contents import ContentError, Contents, choose_channel, listed
from ._facts import find_time_axis, names_speed


def signal_blocks(
    contents: Contents, channel: str | int | Sequence[Any] | None, n_samples: int | None
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

    Yields
    ------
    signal : ndarray of float64, shape (n_samples,) or (n_channels, n_samples)
        The next samples.
    sampling_rate : float or None
        In Hz, if the file states it.
    """
    if not contents.channels:
        reasons = list(contents.refused.values())
        raise ContentError((reasons or ["holds no numeric array of more than one value"])[0])
    axis = find_time_axis(contents)
    names, is_single = _chosen_names(contents, channel, axis)
    rate = _common_rate(names, contents.sampling_rates)
    is_timed = rate is None and axis is not None and axis.covers(contents, names)
    if is_timed:
        rate = axis.sampling_rate
    read_names = list(dict.fromkeys([*names, axis.name] if is_timed else names))
    start, is_read = 0, False
    for block in contents.read(read_names, n_samples):
        is_read = True
        by_name = dict(zip(read_names, block, strict=True))
        signals = [_as_signal(name, by_name[name], start) for name in names]
        if is_timed:
            axis.check(by_name[axis.name], start)
        yield signals[0] if is_single else np.stack(signals), rate
        start += len(signals[0])
    if not is_read:
        raise ContentError(f"channel {names[0]!r} is empty")


def describe_channels(contents: Contents) -> list[dict[str, Any]]:
    """Return name, sampling rate, unit, shaft speed and date of the start of every channel."""
    axis = find_time_axis(contents)
    rows = []
    for name in contents.channels:
        rate, start = contents.sampling_rates.get(name), contents.starts.get(name)
        if axis is not None and axis.covers(contents, [name]):
            rate = axis.sampling_rate if rate is None else rate
            start = axis.start if start is None else start
        unit, rpm = contents.units.get(name), contents.speeds.get(name)
        row = {"channel": name, "sampling_rate": rate, "unit": unit, "rpm": rpm, "start": start}
        rows.append(row)
    return rows


def _chosen_names(contents, channel, axis):
    if isinstance(channel, str) and channel in contents.refused:
        raise ContentError(contents.refused[channel])
    names = list(contents.channels)
    if channel is None:
        signals = [name for name in names if axis is None or name != axis.name]
        if len(signals) > 1:
            units = contents.units
            signals = [name for name in signals if not names_speed(name, units.get(name))]
        if len(signals) != 1:
            raise ContentError(f"several channels and none chosen; available: {listed(names)}")
        return signals, True
    if isinstance(channel, str | Integral):
        return [choose_channel(names, channel)], True
    chosen = [choose_channel(names, each) for each in channel]
    if not chosen:
        raise ContentError(f"channel is an empty sequence; available: {listed(names)}")
    return chosen, False


def _common_rate(names, rates):
    stated = {name: rates[name] for name in names if name in rates}
    if len(set(stated.values())) > 1:
        raise ContentError(f"channels of different sampling rates, in Hz: {stated}")
    return next(iter(stated.values()), None)


def _as_signal(name, values, start):
    where = f"channel {name!r}"
    if not isinstance(values, np.ndarray):
        values = _from_column(where, values, start)
    if values.dtype.kind not in "fiuc":
        raise ContentError(f"{where} is not numeric but of type {values.dtype}")
    if values.dtype.kind == "c":
        raise ContentError(f"{where} is complex; store its real part or its magnitude")
    with np.errstate(invalid="ignore"):
        signal = np.array(values, dtype=np.float64)
    if signal.size == 0 and start == 0:
        raise ContentError(f"{where} is empty")
    bad = np.flatnonzero(~np.isfinite(signal))
    if bad.size:
        raise ContentError(
            f"{where} has missing, NaN or infinite values, the first at sample {start + bad[0]}"
        )
    return signal


def _from_column(where, values, start):
    """Array of a column of a table; a column of text is refused with its first such field."""
    import pandas as pd
    from pandas.api.types import is_bool_dtype, is_complex_dtype, is_numeric_dtype

    if is_complex_dtype(values.dtype):
        return values.to_numpy()
    if is_numeric_dtype(values.dtype) and not is_bool_dtype(values.dtype):
        return values.to_numpy(dtype=np.float64, na_value=np.nan)
    bad = np.flatnonzero(pd.to_numeric(values, errors="coerce").isna() & values.notna())
    at = f": {values.iloc[bad[0]]!r} at sample {start + bad[0]}" if bad.size else ""
    raise ContentError(f"{where} is not numeric{at}")
