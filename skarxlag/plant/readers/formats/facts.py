"""Names, numbers, units and dates, as files and people write them."""

import re
from collections import Counter
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from typing import Any

import numpy as np

#: Names are compared by their letters in lower case. A unit may stand at their end.
_SAMPLE = "sampl(?:e|ing)"
_RATES = rf"fs|sr|f{_SAMPLE}|{_SAMPLE}(?:rate|freq|frequency)"
_RATES += "|abtast(?:rate|frequenz)|fr[eé]quenced[eé]chantillonnage"
_RATE_NAME = re.compile(rf"(?:{_RATES})(?:(?:in)?(k?hz))?")
_STEPS = rf"dt|delta[tx]|timestep|tinterval|(?:wf|t|x)?inc(?:rement)?|{_SAMPLE}(?:interval|period)"
_STEP_NAME = re.compile(rf"(?:{_STEPS})(?:(?:in)?([mu]?s))?")
_TIMES = "times?|t|timestamps?|datetime|date|xvalues?|elapsed(?:time)?"
_TIMES += "|(?:uhr)?zeit|datum|zeitstempel|temps|heure|dateheure|horodatage"
_TIME_UNITS = (
    "millis|micros|[mun]s|[mu]?secs?|(?:milli|micro|nano)?seconds?|minutes|hours|days"
)
_TIME_NAME = re.compile(
    rf"(?:{_TIMES})(?P<last>{_TIME_UNITS}|s)?|(?P<only>{_TIME_UNITS})(?:elapsed)?"
)
UNIT_NAMES = ("unitstring", "unit", "units", "niunitdescription")
#: Name of a text with the unit of a number, which begins with the name of the number.
UNIT_OF_NUMBER = re.compile("(.+?)units?")
SPEED_NAME = re.compile(r"(.*?)[ _(\[]*(?:rpm|drehzahl)[ )\]]*", re.IGNORECASE)
_SPEED_UNITS = ("rpm", "rev/min", "r/min", "1/min", "min-1", "u/min", "tr/min")
_UNITS_OF_TIME = {
    "s sec secs second seconds": 1.0,
    "ms msec millis milliseconds": 1e-3,
    "us µs μs usec micros microseconds": 1e-6,
    "ns nsec nanoseconds": 1e-9,
    "min minute minutes": 60.0,
    "h hour hours": 3600.0,
    "d day days": 86400.0,
}
SECONDS = {
    name: scale for names, scale in _UNITS_OF_TIME.items() for name in names.split()
}
#: Units that are no names of columns, as "min", "h" and "d" are.
UNITS = SECONDS.keys() - {"min", "h", "d"} | {
    *("g", "gs", "mg", "m/s2", "m/s^2", "m/s²", "m/s/s", "mm/s", "in/s", "ips", "um"),
    *("µm", "mm", "v", "mv", "volt", "volts", "a", "ma", "nm", "n", "kn", "pa", "bar"),
    *("rpm", "1/min", "hz", "khz", "%", "°c", "degc", "db", "-"),
}
#: Fields without a value, in lower case.
MISSING = {"", "nan", "-nan", "na", "n/a", "#n/a", "null", "none", "nat", "<na>"}
#: Number that instruments write for an overflow, and texts in place of it.
OVERFLOW = 9.9e37
OVERFLOWS = {"ol", "over", "overflow", "overload"}
#: Units of sampling rates, in lower case.
HERTZ = {"hz": 1.0, "1/s": 1.0, "s/s": 1.0, "khz": 1e3, "ks/s": 1e3, "mhz": 1e6}
HERTZ["ms/s"] = 1e6
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
    if not is_rate(number):
        return None
    if match := _RATE_NAME.fullmatch(name):
        scale = HERTZ.get(match[1] or unit or "hz")
        return scale and number * scale
    match = _STEP_NAME.fullmatch(name)
    seconds = match and SECONDS.get(match[1] or unit or "s")
    return rounded(1 / (number * seconds), 1e-9) if seconds else None


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
_TIME_OF_DAY = re.compile(
    r"(?:(\d{1,2}):)?(\d\d):(\d\d(?:[.,]\d*)?)\s*([AP]M)?", re.IGNORECASE
)
#: Number with a sign between groups of three digits, and its decimals.
_GROUPED = re.compile(
    r"[+-]?[1-9]\d{0,2}(?P<sign>[.,'\u2019 \u00a0\u202f])\d{3}(?:(?P=sign)\d{3})*"
    r"(?P<decimals>(?!(?P=sign))[.,]\d*)?"
)
#: Decimals at the end of a number or of a time of day, which may state a zone.
_DECIMALS = re.compile(
    r"(?:^|[^.,\dEe])(?<![Ee][+-])\d*(?:[.,](\d+))?"
    r"(?: [AP]M|Z| ?[+-]\d\d:?\d\d)?$"
)
#: Minus as typesetters write it.
_MINUS = "\u2212"


