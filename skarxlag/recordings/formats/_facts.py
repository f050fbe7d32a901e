"""Facts that files state under many names: sampling rates, shaft speeds, times and dates."""

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._contents import ContentError, Contents

#: Names in lower case with nothing but letters, and the number of Hz or seconds in their unit.
_RATE_NAMES = {
    name + unit: scale
    for unit, scale in {"": 1.0, "hz": 1.0, "inhz": 1.0, "khz": 1e3}.items()
    for name in (
        "fs",
        "sr",
        "fsample",
        "fsampling",
        *(f"{a}{b}" for a in ("sample", "sampling") for b in ("rate", "freq", "frequency")),
    )
}
_STEP_NAMES = {
    name + unit: scale
    for unit, scale in {"": 1.0, "s": 1.0, "ins": 1.0, "ms": 1e-3, "us": 1e-6}.items()
    for name in (
        "dt",
        "deltat",
        "timestep",
        "wfincrement",
        *(f"{a}{b}" for a in ("sample", "sampling") for b in ("interval", "period")),
    )
}
_TIME_NAMES = {
    *("time", "times", "t", "zeit", "seconds", "sec", "timestamp", "timestamps", "datetime"),
    *("date", "datum", "zeitstempel"),
}
_SPEED_NAME = re.compile(r"(.*?)[ _(\[]*(?:rpm|drehzahl)[ )\]]*", re.IGNORECASE)
_SPEED_UNITS = {"rpm", "rev/min", "r/min", "1/min", "min-1", "u/min"}
SECONDS = {
    **dict.fromkeys(("s", "sec", "second", "seconds"), 1.0),
    **dict.fromkeys(("us", "µs", "μs"), 1e-6),
    "ms": 1e-3,
    "ns": 1e-9,
}
#: Times from which the sampling rate is computed, and more if they are too coarse.
_N_PROBED, _N_COARSE = 10_000, 1_000_000
#: Stated rates that differ by this share agree.
RATE_TOLERANCE = 1e-3
#: Coarse times give a sampling rate if it is known to this share.
_COARSE_TOLERANCE = 5e-3
_DAY_FIRST = re.compile(r"\s*(\d{1,2})([./])(\d{1,2})\2(\d{4})[ T,]*")


def letters(name: str) -> str:
    """Return a name in lower case without units in brackets and all that is not a letter."""
    return "".join(c for c in re.split(r"[(\[]", name)[0].lower() if c.isalpha())


def rounded(value: float, tolerance: float) -> float:
    """Return the number of fewest digits within a relative tolerance.

    Examples
    --------
    >>> rounded(51199.87, 5e-6), rounded(97656.25, 1e-9)
    (51200.0, 97656.25)
    """
    digits = (float(f"{value:.{n}g}") for n in range(1, 18))
    return next(each for each in digits if abs(each - value) <= tolerance * value)


def is_rate(value: Any) -> bool:
    """Return whether a number can be a sampling rate or a speed."""
    return bool(np.isrealobj(value) and np.isfinite(value) and value > 0)


def stated_rates(
    lengths: Mapping[str, int], scalars: Mapping[str, Any], separator: str = "."
) -> dict[str, float]:
    """Find the sampling rate of each channel among numbers with names such as ``fs`` or ``dt``.

    Names are paths such as ``run.signal`` and ``run.fs``. The number nearest to the channel on the
    way up to the root counts. It is the rate of the longest of the channels that it could belong
    to; shorter ones, such as a speed next to a vibration, were sampled more slowly.

    Parameters
    ----------
    lengths : mapping of str to int
        Samples in each channel.
    scalars : mapping of str to number
        Single numbers by name.
    separator : str, default="."
        Between the parts of a name.

    Examples
    --------
    >>> stated_rates({"a.y": 5, "z": 9, "u": 7}, {"fs": 10.0, "a.SampleRate": 20.0, "a.load": 3.0})
    {'a.y': 20.0, 'z': 10.0}
    >>> stated_rates({"y": 5}, {"dt": 0.001})
    {'y': 1000.0}
    """
    found = _nearest(lengths, scalars, separator, _rate_of)
    longest: dict[str, int] = {}
    for name, (place, _) in found.items():
        longest[place] = max(longest.get(place, 0), lengths[name])
    return {name: rate for name, (place, rate) in found.items() if lengths[name] == longest[place]}


