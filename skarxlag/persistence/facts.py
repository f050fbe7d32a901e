"""Checks of the facts that are saved with a model."""

from typing import Any

from ..core.capabilities import Capabilities
from ..core.state import check_number, expect
from ..verdicts.names import check_conditions

_ABOVE_0 = ("above 0", float)
#: Facts with a meaning to the commands, by their type, or range and type. Any of them
#: but `conditions` may be None.
_SINGLE_FACTS: dict[str, Any] = {
    "diagnoser": str,
    "rows": str,
    "saved": str,
    "healthy": str,
    "bearing": str,
    "unit": str,
    "window_length": ("at least 1", int),
    "n_channels": ("at least 1", int),
    "sampling_rate": _ABOVE_0,
    "false_alarm_rate": ("above 0 and below 1", float),
    "false_alarm_events": ("at least 0", int),
}
#: The same of facts that are lists. No row was recorded of some locations of faults.
_LISTS: dict[str, Any] = {
    "conditions": object,
    "channels": str | None,
    "channel_names": str,
    "loads": str,
    "specimens": str,
    "campaigns": str,
    "error_rates": str,
    "n_windows": ("at least 0", int),
    "n_recordings": ("at least 0", int),
    "train_rpm": _ABOVE_0,
}


def check_facts(facts: dict[str, Any], described: Capabilities) -> None:
    """Check that facts are plain, can be true, and agree with the model.

    Raises
    ------
    TypeError
        If a fact is of another type than those that `save_diagnoser` takes.
    ValueError
        If a fact cannot be true, or contradicts the model.
    """
    for name, value in facts.items():
        _check_fact(name, value)
    _check_agreement(facts, described)
    names = described.conditions or ()
    is_printable = all(str(name).isprintable() for name in names)
    expect(is_printable, "conditions", names, "printable characters")


def _check_fact(name, value):
    entries = value if isinstance(value, list) else [value]
    for entry in entries:
        if not isinstance(entry, str | int | float | None):
            raise TypeError(
                f"{name}={value!r} holds a {type(entry).__name__}, expected a text, "
                "number, None or a list of these"
            )
    # Escape sequences could rewrite what a terminal shows.
    is_printable = all(str(text).isprintable() for text in (name, *entries))
    expect(is_printable, name, value, "printable characters")
    if value is None:
        return
    if name in _LISTS:
        expect(isinstance(value, list), name, value, "a list")
    elif name in _SINGLE_FACTS:
        expect(not isinstance(value, list), name, value, "one value")
    expected = (_LISTS | _SINGLE_FACTS).get(name, object)
    for entry in entries:
        if isinstance(expected, tuple):
            check_number(name, entry, *expected)
        else:
            expect(isinstance(entry, expected), name, entry, "a text")


def _check_agreement(facts, described):
    """Check the facts that follow from the model."""
    for name in ("window_length", "n_channels"):
        fitted = getattr(described, name)
        stated = facts.get(name)
        agrees = fitted is None or stated in (None, fitted)
        expect(agrees, name, stated, f"{fitted} as in fit")
    n_conditions = len(described.conditions or ["healthy"])
    lengths = {
        "n_windows": n_conditions,
        "n_recordings": n_conditions,
        "channels": described.n_channels,
    }
    for name, length in lengths.items():
        stated = facts.get(name)
        expect(len(stated or ()) in (0, length), name, stated, f"{length} entries")
    conditions = facts.get("conditions", [described.healthy])
    if "conditions" in facts:
        check_conditions(conditions or [], described.conditions)
    healthy = facts.get("healthy")
    expected = f"{conditions[0]!r}, the first of conditions"
    expect(healthy in (None, conditions[0]), "healthy", healthy, expected)