def unit_in_name(name: str) -> str | None:
    """Return the unit in brackets at the end of a name, None if there is none.

    >>> unit_in_name("time (ms)")
    'ms'
    """
    match = _UNIT_IN_NAME.fullmatch(name)
    return match and match[1]


def parse_number(field: str, decimal: str = ",", thousands: str = "") -> float:
    """Return the number in a field, NaN if there is none.

    Parameters
    ----------
    field : str
        Text with the decimal point, or the decimal sign that is given.
    decimal, thousands : str
        Decimal sign, and sign between groups of three digits. Blanks and apostrophes,
        and the sign before decimals of another sign, always separate groups.

    Examples
    --------
    >>> parse_number("-0,5"), parse_number("1,234.5"), parse_number("1.234")
    (-0.5, 1234.5, 1.234)
    >>> parse_number("1.234", thousands=".")
    1234.0
    """
    text = field.strip().replace(_MINUS, "-")
    if match := _GROUPED.fullmatch(text):
        sign = match["sign"]
        is_repeated = text.count(sign) > 1
        if sign == thousands or sign not in ".," or is_repeated or match["decimals"]:
            text = text.replace(sign, "")
    try:
        # Python takes 1_000 for a number.
        return float(text.replace(decimal, ".").replace("_", "no number"))
    except ValueError:
        return np.nan


def is_ambiguous(text: str, highest: float = np.inf) -> bool:
    """Return whether a sign in a number may separate thousands, or decimals.

    Thousands above the highest possible value are decimals.

    >>> [is_ambiguous(text) for text in ("1.797", "51,200", "1797.5", "0.523", "1,234.5")]
    [True, True, False, False, False]
    """
    match = _GROUPED.fullmatch(text.strip().replace(_MINUS, "-"))
    is_one_group = match and re.sub(r"[^.,]", "", match[0]) in (".", ",")
    if not is_one_group or match["decimals"]:
        return False
    return abs(parse_number(match[0], thousands=match["sign"])) <= highest


def n_decimals(texts: Iterable[str]) -> int | None:
    """Return how many decimals all numbers or times of day have, None if they differ.

    >>> n_decimals(["0.5", "", "13.0"]), n_decimals(["0.5", "13"]), n_decimals(["1E-3"])
    (1, None, None)
    >>> n_decimals(["07:00:00.125 PM"]), n_decimals(["2026-11-22T07:00:00.125+01:00"])
    (3, 3)
    """
    matches = [_DECIMALS.search(text) for text in texts if text]
    counts = {len(match[1] or "") if match else None for match in matches}
    return counts.pop() if len(counts) == 1 else None


def meanings(text: str) -> str:
    """Return what an ambiguous number means, and how to write it.

    >>> meanings("1.797")
    "'1.797', which means 1797 or 1.797; write 1797, or 1.7970"
    """
    plain = text.strip()
    whole = re.sub("[.,]", "", plain)
    decimal = plain.replace(",", ".")
    return f"{text!r}, which means {whole} or {decimal}; write {whole}, or {decimal}0"