def stated_speeds(
    channels: Iterable[str], scalars: Mapping[str, Any], separator: str = "."
) -> dict[str, float]:
    """Find the shaft speed of each channel, in rev/min, among numbers such as ``rpm``.

    The nearest number counts, as in `stated_rates`. Of several with a prefix, the one counts whose
    prefix begins the name of the channel.

    Examples
    --------
    >>> stated_speeds(["X98_DE_time", "X99_DE_time"], {"X98RPM": 1772.0, "X99RPM": 1750.0})
    {'X98_DE_time': 1772.0, 'X99_DE_time': 1750.0}
    """
    found = _nearest(channels, scalars, separator, _speed_of)
    return {name: speed for name, (_, speed) in found.items()}


def _nearest(
    names: Iterable[str],
    scalars: Mapping[str, Any],
    separator: str,
    value_of: Callable[[str, Any], Any],
) -> dict[str, tuple[str, float]]:
    """Place and value of the nearest fact above each name; values that disagree do not count."""
    by_place: dict[str, set[tuple[str, float]]] = {}
    for name, number in scalars.items():
        place, _, last = name.rpartition(separator)
        if is_rate(number) and (fact := value_of(last, float(number))) is not None:
            by_place.setdefault(place, set()).add(fact)
    found = {}
    for name in names:
        place, last = name, name.rpartition(separator)[2]
        while place and name not in found:
            place = place.rpartition(separator)[0]
            facts = by_place.get(place, set())
            values = {value for prefix, value in facts if last.startswith(prefix)}
            values = values or {value for _, value in facts}
            if len(values) == 1:
                found[name] = (place, values.pop())
    return found


def _rate_of(name, number):
    plain = "".join(c for c in name.lower() if c.isalpha())
    if plain in _RATE_NAMES:
        return "", number * _RATE_NAMES[plain]
    if plain in _STEP_NAMES and is_rate(rate := 1 / (number * _STEP_NAMES[plain])):
        return "", rounded(rate, 1e-9)
    return None


def _speed_of(name, number):
    match = _SPEED_NAME.fullmatch(name)
    return match and (match[1], number)


def names_speed(name: str, unit: str | None = None) -> bool:
    """Return whether a channel holds the shaft speed, judged by its name or unit.

    Examples
    --------
    >>> names_speed("motor/rpm"), names_speed("Speed [RPM]"), names_speed("n", "1/min")
    (True, True, True)
    """
    is_named = _SPEED_NAME.fullmatch(re.split(r"[/.]", name)[-1]) is not None
    return is_named or (unit or "").strip().lower() in _SPEED_UNITS


def names_times(name: str) -> bool:
    """Return whether a channel holds times, judged by its name.

    Examples
    --------
    >>> names_times("run/Time (s)"), names_times("DE_time")
    (True, False)
    """
    return letters(name.replace("/", ".").rpartition(".")[2]) in _TIME_NAMES


def seconds_of_dates(texts: Iterable[Any]) -> NDArray[Any]:
    """Return dates in seconds since 1970, NaN if a text is not a date.

    Dates are in ISO 8601, or with the day first as in ``22.11.2026 07:00:00,5`` or
    ``22/11/2026``. They are in UTC unless they state a zone.

    Examples
    --------
    >>> seconds_of_dates(["1970-01-02", "02.01.1970 00:00:00,5", "1970-01-01T01:00+01:00", "later"])
    array([86400. , 86400.5,     0. ,     nan])
    """
    return np.array([_seconds_of_date(text) for text in texts], dtype=np.float64)


def _seconds_of_date(text):
    try:
        date = text if isinstance(text, datetime) else datetime.fromisoformat(_iso(text))
    except (ValueError, AttributeError):
        return np.nan
    return (date if date.tzinfo else date.replace(tzinfo=UTC)).timestamp()


def _iso(text):
    """Text of a date with the day first, in ISO 8601; any other text as it is."""
    text = text.strip().strip('"')
    if match := _DAY_FIRST.match(text):
        day, _, month, year = match.groups()
        text = f"{year}-{month:0>2}-{day:0>2}T{text[match.end() :] or '00:00'}"
    return text


