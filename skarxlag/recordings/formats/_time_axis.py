"""The sampling rate that a channel of times states."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ._contents import ContentError, Contents, letters, rounded

_NAMES = ("time", "times", "t", "zeit", "seconds", "sec", "timestamp", "timestamps")
SECONDS = {
    "s": 1.0,
    "sec": 1.0,
    "second": 1.0,
    "seconds": 1.0,
    "ms": 1e-3,
    "us": 1e-6,
    "µs": 1e-6,
    "μs": 1e-6,
    "ns": 1e-9,
}
#: Samples from which the rate is told.
_N_PROBED = 10_000


class TimeAxis:
    """A channel of evenly spaced times.

    Attributes
    ----------
    sampling_rate : float
        In Hz.
    start : float or None
        Seconds since 1970 at the first sample; None where the times are no dates.
    """

    sampling_rate: Any
    start: float | None

    def __init__(self, name: Any, unit: Any, times: Any, has_dates: bool) -> None:
        self.name, self._unit, self._last = name, unit, None
        self.start = float(times[0]) if has_dates else None
        steps = np.diff(times)
        self._step = (times[-1] - times[0]) / (len(times) - 1)
        # Where times are rounded to more than a step, some of them are equal.
        smallest = steps[steps > 0].min()
        self._largest = max(1.6 * self._step, 1.5 * smallest)
        self.sampling_rate = rounded(1 / self._step, 1e-5)

    def covers(self, contents: Contents, names: Sequence[str]) -> bool:
        """Whether the times belong to all of the channels."""
        lengths = contents.lengths
        if self.name in names and len(names) == 1:
            return False
        return lengths is None or all(lengths[name] == lengths[self.name] for name in names)

    def check(self, values: Any, start: int) -> None:
        """Refuse a block of times with a gap, in itself or after the block before."""
        times = _in_seconds(values, self._unit, is_counter_refused=False)
        if times is None:
            raise ContentError(f"channel {self.name!r} is not numeric, expected times")
        before = [] if self._last is None else [self._last]
        steps = np.diff(np.concatenate([before, times]))
        bad = np.flatnonzero((steps > self._largest) | (steps < 0) | np.isnan(steps))
        if bad.size:
            sample = start + bad[0] + 1 - len(before)
            raise ContentError(
                f"channel {self.name!r} is not evenly spaced: {steps[bad[0]]:g} s before sample "
                f"{sample}, expected {self._step:g} s"
            )
        if len(times):
            self._last = times[-1]


def find_time_axis(contents: Contents) -> TimeAxis | None:
    """The channel of times, or None.

    It is recognised by a name such as ``time``, ``t`` or ``seconds`` and by values that never
    fall: numbers, dates, or texts of ISO dates. Integers without a unit count samples, or count
    time in a unit that nobody knows, and are no time axis.

    Parameters
    ----------
    contents : Contents
        Of the file.

    Returns
    -------
    TimeAxis or None
    """
    for name in contents.channels:
        if names_times(name) and len(contents.channels) > 1:
            break
    else:
        return None
    unit = contents.units.get(name, "")
    (values,) = next(contents.read([name], _N_PROBED), [np.zeros(0)])
    times = _in_seconds(values[:_N_PROBED], unit)
    if times is None or len(times) < 2 or not np.isfinite(times).all():
        return None
    if np.any(np.diff(times) < 0) or times[-1] <= times[0]:
        return None
    return TimeAxis(name, unit, times, np.asarray(values).dtype.kind in "MOU")


def names_times(name: str) -> bool:
    """Whether a channel is called like one of times.

    Examples
    --------
    >>> names_times("run/Time (s)"), names_times("DE_time")
    (True, False)
    """
    return letters(name.replace("/", ".").rpartition(".")[2]) in _NAMES


def _in_seconds(values, unit, is_counter_refused=True):
    """Times in seconds, or None where the values are no times."""
    values = np.asarray(values)
    if values.dtype.kind in "mM":
        return values.astype(f"{values.dtype.kind}8[ns]").astype(np.int64) / 1e9
    if values.dtype.kind in "OU":
        return _of_dates(values)
    scale = SECONDS.get(unit.strip().lower()) if unit else 1.0
    if values.dtype.kind not in "fiu" or scale is None:
        return None
    if is_counter_refused and not unit:
        is_counter = values.dtype.kind != "f" or np.all(np.diff(values[:_N_PROBED]) == 1)
        if is_counter:
            return None
    return values.astype(np.float64) * scale


def _of_dates(texts):
    """ISO dates in seconds since 1970, those without a zone as UTC; None if they are none."""
    import pandas as pd

    try:
        dates = pd.to_datetime(texts, format="ISO8601", utc=True)
    except (ValueError, TypeError):
        return None
    return dates.tz_localize(None).to_numpy("datetime64[ns]").astype(np.int64) / 1e9
