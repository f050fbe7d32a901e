"""Fault locations of labels, from their names and from the combs of their rows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.fault_locations import (
    FAULT_LOCATIONS,
    FAULTS,
    HEALTHY,
    OWN_LOCATION,
    location_of_label,
    warn_of_own_locations,
)

_HEALTHY = FAULT_LOCATIONS.index(HEALTHY)


class LabelLocations(NamedTuple):
    """Fault locations of labels.

    Parameters
    ----------
    labels : ndarray of shape (n_labels,)
        Labels, sorted.
    locations : ndarray of int of shape (n_labels,)
        Their locations, as indices into
        :data:`skarxlag.core.fault_locations.FAULT_LOCATIONS`, or `OWN_LOCATION`.
    is_healthy : ndarray of bool of shape (n_rows,)
        Rows of healthy labels.
    """

    labels: NDArray[Any]
    locations: NDArray[Any]
    is_healthy: NDArray[np.bool_]

    def classes(self) -> tuple[NDArray[Any], NDArray[Any]]:
        """Return the classes, sorted, and their locations.

        If all rows are healthy and their label is a text, the faults are added to the
        classes.
        """
        is_text = self.labels.dtype.kind in "UO"
        if len(self.labels) > 1 or not is_text or not self.is_healthy.all():
            return self.labels, self.locations
        return np.unique([*FAULTS, self.labels[0]], return_index=True)

    def of_conditions(self) -> dict[Any, str | None]:
        """Return the location of each label, None for a location of its own."""
        names = (*FAULT_LOCATIONS, None)
        return {
            label: names[location]
            for label, location in zip(
                self.labels.tolist(), self.locations, strict=True
            )
        }


def locate_labels(
    labels: NDArray[Any],
    scores: NDArray[Any],
    locations: Mapping[Any, str | None] | None,
    limit: float,
) -> LabelLocations:
    """Return the fault location of each label.

    Parameters
    ----------
    labels : ndarray of shape (n_rows,)
        Label of each row.
    scores : ndarray of shape (n_rows, 3)
        Scores of ball, inner and outer race.
    locations : mapping of label to str or None, or None
        As in `FaultOrderClassifier`.
    limit : float
        Limit of the mean scores of healthy rows, which counts for labels whose location
        is not stated.

    Returns
    -------
    LabelLocations
        Labels and their locations.
    """
    names, index = np.unique(labels, return_inverse=True)
    stated = [
        (locations or {}).get(name, location_of_label(name)) for name in names.tolist()
    ]
    indices = np.array(
        [
            _shown_location(scores[index == number], limit)
            if location is None
            else FAULT_LOCATIONS.index(location)
            for number, location in enumerate(stated)
        ]
    )
    own = names[indices == OWN_LOCATION].tolist()
    warn_of_own_locations(own, locations, ", and their rows show no comb")
    return LabelLocations(names, indices, indices[index] == _HEALTHY)


def _shown_location(scores, limit):
    """Return the location that the rows of a label show."""
    mean = scores.mean(axis=0)
    return int(mean.argmax()) if mean.max() > limit else OWN_LOCATION
