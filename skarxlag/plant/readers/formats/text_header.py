"""Lines above the samples of a text: names, units, and stated sampling rates."""

import re
from collections.abc import Iterable

import numpy as np

from .contents import ContentError
from .facts import (
    MISSING,
    SECONDS,
    UNITS,
    all_letters,
    letters,
    names_times,
    parse_number,
    seconds_of_date,
    seconds_of_day,
    stated_rate,
    unit_in_name,
)

#: First fields of a line of names or units that are none of a column.
_TAGS = ("header", "headers", "names", "columns", "fields", "channels", "kanal")
_TAGS += ("unit", "units", "einheit")
#: Name, value and unit in a line of the head, as in ``Rate: 2000 Hz``.
_STATEMENT = re.compile(r"\s*([^:=;,\t]+?)\s*[:=;,\t]+\s*([^\s;]+)[\s;]*([^\s.,;]*)")


def kind_of(text: str) -> str:
    """Return the kind of a field: number, date (also a time of day), text, or empty."""
    if not text:
        return ""
    if text.lower() in MISSING or not np.isnan(parse_number(text)):
        return "number"
    seconds = seconds_of_date(text), seconds_of_day(text)
    return "text" if np.isnan(seconds).all() else "date"


def are_texts(kinds: Iterable[str]) -> bool:
    """Return whether all kinds of a line are texts or empty."""
    return {*kinds} <= {"text", ""}


def names_and_units(
    above: list[list[str]], n_fields: int, n_filled: int
) -> tuple[list[str] | None, list[str]]:
    """Return the names of columns, None if there are none, and their units.

    Parameters
    ----------
    above : list of list of str
        Fields of the lines above the samples.
    n_fields, n_filled : int
        Fields of a sample, and fields up to the last one with values.
    """
    fitted = [_fitted(fields, n_fields, n_filled) for fields in above]
    while fitted and fitted[-1] is None:
        fitted.pop()
    if not fitted:
        if above and len(above[-1]) > 1 and are_texts(map(kind_of, above[-1])):
            raise ContentError(
                f"{len(above[-1])} names for the {n_fields} fields of a sample"
            )
        return None, []
    last = len(fitted) - 1
    numbers = [i for i in range(last + 1) if "number" in map(kind_of, above[i])]
    first = numbers[-1] + 1 if numbers else 0
    for i in range(max(first, 1), last + 1):
        # Names of an oscilloscope may be numbers, if the unit of the first is of time.
        is_named = i > first or all_letters(above[i][0]) in SECONDS
        if is_named and fitted[i - 1] and all(map(_is_unit, fitted[i] or ["no unit"])):
            return fitted[i - 1], fitted[i]
    has_units = last == 1 or any(map(_is_unit, filter(None, fitted[last])))
    has_units &= not any(map(names_times, fitted[last]))
    if has_units and first < last and fitted[last - 1]:
        return fitted[last - 1], fitted[last]
    return fitted[last], []


def _is_unit(text):
    return text.strip("[]() ").lower() in {*UNITS, ""} or text[:1] in ("[", "(")


def _fitted(fields, n_fields, n_filled):
    """Return the names of the columns in a line, None if it holds others or none.

    Lines of names and of samples may end with separators. The names may follow a tag,
    and one for comments may come last.
    """
    kinds = {*map(kind_of, fields)}
    if len(fields) == n_fields + 1 and are_texts(kinds):
        return fields[1:] if all_letters(fields[0]) in _TAGS else fields
    is_short = len(fields) < max(n_filled, 1)
    is_statement = "=" in fields or (len(fields) == 1 and re.search("[:=]", fields[0]))
    if is_short or is_statement or any(fields[n_fields:]) or kinds <= {"number", ""}:
        return None
    return [*fields, *[""] * n_fields][:n_fields]


def stated_rates(rows: Iterable[list[str]]) -> dict[str, float]:
    """Return the sampling rates that lines state, by their names."""
    rates = {}
    for fields in rows:
        match = _STATEMENT.match(";".join(fields[:3]))
        if match is None:
            continue
        name, value, unit = match.groups()
        # Values of further channels follow that of the first.
        unit = unit if np.isnan(parse_number(unit)) else ""
        unit = (unit_in_name(name) or unit).strip(" []()").lower() or None
        rate = stated_rate(letters(name), parse_number(value), unit)
        rates |= {name: rate} if rate else {}
    return rates
