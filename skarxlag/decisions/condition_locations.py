"""Locations of conditions: as numbers, as names, and as answers to a question."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import count
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.fault_locations import (
    FAULT_LOCATIONS,
    FAULTS,
    HEALTHY,
    expect_condition,
    location_of_label,
    warn_of_own_locations,
)


def locate_conditions(
    conditions: Sequence[Any],
    locations: Mapping[Any, str | None] | None,
    healthy: Any,
) -> tuple[NDArray[np.int64], int]:
    """Return the locations of conditions, and the healthy condition.

    Parameters
    ----------
    conditions : sequence of label
        Conditions.
    locations : mapping of label to str or None, or None
        Locations of conditions whose names do not say them; None for a location of its
        own.
    healthy : label or None
        The healthy condition. None: the conditions whose names say that they are
        healthy, of which the first counts for the alarm.

    Returns
    -------
    numbers : ndarray of int of shape (n_conditions,)
        Indices into :data:`skarxlag.core.fault_locations.FAULT_LOCATIONS`. Conditions
        of other locations have larger numbers, one each.
    healthy_index : int
        Index of the healthy condition that counts for the alarm; -1 if there is none.

    Raises
    ------
    ValueError
        If `healthy` is none of the conditions.

    Examples
    --------
    >>> locate_conditions(["IR2", "Normal", "worn"], {"worn": "ball"}, None)
    (array([1, 3, 0]), 1)
    """
    stated = dict(locations or {})
    by_name = {condition: location_of_label(condition) for condition in conditions}
    if healthy is not None:
        expect_condition(healthy, conditions)
        stated[healthy] = HEALTHY
        # A stated healthy condition is the only one, whatever other names say.
        by_name = {
            condition: None if location == HEALTHY else location
            for condition, location in by_name.items()
        }
    names = [stated.get(condition, by_name[condition]) for condition in conditions]
    healthy_index = names.index(HEALTHY) if HEALTHY in names else -1
    if healthy is not None:
        healthy_index = conditions.index(healthy)
    return location_numbers(names), healthy_index


def locations_by_combs(
    labels: NDArray[Any],
    scores: NDArray[Any],
    locations: Mapping[Any, str | None] | None,
    limit: float,
) -> dict[Any, str | None]:
    """Return the location of each label, by its name or else by the combs of its rows.

    Parameters
    ----------
    labels : ndarray of shape (n_rows,)
        Label of each row.
    scores : ndarray of shape (n_rows, 3)
        Scores of ball, inner and outer race.
    locations : mapping of label to str or None, or None
        As in `FaultOrderClassifier`.
    limit : float
        Limit of the mean scores of healthy rows.

    Returns
    -------
    dict of label to str or None
        None for a location of its own. The labels are sorted.
    """
    located = {}
    for label in np.unique(labels).tolist():
        location = (locations or {}).get(label, location_of_label(label))
        mean = scores[labels == label].mean(axis=0)
        if location is None and mean.max() > limit:
            location = FAULTS[mean.argmax()]
        located[label] = location
    own = [label for label, location in located.items() if location is None]
    warn_of_own_locations(own, locations, ", and their rows show no comb")
    return located


def location_numbers(names: Sequence[str | None]) -> NDArray[np.int64]:
    """Return the numbers of locations; None is a location of its own."""
    own_numbers = count(len(FAULT_LOCATIONS))
    return np.array(
        [
            next(own_numbers) if name is None else FAULT_LOCATIONS.index(name)
            for name in names
        ]
    )


def location_names(numbers: NDArray[np.int64]) -> tuple[str | None, ...]:
    """Return the names of locations; None for a condition that is a location of its own."""
    return tuple(
        FAULT_LOCATIONS[number] if number < len(FAULT_LOCATIONS) else None
        for number in numbers.tolist()
    )


def location_answers(numbers: NDArray[np.int64]) -> tuple[NDArray[np.int64], int]:
    """Return locations counted from 0 without a gap, and that of healthy conditions.

    Parameters
    ----------
    numbers : ndarray of int of shape (n_conditions,)
        Numbers of locations.

    Returns
    -------
    answers : ndarray of int of shape (n_conditions,)
        As :func:`skarxlag.kernels.posterior.condition_log_probabilities` takes them.
    healthy : int
        The answer that stands for healthy conditions; -1 if there are none.

    Examples
    --------
    >>> location_answers(np.array([1, 3, 5]))
    (array([0, 1, 2]), 1)
    """
    # NumPy takes longer to find out which of a few numbers are different.
    places = {number: place for place, number in enumerate(sorted({*numbers.tolist()}))}
    answers = np.array([places[number] for number in numbers.tolist()])
    return answers, places.get(FAULT_LOCATIONS.index(HEALTHY), -1)
