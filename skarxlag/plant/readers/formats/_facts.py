"""Find sampling rates, shaft speeds and times under the many names that files use."""

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ._contents import Channel

#: Names are compared by their letters in lower case. A unit may stand at their end.
_SAMPLE = "sampl(?:e|ing)"
_RATES = rf"fs|sr|f{_SAMPLE}|{_SAMPLE}(?:rate|freq|frequency)"
_RATE_NAME = re.compile(rf"(?:{_RATES})(?:(?:in)?(k?hz))?")
_STEPS = rf"dt|deltat|timestep|wfincrement|{_SAMPLE}(?:interval|period)"
_STEP_NAME = re.compile(rf"(?:{_STEPS})(?:(?:in)?([mu]?s))?")
_TIME_NAME = re.compile(
    r"times?|t|zeit|seconds|sec|timestamps?|datetime|date|datum|zeitstempel"
)
_UNIT_NAMES = ("unitstring", "unit", "units", "niunitdescription")
#: Name of a text with the unit of a number, which begins with the name of the number.
_UNIT_OF_NUMBER = re.compile("(.+?)units?")
_SPEED_NAME = re.compile(r"(.*?)[ _(\[]*(?:rpm|drehzahl)[ )\]]*", re.IGNORECASE)
_SPEED_UNITS = {"rpm", "rev/min", "r/min", "1/min", "min-1", "u/min"}
SECONDS = {"s": 1.0, "sec": 1.0, "second": 1.0, "seconds": 1.0}
SECONDS |= {"us": 1e-6, "µs": 1e-6, "μs": 1e-6, "ms": 1e-3, "ns": 1e-9}
SECONDS |= {"min": 60.0, "minute": 60.0, "minutes": 60.0, "h": 3600.0, "hours": 3600.0}
#: Units of sampling rates, in lower case.
HERTZ = {"hz": 1.0, "khz": 1e3, "mhz": 1e6}
HERTZ |= {"1/s": 1.0, "s/s": 1.0, "ks/s": 1e3, "ms/s": 1e6}
#: Stated rates that differ by this share agree.
RATE_TOLERANCE = 1e-3


def letters(name: str) -> str:
    """Return the letters of a name in lower case, without units in brackets."""
    return _all_letters(re.split(r"[(\[]", name)[0])


def _all_letters(name):
    return "".join(filter(str.isalpha, name.lower()))


def stated_unit(properties: Mapping[str, Any]) -> str | None:
    """Return the unit among the properties of a channel, None if there is none."""
    for key, value in properties.items():
        if letters(key) in _UNIT_NAMES and isinstance(value, str | bytes) and value:
            return value if isinstance(value, str) else value.decode(errors="replace")
    return None


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
    last = name.replace("/", ".").rpartition(".")[2]
    return _TIME_NAME.fullmatch(letters(last)) is not None


def rounded(value: float, tolerance: float) -> float:
    """Return the number of fewest digits within a relative tolerance.

    Examples
    --------
    >>> rounded(51199.87, 5e-6), rounded(97656.25, 1e-9)
    (51200.0, 97656.25)
    """
    candidates = (float(f"{value:.{n}g}") for n in range(1, 18))
    return next(c for c in candidates if abs(c - value) <= tolerance * value)


def is_rate(value: Any) -> bool:
    """Return whether a number can be a sampling rate or a speed."""
    return bool(np.isrealobj(value) and np.isfinite(value) and value > 0)


