"""Find sampling rates, shaft speeds, times and dates under the many names that files use."""

import re
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._contents import Channel

#: Letters of a name in lower case, with the unit at the end.
_SAMPLE = "sampl(?:e|ing)"
_RATE_NAME = re.compile(
    rf"(?:fs|sr|f{_SAMPLE}|{_SAMPLE}(?:rate|freq|frequency))(hz|inhz|khz)?"
)
_STEPS = rf"dt|deltat|timestep|wfincrement|{_SAMPLE}(?:interval|period)"
_STEP_NAME = re.compile(rf"(?:{_STEPS})(s|ins|ms|us)?")
_TIME_NAME = re.compile(
    r"times?|t|zeit|seconds|sec|timestamps?|datetime|date|datum|zeitstempel"
)
_SPEED_NAME = re.compile(r"(.*?)[ _(\[]*(?:rpm|drehzahl)[ )\]]*", re.IGNORECASE)
_SPEED_UNITS = {"rpm", "rev/min", "r/min", "1/min", "min-1", "u/min"}
SECONDS = {"s": 1.0, "sec": 1.0, "second": 1.0, "seconds": 1.0}
SECONDS |= {"us": 1e-6, "µs": 1e-6, "μs": 1e-6, "ms": 1e-3, "ns": 1e-9}
SECONDS |= {"min": 60.0, "minute": 60.0, "minutes": 60.0, "h": 3600.0, "hours": 3600.0}
#: Units of sampling rates, in lower case.
HERTZ = {
    "hz": 1.0,
    "khz": 1e3,
    "mhz": 1e6,
    "1/s": 1.0,
    "s/s": 1.0,
    "ks/s": 1e3,
    "ms/s": 1e6,
}
_UNIT_NAMES = ("unitstring", "unit", "units", "niunitdescription")
#: Stated rates that differ by this share agree.
RATE_TOLERANCE = 1e-3
_DAY_FIRST = re.compile(r"\s*(\d{1,2})([./])(\d{1,2})\2(\d\d)?(\d\d)(?!\d)[ T,]*")


def letters(name: str) -> str:
    """Return the letters of a name in lower case, without units in brackets."""
    return "".join(c for c in re.split(r"[(\[]", name)[0].lower() if c.isalpha())


def stated_unit(properties: Mapping[str, Any]) -> str | None:
    """Return the unit among the properties of a channel, None if there is none."""
    for key, value in properties.items():
        if letters(key) in _UNIT_NAMES and isinstance(value, str | bytes) and value:
            return value if isinstance(value, str) else value.decode(errors="replace")
    return None


def rounded(value: float, tolerance: float) -> float:
    """Return the number of fewest digits within a relative tolerance.

    Examples
    --------
    >>> rounded(51199.87, 5e-6), rounded(97656.25, 1e-9)
    (51200.0, 97656.25)
    """
    digits = (float(f"{value:.{n}g}") for n in range(1, 18))
    return next(number for number in digits if abs(number - value) <= tolerance * value)


def is_rate(value: Any) -> bool:
    """Return whether a number can be a sampling rate or a speed."""
    return bool(np.isrealobj(value) and np.isfinite(value) and value > 0)


def state_facts(
    channels: dict[str, Channel],
    places: dict[str, str],
    scalars: dict[str, Any],
    separator: str,
    texts: Mapping[str, str] | None = None,
) -> None:
    """Fill in sampling rates and shaft speeds from numbers with names such as ``fs`` or ``rpm``.

    Places are paths such as ``run.signal``, and so are the names of numbers, such as
    ``run.fs``. The number nearest to the channel on the way up to the root counts. A
    rate is that of the longest of the channels that it could belong to; shorter ones,
    such as a speed next to a vibration, were sampled more slowly. Of several speeds
    with a prefix, the one counts whose prefix begins the name of the channel. Speeds
    that disagree do not count. Rates that disagree are the `contradiction` of the
    channel.

    Parameters
    ----------
    channels : mapping of str to Channel
        By name. Facts that they have already are kept.
    places, scalars : mapping
        Place of each channel, and single numbers by their places.
    separator : str
        Between the parts of a place.
    texts : mapping of str to str
        Single texts by their places. They may be units: that of ``run.fs`` is
        ``run.fs_unit`` or ``run.fs.unit``.

    Examples
    --------
    >>> y, z, u = Channel(5), Channel(9), Channel(7)
    >>> places = {"y": "a.X98_y", "z": "z", "u": "u"}
    >>> numbers = {"fs": 10.0, "a.SampleRate": 20.0, "a.X98RPM": 1772.0, "a.X99RPM": 1750.0}
    >>> state_facts({"y": y, "z": z, "u": u}, places, numbers, ".")
    >>> y.sampling_rate, z.sampling_rate, u.sampling_rate, y.rpm, z.rpm
    (20.0, 10.0, None, 1772.0, None)
    """
    rates = {}
    speeds = {}
    units = _units(texts or {}, separator)
    for name, number in scalars.items():
        place, _, last = name.rpartition(separator)
        if not is_rate(number):
            continue
        if rate := _rate_of(last, float(number), units.get(_plain(name, separator))):
            rates.setdefault(place, []).append((last, rate))
        if match := _SPEED_NAME.fullmatch(last):
            speeds.setdefault(place, []).append((match[1], float(number)))
    longest: dict[str, int] = {}
    nearest = {
        name: _nearest_rates(place, rates, separator) for name, place in places.items()
    }
    for name, (place, _) in nearest.items():
        longest[place] = max(longest.get(place, 0), channels[name].length or 0)
    for name, channel in channels.items():
        place, stated = nearest[name]
        is_longest = channel.length == longest[place]
        if stated and is_longest and channel.sampling_rate is None:
            channel.sampling_rate, channel.contradiction = _agreed_rate(stated)
        channel.rpm = _nearest_speed(places[name], speeds, separator)