def check_unambiguous(name: str, text: str, highest: float = np.inf) -> None:
    """Refuse a stated number whose sign may separate thousands, or decimals.

    Parameters
    ----------
    name, text : str
        Name of the fact, for the message, and the number.
    highest : float, default=inf
        Largest value of the fact. Thousands above it are decimals.

    Raises
    ------
    ValueError
        If one to three digits are followed by a point or a comma and three digits.

    Examples
    --------
    >>> check_unambiguous("sampling_rate", "51200.5")
    >>> check_unambiguous("sampling_rate", "51.200")
    Traceback (most recent call last):
        ...
    ValueError: sampling_rate is '51.200', which means 51200 or 51.200; write 51200, or 51.2000
    """
    if is_ambiguous(text, highest):
        raise ValueError(f"{name} is {meanings(text)}")


def seconds_of_day(field: Any) -> float:
    """Return a time of day in seconds, NaN if the field is no text of one.

    Spreadsheets leave out the hours, as in ``59:59.5``, but not the decimals then.

    >>> seconds_of_day("23:59:59,5"), seconds_of_day("01:00:00 PM"), seconds_of_day("1:2")
    (86399.5, 46800.0, nan)
    >>> seconds_of_day("59:59.5"), seconds_of_day("10:30")
    (3599.5, nan)
    """
    match = _TIME_OF_DAY.fullmatch(str(field).strip().strip('"'))
    if match is None or (match[1] is None and match[3].isdecimal()):
        return np.nan
    hours = int(match[1] or 0)
    if match[4]:
        hours = hours % 12 + 12 * (match[4].upper() == "PM")
    return 3600.0 * hours + 60 * int(match[2]) + float(match[3].replace(",", "."))


def time_unit_in_name(name: str) -> str | None:
    """Return the unit of time that a name states in brackets or as its last word.

    >>> [time_unit_in_name(name) for name in ("time (ms)", "Time_us", "t_ms", "seconds_elapsed")]
    ['ms', 'us', 'ms', 'seconds']
    >>> time_unit_in_name("time"), time_unit_in_name("x-axis, second")
    (None, 'second')
    """
    last = re.split("[_ ,]+", name.strip())[-1]
    match = _TIME_NAME.fullmatch(letters(name))
    words = [unit_in_name(name), last, *(match.groups() if match else ())]
    units = (word.strip() for word in words if word)
    return next((unit for unit in units if unit.lower() in SECONDS), unit_in_name(name))


def seconds_of_date(field: Any) -> float:
    """Return a date in seconds since 1970, NaN if the field is not a text of a date.

    Dates are in ISO 8601, also with slashes, or with the day first as in ``22.11.2026 07:00:00,5``,
    ``22/11/2026`` or ``22.11.26``, which is in this century. Before a time with AM or
    PM, and as in ``11/22/2026``, the month comes first. Dates are in UTC unless they
    state a zone.

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
            day, sign, month, century, year = match.groups("20")
            clock = text[match.end() :] or "00:00:00"
            if sign == "/" and (clock[-1] in "mM" or int(month) > 12):
                day, month = month, day
            date = datetime(int(century + year), int(month), int(day), tzinfo=UTC)
            return date.timestamp() + seconds_of_day(clock)
        date = datetime.fromisoformat(text.replace("/", "-"))
        return (date if date.tzinfo else date.replace(tzinfo=UTC)).timestamp()
    except (ValueError, AttributeError, OverflowError):
        # The year 1 overflows in some time zones.
        return np.nan


def distinct(names: list[str]) -> list[str]:
    """Return the names, with a number after those that occur a second time, as in pandas."""
    columns = []
    n_before = Counter()
    for i, name in enumerate(names):
        shown = name or f"Unnamed: {i}"
        columns.append(f"{shown}.{n_before[shown]}" if n_before[shown] else shown)
        n_before[shown] += 1
    return columns
