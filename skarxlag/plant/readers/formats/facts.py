"""Names, numbers, units and dates, as files and people write them."""

import re
from collections import Counter
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any

import numpy as np

#: Names are compared by their letters in lower case. A unit may stand at their end.
_SAMPLE = "sampl(?:e|ing)"
_RATES = rf"fs|sr|f{_SAMPLE}|{_SAMPLE}(?:rate|freq|frequency)"
_RATE_NAME = re.compile(rf"(?:{_RATES})(?:(?:in)?(k?hz))?")
_STEPS = rf"dt|deltat|timestep|wfincrement|{_SAMPLE}(?:interval|period)"
_STEP_NAME = re.compile(rf"(?:{_STEPS})(?:(?:in)?([mu]?s))?")
_TIME_NAME = re.compile(
    r"times?|t|zeit|seconds|sec|timestamps?|datetime|date|datum|zeitstempel"
)
UNIT_NAMES = ("unitstring", "unit", "units", "niunitdescription")
#: Name of a text with the unit of a number, which begins with the name of the number.
UNIT_OF_NUMBER = re.compile("(.+?)units?")
SPEED_NAME = re.compile(r"(.*?)[ _(\[]*(?:rpm|drehzahl)[ )\]]*", re.IGNORECASE)
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
    return all_letters(re.split(r"[(\[]", name)[0])


def all_letters(name: str) -> str:
    """Return the letters of a name in lower case."""
    return "".join(filter(str.isalpha, name.lower()))


def stated_unit(properties: Mapping[str, Any]) -> str | None:
    """Return the unit among the properties of a channel, None if there is none."""
    for key, value in properties.items():
        if letters(key) in UNIT_NAMES and isinstance(value, str | bytes) and value:
            return value if isinstance(value, str) else value.decode(errors="replace")
    return None


def stated_rate(name: str, number: float, unit: str | None) -> float | None:
    """Return the sampling rate that a number with a name states, None if it states none."""
    if match := _RATE_NAME.fullmatch(name):
        scale = HERTZ.get(match[1] or unit or "hz")
        return scale and number * scale
    match = _STEP_NAME.fullmatch(name)
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
    is_named = SPEED_NAME.fullmatch(re.split(r"[/.]", name)[-1]) is not None
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


_UNIT_IN_NAME = re.compile(r".*[(\[]([^()\[\]]+)[)\]]\s*")
_DAY_FIRST = re.compile(r"\s*(\d{1,2})([./])(\d{1,2})\2(\d\d)?(\d\d)(?!\d)[ T,]*")


def unit_in_name(name: str) -> str | None:
    """Return the unit in brackets at the end of a name, None if there is none.

    >>> unit_in_name("time (ms)")
    'ms'
    """
    match = _UNIT_IN_NAME.fullmatch(name)
    return match and match[1]


def is_number(field: str, decimal: str) -> bool:
    """Return whether a field holds a number, or nothing."""
    return field.lower() in ("", "nan") or not np.isnan(number(field, decimal))


def number(field: str, decimal: str = ",") -> float:
    """Return the number in a field, with the point or `decimal`; NaN if there is none."""
    try:
        # Python takes 1_000 for a number.
        return float(field.replace(decimal, ".").replace("_", "no number"))
    except ValueError:
        return np.nan


def seconds_of_date(field: Any) -> float:
    """Return a date in seconds since 1970, NaN if the field is not a text of a date.

    Dates are in ISO 8601, or with the day first as in ``22.11.2026 07:00:00,5``,
    ``22/11/2026`` or ``22.11.26``, which is in this century. They are in UTC unless
    they state a zone.

    Examples
    --------
    >>> seconds_of_date("1970-01-02"), seconds_of_date("02.01.1970 00:00:00,5")
    (86400.0, 86400.5)
    >>> seconds_of_date("1970-01-01T01:00+01:00"), seconds_of_date("later")
    (0.0, nan)
    """
    try:
        text = field.strip().strip('"')
        if match := _DAY_FIRST.match(text):
            day, _, month, century, year = match.groups("20")
            clock = text[match.end() :] or "00:00"
            text = f"{century}{year}-{month:0>2}-{day:0>2}T{clock}"
        date = datetime.fromisoformat(text)
    except (ValueError, AttributeError):
        return np.nan
    return (date if date.tzinfo else date.replace(tzinfo=UTC)).timestamp()


def distinct(names: list[str]) -> list[str]:
    """Return the names, with a number after those that occur a second time, as in pandas."""
    columns = []
    n_before = Counter()
    for i, name in enumerate(names):
        shown = name or f"Unnamed: {i}"
        columns.append(f"{shown}.{n_before[shown]}" if n_before[shown] else shown)
        n_before[shown] += 1
    return columns