def _places_above(place, separator):
    """Yield the places above a place, the nearest first."""
    while place:
        place = place.rpartition(separator)[0]
        yield place


def _nearest_rates(place, rates, separator):
    """Return place, names and values of the nearest sampling rates."""
    above = _places_above(place, separator)
    return next(((place, rates[place]) for place in above if place in rates), ("", []))


def _nearest_speed(place, speeds, separator):
    """Return the nearest speed. Contradictory values do not count."""
    last = place.rpartition(separator)[2]
    for above in _places_above(place, separator):
        facts = speeds.get(above, [])
        of_channel = {value for prefix, value in facts if last.startswith(prefix)}
        values = of_channel or {value for _, value in facts}
        if len(values) == 1:
            return values.pop()
    return None


def _agreed_rate(stated):
    """Return the rate that names state, or None; and the rates by name if they disagree."""
    rates = [rate for _, rate in stated]
    if max(rates) <= (1 + RATE_TOLERANCE) * min(rates):
        return rates[0], {}
    return None, dict(stated)


def _units(texts, separator):
    """Return units by the plain name of the number to which they belong."""
    units = {}
    for name, text in texts.items():
        place, _, last = name.rpartition(separator)
        plain = _plain(name, separator)
        if letters(last) in _UNIT_NAMES:
            units[_plain(place, separator)] = text
        elif plain.endswith(("unit", "units")):
            units[plain.removesuffix("s").removesuffix("unit")] = text
    return units


def _plain(name, separator):
    """Return a place, and the letters of a name in it, in lower case."""
    place, _, last = name.rpartition(separator)
    return place + separator + "".join(c for c in last.lower() if c.isalpha())


def _rate_of(name, number, unit=None):
    plain = "".join(c for c in name.lower() if c.isalpha())
    unit = unit and unit.strip().lower()
    if match := _RATE_NAME.fullmatch(plain):
        scale = 1e3 if match[1] == "khz" else HERTZ.get(unit or "hz")
        return scale and number * scale
    match = _STEP_NAME.fullmatch(plain)
    seconds = match and SECONDS.get(match[1] or unit or "s")
    rate = 1 / (number * seconds) if seconds else np.nan
    return rounded(rate, 1e-9) if is_rate(rate) else None


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
    return (
        _TIME_NAME.fullmatch(letters(name.replace("/", ".").rpartition(".")[2]))
        is not None
    )


def seconds_of_dates(texts: Iterable[Any]) -> NDArray[Any]:
    """Return dates in seconds since 1970, NaN if a text is not a date.

    Dates are in ISO 8601, or with the day first as in ``22.11.2026 07:00:00,5``,
    ``22/11/2026`` or ``22.11.26``, which is in this century. They are in UTC unless
    they state a zone.

    Examples
    --------
    >>> seconds_of_dates(["1970-01-02", "02.01.1970 00:00:00,5", "1970-01-01T01:00+01:00", "later"])
    array([86400. , 86400.5,     0. ,     nan])
    """
    return np.array([_seconds_of_date(text) for text in texts], dtype=np.float64)


def _seconds_of_date(text):
    try:
        text = text.strip().strip('"')
        if match := _DAY_FIRST.match(text):
            day, _, month, century, year = match.groups("20")
            text = f"{century}{year}-{month:0>2}-{day:0>2}T{text[match.end() :] or '00:00'}"
        date = datetime.fromisoformat(text)
    except (ValueError, AttributeError):
        return np.nan
    return (date if date.tzinfo else date.replace(tzinfo=UTC)).timestamp()
