"""Fields of texts: numbers, dates, units, and names of columns."""

import re
from collections import Counter
from datetime import UTC, datetime
from typing import Any

import numpy as np

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
