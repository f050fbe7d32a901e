"""Checks of the facts that are saved with a model."""

from __future__ import annotations

from typing import Any

from ._answers import Answers
from ._state import Values
from .verdicts import check_conditions

_TYPES = (str, int, float, type(None))
_SHARE = (lambda v, e: 0 < v < 1, "a number in (0, 1)")

#: Facts with a meaning to the commands: a type or a range, in a list if the fact is a list. Any
#: fact but `conditions` may be None. No row was recorded of some places of faults.
_KNOWN: dict[str, Any] = {
    "diagnoser": str,
    "rows": str,
    "saved": str,
    "healthy": str,
    "conditions": [object],
    "channels": [str | None],
    "train_rpm": [Values((), "above 0")],
    "sampling_rate": Values((), "above 0"),
    "window_length": Values((), "at least 1", "i"),
    "n_channels": Values((), "at least 1", "i"),
    "n_windows": [Values((), "at least 0", "i")],
    "n_recordings": [Values((), "at least 0", "i")],
    "bearing": str,
    "false_alarm_rate": Values((), _SHARE),
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
        if name in _KNOWN and value is not None:
            _check_fact(name, value, _KNOWN[name])
    own = {"window_length": can.window_length, "n_channels": can.n_channels}
    for name in own.keys() & facts.keys():
        if None not in (own[name], facts[name]) and facts[name] != own[name]:
            raise ValueError(f"{name}={facts[name]}, but the model was fitted with {own[name]}")
    if "conditions" in facts:
        check_conditions(facts["conditions"] or [], can.conditions)
    if not all(str(name).isprintable() for name in can.conditions or ()):
        raise ValueError(f"conditions {can.conditions} have a character that is not printable")


def _check_fact(name, value, wanted):
    if isinstance(wanted, list):
        if not isinstance(value, list):
            raise ValueError(f"{name}={value!r}, expected a list")
        for entry in value:
            _check_fact(name, entry, wanted[0])
    elif isinstance(wanted, Values):
        wanted.check(None, name, value)
    elif not isinstance(value, wanted):
        raise ValueError(f"{name}={value!r}, expected a text")