@dataclass
class TimeAxis:
    """A channel of evenly spaced times.

    Attributes
    ----------
    name, unit : str
        Of the channel.
    sampling_rate : float
        In Hz.
    start : float or None
        Seconds since 1970 at the first sample; None if the times are not dates.
    largest : float
        Seconds of the largest step that is not a gap.
    """

    name: str
    unit: str
    sampling_rate: float
    start: float | None
    largest: float
    _last: float | None = None

    def covers(self, contents: Contents, names: list[str]) -> bool:
        """Return whether the times belong to all of the channels."""
        lengths = contents.lengths
        if names == [self.name]:
            return False
        return lengths is None or all(lengths[name] == lengths[self.name] for name in names)

    def check(self, values: Any, start: int) -> None:
        """Refuse a block of times with a gap, in itself or after the block before."""
        times = _in_seconds(values, self.unit)
        if times is None:
            raise ContentError(f"channel {self.name!r} is not numeric, expected times")
        before = [] if self._last is None else [self._last]
        steps = np.diff(np.concatenate([before, times]))
        bad = np.flatnonzero((steps > self.largest) | (steps < 0) | np.isnan(steps))
        if bad.size:
            sample = start + bad[0] + 1 - len(before)
            raise ContentError(
                f"channel {self.name!r} is not evenly spaced: {steps[bad[0]]:g} s before sample "
                f"{sample}, expected {1 / self.sampling_rate:g} s"
            )
        if len(times):
            self._last = times[-1]


def find_time_axis(contents: Contents) -> TimeAxis | None:
    """Find the channel of times, None if there is none.

    Its name is one such as ``time``, ``t`` or ``seconds``, and its values never fall: numbers,
    dates, or texts of dates. Integers without a unit are not times: they may count samples.

    Parameters
    ----------
    contents : Contents
        Of the file.

    Returns
    -------
    TimeAxis or None
    """
    names = [name for name in contents.channels if names_times(name)]
    if not names or len(contents.channels) < 2:
        return None
    unit = contents.units.get(names[0], "")
    for n_probed in (_N_PROBED, _N_COARSE):
        (values,) = next(contents.read(names[:1], n_probed), [np.zeros(0)])
        values = np.asarray(values[:n_probed])
        if not unit and (values.dtype.kind in "iu" or _counts(values)):
            return None
        times = _in_seconds(values, unit)
        if times is None or len(times) < 2 or not np.isfinite(times).all():
            return None
        if np.any(np.diff(times) < 0):
            return None
        rate, is_certain = _rate_of_times(times)
        if is_certain or len(times) < n_probed:
            break
    if rate is None:
        return None
    start = float(times[0]) if values.dtype.kind in "MOU" else None
    steps = np.diff(times)
    largest = max(1.6 / rate, 1.5 * steps[steps > 0].min())
    return TimeAxis(names[0], unit, rate, start, largest)


def _rate_of_times(times):
    """Sampling rate of times that never fall, None if unknown; and whether more would not help."""
    changes = 1 + np.flatnonzero(np.diff(times))
    if len(changes) == len(times) - 1:
        duration = times[-1] - times[0]
        tolerance = max(1e-5, 2 * np.spacing(times[-1]) / duration)
        return rounded(len(changes) / duration, tolerance), True
    # Coarse times are equal for several samples. How long the first and last of them were equal is
    # unknown, so the rate is that between two changes, which are known to about a sample.
    if len(changes) < 2:
        return None, False
    n_steps = changes[-1] - changes[0]
    rate = n_steps / (times[changes[-1]] - times[changes[0]])
    tolerance = 1.5 / n_steps
    if tolerance > _COARSE_TOLERANCE:
        return None, False
    return rounded(rate, tolerance), tolerance < RATE_TOLERANCE


def _counts(values):
    return values.dtype.kind == "f" and np.all(np.diff(values) == 1)


def _in_seconds(values, unit):
    """Times in seconds, None if the values are not times."""
    values = np.asarray(values)
    if values.dtype.kind in "mM":
        return values.astype(f"{values.dtype.kind}8[ns]").astype(np.int64) / 1e9
    if values.dtype.kind in "OU":
        seconds = seconds_of_dates(values)
        return None if np.isnan(seconds).any() else seconds
    scale = SECONDS.get(unit.strip().lower()) if unit else 1.0
    if values.dtype.kind not in "fiu" or scale is None:
        return None
    return values.astype(np.float64) * scale
