"""Read the chosen channels of a file block by block."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._contents import ContentError, Contents
from ._description import Description, agreed, describe, is_single, is_usable
from ._time_axis import EvenTimes


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
    channel : str, int, sequence of these, or None
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
    rate = description.sampling_rate(names, stated_rate)
    axis = description.times_of(names)
    times = None
    read_names = names
    if axis is not None and is_usable(axis, rate) and (rate or stated_rate):
        times = EvenTimes(axis, rate or stated_rate)
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
