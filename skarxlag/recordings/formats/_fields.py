"""Fields of texts: numbers, units, and names of columns."""

import re
from collections import Counter

import numpy as np

_UNIT_IN_NAME = re.compile(r".*[(\[]([^()\[\]]+)[)\]]\s*")


def unit_in_name(name: str) -> str | None:
    """Return the unit in brackets at the end of a name, None if there is none.

    >>> unit_in_name("time (ms)")
    'ms'
    """
    match = _UNIT_IN_NAME.fullmatch(name)
    return match and match[1]


def is_number(field: str, decimal: str) -> bool:
    """Whether a field holds a number, or nothing."""
    return field.lower() in ("", "nan") or not np.isnan(number(field, decimal))


def number(field: str, decimal: str = ",") -> float:
    """Return the number in a field, with the point or `decimal`; NaN if there is none."""
    try:
        # Python takes 1_000 for a number.
        return float(field.replace(decimal, ".").replace("_", "no number"))
    except ValueError:
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