def state_facts(
    channels: dict[str, Channel],
    paths: dict[str, str],
    numbers: dict[str, Any],
    texts: dict[str, str],
    separator: str,
) -> None:
    """Fill in sampling rates and shaft speeds from numbers with names such as ``fs`` or ``rpm``.

    A path such as ``run.signal`` names the groups of a file around a channel, a number
    or a text. The number nearest to the channel on the way up to the root counts. A
    rate is that of the longest of the channels that it could belong to; shorter ones,
    such as a speed next to a vibration, were sampled more slowly. Of several speeds
    with a prefix, the one counts whose prefix begins the name of the channel. Speeds
    that disagree do not count. Rates that disagree are the `contradiction` of the
    channel.

    Parameters
    ----------
    channels : dict of str to Channel
        By name. Sampling rates that they have already are kept.
    paths : dict of str to str
        Path of each channel.
    numbers : dict of str to number
        Single numbers by their paths.
    texts : dict of str to str
        Single texts by their paths. They may be units: that of ``run.fs`` is
        ``run.fs_unit`` or ``run.fs.unit``.
    separator : str
        Between the parts of a path.

    Examples
    --------
    >>> y, z, u = Channel(5), Channel(9), Channel(7)
    >>> paths = {"y": "a.X98_y", "z": "z", "u": "u"}
    >>> numbers = {"fs": 10.0, "a.SampleRate": 20.0, "a.X98RPM": 1772.0, "a.X99RPM": 1750.0}
    >>> state_facts({"y": y, "z": z, "u": u}, paths, numbers, {}, ".")
    >>> y.sampling_rate, z.sampling_rate, u.sampling_rate, y.rpm, z.rpm
    (20.0, 10.0, None, 1772.0, None)
    """
    units = _units_of_numbers(texts, separator)
    rates = defaultdict(dict)
    speeds = defaultdict(list)
    for path, number in numbers.items():
        if not is_rate(number):
            continue
        group, _, name = path.rpartition(separator)
        plain = _all_letters(name)
        if rate := _stated_rate(plain, float(number), units.get((group, plain))):
            rates[group][name] = rate
        if match := _SPEED_NAME.fullmatch(name):
            speeds[group].append((match[1], float(number)))
    rate_groups = {}
    longest = defaultdict(int)
    for name, path in paths.items():
        above = _groups_above(path, separator)
        group = next((group for group in above if group in rates), None)
        rate_groups[name] = group
        longest[group] = max(longest[group], channels[name].length)
    for name, channel in channels.items():
        group = rate_groups[name]
        is_rated = group is not None and channel.length == longest[group]
        if is_rated and channel.sampling_rate is None:
            channel.sampling_rate, channel.contradiction = _agreed(rates[group])
        channel.rpm = _nearest_speed(paths[name], speeds, separator)


def _units_of_numbers(texts, separator):
    """Return units in lower case, by group and letters of the number that they belong to."""
    units = {}
    for path, text in texts.items():
        group, _, name = path.rpartition(separator)
        number = None
        if letters(name) in _UNIT_NAMES:
            group, _, number = group.rpartition(separator)
        elif match := _UNIT_OF_NUMBER.fullmatch(_all_letters(name)):
            number = match[1]
        if number is not None:
            units[group, _all_letters(number)] = text.strip().lower()
    return units


def _stated_rate(name, number, unit):
    """Return the sampling rate that a number with a name states, None if it states none."""
    if match := _RATE_NAME.fullmatch(name):
        scale = HERTZ.get(match[1] or unit or "hz")
        return scale and number * scale
    match = _STEP_NAME.fullmatch(name)
    seconds = match and SECONDS.get(match[1] or unit or "s")
    rate = 1 / (number * seconds) if seconds else np.nan
    return rounded(rate, 1e-9) if is_rate(rate) else None


def _groups_above(path: str, separator: str) -> Iterator[str]:
    """Yield the groups around a path, the nearest first."""
    while path:
        path = path.rpartition(separator)[0]
        yield path


def _agreed(rates):
    """Return the rate that several names state, or None; and the rates if they disagree."""
    values = list(rates.values())
    if max(values) <= (1 + RATE_TOLERANCE) * min(values):
        return values[0], {}
    return None, rates


def _nearest_speed(path, speeds, separator):
    """Return the nearest speed. Contradictory values do not count."""
    last = path.rpartition(separator)[2]
    for group in _groups_above(path, separator):
        stated = speeds.get(group, [])
        of_channel = {speed for prefix, speed in stated if last.startswith(prefix)}
        values = of_channel or {speed for _, speed in stated}
        if len(values) == 1:
            return values.pop()
    return None
