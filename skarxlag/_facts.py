"""Checks of the facts that are saved with a model."""

from __future__ import annotations

import math
from typing import Any

from ._answers import Answers
from .verdicts import check_conditions

_TYPES = (str, int, float, type(None))


def _is_count(value):
    return type(value) is int and value >= 1


def _is_number_of_rows(value):
    # Of a place of a fault that nobody recorded there are none.
    return type(value) is int and value >= 0


def _is_positive(value):
    return type(value) in (int, float) and 0 < value < math.inf


def _is_share(value):
    return type(value) is float and 0 < value < 1


def _is_text(value):
    return isinstance(value, str)


def _list_of(is_entry):
    return lambda value: isinstance(value, list) and all(map(is_entry, value))


#: Facts with a meaning to the commands, their check, and what is expected. All but `conditions` may
#: be None.
_KNOWN = {
    "diagnoser": (_is_text, "a text"),
    "rows": (_is_text, "a text"),
    "saved": (_is_text, "a text"),
    "healthy": (_is_text, "a text"),
    "conditions": (_list_of(lambda v: v is not None), "a list of conditions"),
    "channels": (_list_of(lambda v: v is None or _is_text(v)), "a list of texts"),
    "train_rpm": (_list_of(_is_positive), "a list of speeds above 0"),
    "sampling_rate": (_is_positive, "a number above 0"),
    "window_length": (_is_count, "an integer of at least 1"),
    "n_channels": (_is_count, "an integer of at least 1"),
    "n_windows": (_list_of(_is_number_of_rows), "a list of integers of at least 0"),
    "n_recordings": (_list_of(_is_number_of_rows), "a list of integers of at least 0"),
    "bearing": (_is_text, "a text"),
    "false_alarm_rate": (_is_share, "a number in (0, 1)"),
}


def check_facts(facts: dict[str, Any], can: Answers) -> None:
    """Check that facts are plain, can be true, and agree with the model.

    Parameters
    ----------
    facts : dict
        Facts by name.
    can : Answers
        Description of the model.

    Raises
    ------
    TypeError
        If a fact is not a text, a number, None or a list of these.
    ValueError
        If a fact cannot be true of the model, or has a character that is not printable.
    """
    for name, value in facts.items():
        values = value if isinstance(value, list) else [value]
        wrong = [each for each in values if not isinstance(each, _TYPES)]
        if wrong:
            raise TypeError(
                f"{name}={value!r} holds a {type(wrong[0]).__name__}, expected a text, a number, "
                "None or a list of these"
            )
        # Escape sequences could rewrite what a terminal shows.
        if not all(str(text).isprintable() for text in (name, *values)):
            raise ValueError(f"{name}={value!r} has a character that is not printable")
        is_valid, expected = _KNOWN.get(name, (None, ""))
        may_be_none = value is None and name != "conditions"
        if is_valid is not None and not may_be_none and not is_valid(value):
            raise ValueError(f"{name}={value!r}, expected {expected}")
    for name in ("window_length", "n_channels"):
        own = getattr(can, name)
        if None not in (own, facts.get(name)) and facts[name] != own:
            raise ValueError(f"{name}={facts[name]}, but the model was fitted with {own}")
    if "conditions" in facts:
        check_conditions(facts["conditions"], can.conditions)
    if not all(str(name).isprintable() for name in can.conditions or ()):
        raise ValueError(f"conditions {can.conditions} have a character that is not printable")
