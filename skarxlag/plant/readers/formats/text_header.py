"""Lines above the samples of a text: names, units, and stated sampling rates."""

import re
from collections.abc import Iterable

import numpy as np

from .contents import ContentError
from .facts import (
    SECONDS,
    UNITS,
    all_letters,
    is_number,
    names_times,
    number,
    seconds_of_date,
    seconds_of_day,
    stated_rate,
    unit_in_name,
)

#: First fields of a line of names that are no name.
_NAME_TAGS = ("header", "headers", "names", "columns", "fields", "channels")
#: Name and value in one field of the head, as in ``Rate: 2000 Hz``.
_NAME_AND_VALUE = re.compile(r"\s*([^:=]+?)\s*[:=]\s*(\S+)\s*(\S*)")


def kind_of(text: str) -> str:
    """Return the kind of a field: number, date (also a time of day), text, or empty."""
    if not text:
        return ""
    if (
        is_number(text, ",")
        or is_number(text, ".")
        or is_number(text.replace(",", ""), ".")
    ):
        return "number"
    seconds = seconds_of_date(text)
    return "text" if np.isnan(seconds) and np.isnan(seconds_of_day(text)) else "date"


def are_texts(kinds: Iterable[str]) -> bool:
    """Return whether all kinds of a line are texts or empty."""
    return {*kinds} <= {"text", ""}


def header_of(
    above: list[list[str]], n_fields: int, n_filled: int
) -> tuple[list[str] | None, list[str], int]:
    """Return names, None if there are none; units; and the number of lines with them."""
    n_texts = 0
    while n_texts < len(above) and _may_be_names(above[-1 - n_texts]):
        n_texts += 1
    header = above[len(above) - n_texts :]
    fitted = [names_of(fields, n_fields, n_filled) for fields in header]
    if not header or fitted[-1] is None:
        last = above[-1] if above else []
        if len(last) > 1 and are_texts(map(kind_of, last)):
            raise ContentError(
                f"{len(last)} names for the {n_fields} fields of a sample"
            )
        names = last and names_of(last, n_fields, n_filled)
        has_names = names and {*map(kind_of, last)} > {"number"}
        return (names, [], 1) if has_names else (None, [], 0)
    above_header = above[len(above) - n_texts - 1] if n_texts < len(above) else []
    names = names_of(above_header, n_fields, n_filled)
    if names and _are_units(fitted[0]) and all_letters(header[0][0]) in SECONDS:
        # Names of an oscilloscope may be numbers, if the unit of the first is of time.
        return names, fitted[0], n_texts + 1
    pairs = [(i, fitted[i - 1], fitted[i]) for i in range(1, len(header))]
    for i, names, units in pairs:
        if names and units and _are_units(units):
            return names, units, len(header) - i + 1
    if pairs and pairs[-1][1] and _may_be_units(fitted[-1], len(above) == 2):
        return pairs[-1][1], fitted[-1], 2
    return fitted[-1], [], 1


def _may_be_names(fields):
    """Return whether a line above the samples holds no number, and states no value."""
    is_value = len(fields) == 1 and _NAME_AND_VALUE.fullmatch(fields[0])
    return not is_value and "number" not in map(kind_of, fields)


def _are_units(fields):
    """Return whether all fields are units, or in brackets."""
    return bool(fields) and all(_is_unit(text) for text in fields if text)


def _may_be_units(fields, is_second_of_two):
    """Return whether the last line below a line of names may hold their units."""
    if any(map(names_times, fields)):
        return False
    return is_second_of_two or any(map(_is_unit, fields))


def _is_unit(text):
    return text.strip("[]() ").lower() in UNITS or text[:1] in ("[", "(")


def names_of(
    fields: list[str], n_fields: int, n_filled: int, is_tagged: bool = False
) -> list[str] | None:
    """Return the names of the columns in a line, None if their number does not fit.

    Lines of names and of samples may end with separators. The names may follow a tag,
    and one for comments may come last.
    """
    if len(fields) == n_fields + 1 and are_texts(map(kind_of, fields)):
        if is_tagged or all_letters(fields[0]) in _NAME_TAGS:
            return fields[1:]
        return fields
    is_short = len(fields) < max(n_fields if is_tagged else n_filled, 1)
    are_numbers = {*map(kind_of, fields)} <= {"number", ""}
    if is_short or any(fields[n_fields:]) or are_numbers:
        return None
    return [*fields, *[""] * n_fields][:n_fields]


def stated_rates(rows: list[list[str]]) -> dict[str, float]:
    """Return the sampling rates that lines of the head state, by their names."""
    rates = {}
    for fields in rows:
        match = _NAME_AND_VALUE.fullmatch(" ".join(fields[:3]))
        parts = [*fields, "", ""][:3]
        if number(parts[1]) != number(parts[1]) and match:
            parts = list(match.groups())
        name, text, unit = parts
        # Values of further channels follow that of the first.
        unit = unit_in_name(name) or (unit if unit.strip(" []()").isalpha() else "")
        value = number(text)
        if np.isfinite(value) and value > 0:
            unit = unit.strip(" []()").lower() or None
            plain = all_letters(re.split(r"[(\[]", name)[0])
            if rate := stated_rate(plain, value, unit):
                rates[name.strip()] = rate
    return rates
