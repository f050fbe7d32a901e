"""Names of the locations of bearing faults, and the location that a label states."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

from ..kernels.fault_orders import FAULTS
from .state import expect
from .validation import warn_user

HEALTHY = "healthy"
#: Verdict on a row whose comb fits two fault locations nearly as well.
NOT_IDENTIFIABLE = "not identifiable"
#: Verdict of combs alone on a row without one, if no healthy recording of the machine is
#: known.
NO_FINDING = "no fault pattern found"
#: Fault locations of classes, by index.
FAULT_LOCATIONS = (*FAULTS, HEALTHY)
#: Index of the location of a class that neither its name nor its rows show.
OWN_LOCATION = len(FAULT_LOCATIONS)
#: Names of conditions that state the fault location. Names of compound faults match
#: two of them.
_NAMES = {
    "healthy": r"(?<![a-z])(?<!no[nt][ _-])(?<!no[ _-])"
    r"(healthy|normal|good|baseline|intact|nominal|ok|okay|undamaged)(?![a-z])"
    r"|^[hn]\d*$|no.?fault",
    "inner": r"inner|inside|^ir|^i\d*$|bpfi|[-+_/&]ir\d*$",
    "outer": r"outer|outside|^or|^o\d*$|bpfo|[-+_/&]or\d*$",
    "ball": r"ball|roller|element|^b\d*$|bsf",
}


def location_of_label(label: Any) -> str | None:
    """Return the fault location that the name of a condition states.

    Parameters
    ----------
    label : object
        A label.

    Returns
    -------
    str or None
        "healthy", "inner", "outer" or "ball"; None for a number, a compound fault, or a
        name that states none of them.

    Examples
    --------
    >>> [location_of_label(name) for name in ("OR5", "Inner race", "B", "Normal", "IR-OR", 3)]
    ['outer', 'inner', 'ball', 'healthy', None, None]
    >>> [location_of_label(name) for name in ("normal_0", "abnormal", "not healthy", "H1")]
    ['healthy', None, None, 'healthy']
    """
    locations = stated_locations(label)
    return locations[0] if len(locations) == 1 else None


def stated_locations(label: Any) -> list[str]:
    """Return all fault locations that the name of a condition states.

    Examples
    --------
    >>> [stated_locations(name) for name in ("OR5", "IR-OR", "KA15", 3)]
    [['outer'], ['inner', 'outer'], [], []]
    """
    if not isinstance(label, str):
        return []
    name = label.strip().lower()
    return [
        location for location, pattern in _NAMES.items() if re.search(pattern, name)
    ]


def warn_of_own_locations(
    conditions: Sequence[Any],
    locations: Mapping[Any, str | None] | None,
    evidence: str = "",
) -> None:
    """Warn of conditions whose fault location is not known.

    Compound faults, whose names state several locations, are not named.

    Parameters
    ----------
    conditions : sequence of label
        Conditions that count as locations of their own.
    locations : mapping of label to str or None, or None
        Stated locations. Conditions in it are not named.
    evidence : str, default=""
        Continuation of the sentence on their names.
    """
    own = [
        name
        for name in conditions
        if name not in (locations or {}) and len(stated_locations(name)) < 2
    ]
    if own:
        warn_user(
            f"The names of the conditions {own} state no fault location{evidence}. Each "
            "counts as a location of its own, which is neither healthy nor a fault of a "
            f'race or an element. State it, for example locations={{{own[0]!r}: "outer"}}.'
        )


def check_locations(locations: Mapping[Any, str | None] | None) -> None:
    """Refuse a mapping of labels to anything but fault locations, or None.

    Examples
    --------
    >>> check_locations({"bad": "cage"})
    Traceback (most recent call last):
        ...
    ValueError: locations['bad'] == 'cage', expected one of ('ball', 'inner', 'outer', 'healthy').
    """
    expected = f"one of {FAULT_LOCATIONS}"
    for label, location in (locations or {}).items():
        is_location = location is None or location in FAULT_LOCATIONS
        expect(is_location, f"locations[{label!r}]", location, expected)


def expect_condition(healthy: Any, conditions: list[Any]) -> None:
    """Refuse a healthy condition that is none of those of the training.

    Examples
    --------
    >>> expect_condition("ok", [0, 1])
    Traceback (most recent call last):
        ...
    ValueError: healthy == 'ok', expected one of the conditions in y: [0, 1]. Ensembles of
    scikit-learn number the sorted conditions: pass the number.
    """
    expected = f"one of the conditions in y: {conditions}"
    if isinstance(healthy, str) and conditions == [*range(len(conditions))]:
        expected += (
            ". Ensembles of scikit-learn number the sorted conditions: pass the number"
        )
    expect(healthy in conditions, "healthy", healthy, expected)
