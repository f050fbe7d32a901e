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

#: First fields of a line of names or units that are none of a column.
_TAGS = ("header", "headers", "names", "columns", "fields", "channels", "kanal")
_TAGS += ("unit", "units", "einheit")
#: Name, value and unit in a line of the head, as in ``Rate: 2000 Hz``.
_STATEMENT = re.compile(r"\s*([^:=;,\t]+?)\s*[:=;,\t]\s*([^\s;]+)[\s;]*([^\s.,;]*)")


def kind_of(text: str) -> str:
    """Return the kind of a field: number, date (also a time of day), text, or empty."""
    if not text:
        return ""
    forms = ((text, ","), (text, "."), (text.replace(",", ""), "."))
    if any(is_number(*form) for form in forms):
        return "number"
    seconds = seconds_of_date(text)
    return "text" if np.isnan(seconds) and np.isnan(seconds_of_day(text)) else "date"


def are_texts(kinds: Iterable[str]) -> bool:
    """Return whether all kinds of a line are texts or empty."""
    return {*kinds} <= {"text", ""}


def header_of(
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
    n_texts = 0
    while n_texts < len(above) and _may_be_names(above[-1 - n_texts]):
        n_texts += 1
    first = len(above) - n_texts
    fitted = [names_of(fields, n_fields, n_filled) for fields in above]
    last = above[-1] if above else []
    if n_texts == 0 or fitted[-1] is None:
        if len(last) > 1 and are_texts(map(kind_of, last)):
            raise ContentError(
                f"{len(last)} names for the {n_fields} fields of a sample"
            )
        return (fitted[-1] if {*map(kind_of, last)} > {"number"} else None), []
    # Names of an oscilloscope may be numbers, if the unit of the first is of time.
    is_of_time = _are_units(fitted[first]) and all_letters(above[first][0]) in SECONDS
    for i in range(first if is_of_time else first + 1, len(above)):
        names = fitted[i - 1] if i else None
        if names and _are_units(fitted[i]):
            return names, fitted[i]
    if n_texts > 1 and fitted[-2] and _may_be_units(fitted[-1], len(above) == 2):
        return fitted[-2], fitted[-1]
    return fitted[-1], []


def _may_be_names(fields):
    """Return whether a line above the samples holds no number, and states no value."""
    is_statement = len(fields) == 1 and re.search("[:=]", fields[0])
    return not is_statement and "number" not in map(kind_of, fields)


def _are_units(fields):
    """Return whether all fields are units, or in brackets."""
    return bool(fields) and all(_is_unit(text) for text in fields if text)


def _may_be_units(fields, is_second_of_two):
    """Return whether the last line below a line of names may hold their units."""
    is_any = is_second_of_two or any(map(_is_unit, fields))
    return is_any and not any(map(names_times, fields))


def _is_unit(text):
    return text.strip("[]() ").lower() in UNITS or text[:1] in ("[", "(")


def names_of(
    fields: list[str], n_fields: int, n_filled: int, is_tagged: bool = False
) -> list[str] | None:
    """Return the names of the columns in a line, None if their number does not fit.

    Lines of names and of samples may end with separators. The names may follow a tag,
    and one for comments may come last.
    """
    kinds = {*map(kind_of, fields)}
    if len(fields) == n_fields + 1 and are_texts(kinds):
        has_tag = is_tagged or all_letters(fields[0]) in _TAGS
        return fields[1:] if has_tag else fields
    is_short = len(fields) < max(n_fields if is_tagged else n_filled, 1)
    if is_short or any(fields[n_fields:]) or kinds <= {"number", ""}:
        return None
    return [*fields, *[""] * n_fields][:n_fields]


def split_facts(
    above: list[list[str]], n_filled: int
) -> tuple[list[list[str]], list[list[str]]]:
    """Return the lines above samples without the facts that oscilloscopes append, and these.

    >>> split_facts([["t(s)", "CH1(V)", "t0 = -1s", "tInc = 5e-4", ""]], 2)
    ([['t(s)', 'CH1(V)']], [['t0 = -1s'], ['tInc = 5e-4']])
    >>> split_facts([["X", "CH1", "Increment"], ["Sequence", "V", "5e-4"]], 2)
    ([['X', 'CH1'], ['Sequence', 'V']], [['Increment', '5e-4']])
    """
    surplus = [[text for text in fields[n_filled:] if text] for fields in above[-2:]]
    if not surplus or not surplus[-1]:
        return above, []
    if all("=" in text for text in surplus[-1]):
        return [*above[:-1], above[-1][:n_filled]], [[text] for text in surplus[-1]]
    if {*map(kind_of, surplus[-1])} == {"number"} and len(surplus) == 2:
        cut = [fields[:n_filled] for fields in above[-2:]]
        return [*above[:-2], *cut], [[*pair] for pair in zip(*surplus, strict=False)]
    return above, []


def stated_rates(rows: Iterable[list[str]]) -> dict[str, float]:
    """Return the sampling rates that lines state, by their names."""
    rates = {}
    for fields in rows:
        match = _STATEMENT.match(";".join(fields[:3]))
        value = number(match[2]) if match else np.nan
        if np.isfinite(value) and value > 0:
            name = match[1]
            # Values of further channels follow that of the first.
            unit = match[3] if np.isnan(number(match[3])) else ""
            unit = (unit_in_name(name) or unit).strip(" []()").lower() or None
            plain = all_letters(re.split(r"[(\[]", name)[0])
            rate = stated_rate(plain, value, unit)
            rates |= {name: rate} if rate else {}
    return rates
