"""Choice of the name of a verdict, given the probabilities of conditions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.capabilities import Capabilities
from ..core.fault_locations import HEALTHY, NO_FINDING, NOT_IDENTIFIABLE
from ..core.state import expect

#: Verdict on a recording whose healthy limits are exceeded and whose condition cannot
#: be named.
CHANGED = "changed"
#: Verdict on recent windows that exceed the healthy limits, but not yet for so long that
#: there is an alarm.
POSSIBLY_CHANGED = "possibly changed"
#: Verdict on a recording that resembles none of the conditions.
UNKNOWN = "unknown condition"
#: Verdict on a recording of a fault whose location cannot be named.
UNCERTAIN = "faulty, location uncertain"
#: Verdict on a window, or on a recording, that carries no signal.
NO_SIGNAL = "no signal"
#: Prefix of the verdict on a recording that cannot be judged; a colon and the reason
#: follow.
NO_VERDICT = "no verdict"
#: Titles of locations.
_TITLES = {"ball": "rolling element", "inner": "inner race", "outer": "outer race"}
#: Share of a location among all faults from which on it is named.
_SURE_LOCATION = 0.75


def no_verdict(reason: object) -> str:
    """Return the verdict on a recording that cannot be judged."""
    return f"{NO_VERDICT}: {' '.join(str(reason).split())}"


def check_conditions(conditions: Sequence[Any], fitted: Sequence[Any] | None) -> None:
    """Check the conditions that a user states for a model.

    Parameters
    ----------
    conditions : sequence of label
        Stated conditions.
    fitted : sequence of label or None
        Conditions of the model. None for a detector, which has the healthy one only.

    Raises
    ------
    ValueError
        If they are no permutation of those of the model, or one is named like another
        verdict.

    Examples
    --------
    >>> check_conditions(["worn"], ["good", "worn"])
    Traceback (most recent call last):
        ...
    ValueError: conditions == ['worn'], expected a permutation of ['good', 'worn'].
    """
    # A set has no order, and no axis.
    n_fitted = len(fitted or [HEALTHY])
    is_whole = np.ndim(conditions) == 1 and len(conditions) == n_fitted
    expected = "the healthy one only"
    if fitted is not None:
        is_whole = is_whole and {*conditions} == {*fitted}
        expected = f"a permutation of {list(fitted)}"
    expect(is_whole, "conditions", conditions, expected)
    verdicts = (
        *(CHANGED, POSSIBLY_CHANGED, UNKNOWN, UNCERTAIN, NO_FINDING, NO_SIGNAL),
        NOT_IDENTIFIABLE,
    )
    for name in map(str, conditions):
        folded = name.casefold()
        is_verdict = folded in verdicts or folded.startswith(NO_VERDICT)
        expect(
            not is_verdict,
            "condition",
            name,
            "another name: this one is a verdict of its own",
        )


class Named(NamedTuple):
    """Verdict, its probability, and the conditions that it resembles.

    Parameters
    ----------
    verdict : label
        A condition, the title of a location, `UNKNOWN`, or `UNCERTAIN`.
    probability : float
        Of the verdict.
    most_like : str or None
        The most similar condition of a location with several, or the probabilities of the
        locations of a fault whose location is uncertain. None if there is nothing to add.
    """

    verdict: Any
    probability: float
    most_like: str | None


class _Group(NamedTuple):
    """Conditions of one location, or a condition that is a location of its own.

    Attributes
    ----------
    location : object
        The location.
    members : list of int
        Positions of the conditions.
    title : label
        Name of a verdict on the location.
    states_condition : bool
        Whether a verdict names the condition.
    """

    location: Any
    members: list[int]
    title: Any
    states_condition: bool


class VerdictNames:
    """Names of the verdicts of a classifier.

    The conditions of a bearing's location are named by the location: "inner race". Which of
    them it is, such as the size of a crack, holds for the recorded specimens only. So
    it is stated as a resemblance, unless `fit` had at least two specimens of each
    condition of the location. A location with one condition has the name of that condition.
    The healthy condition is named `NO_FINDING` if it rests on no healthy recording.

    Parameters
    ----------
    conditions : list of label
        Conditions, in the order of their probabilities.
    healthy : label or None
        The healthy condition.
    described : Capabilities
        Description of the classifier.

    Attributes
    ----------
    names : list of label
        Verdicts that name a condition or a location.
    """

    def __init__(
        self, conditions: list[Any], healthy: Any, described: Capabilities
    ) -> None:
        self.conditions = conditions
        #: Whether the probabilities answer the questions about the fault and its location.
        self._has_locations = described.locations is not None
        self._groups = _groups(conditions, healthy, described)
        locations = [group.location for group in self._groups]
        self._healthy = locations.index(HEALTHY) if HEALTHY in locations else None
        self.names: list[Any] = []
        for group in self._groups:
            if group.states_condition:
                self.names += [conditions[i] for i in group.members]
            else:
                self.names.append(group.title)
        if not described.healthy_was_recorded:
            self.names = [
                NO_FINDING if name == healthy else name for name in self.names
            ]

    def name(self, probability: NDArray[Any], unknown: float = 0.0) -> Named:
        """Name one row or recording.

        It is decided in this order: unknown or not, healthy or not, location,
        condition. A classifier without locations is named by its most probable
        condition.

        Parameters
        ----------
        probability : ndarray of shape (n_conditions,)
            Of the conditions.
        unknown : float, default=0.0
            Probability of an unknown condition. All of them sum to 1.

        Returns
        -------
        Named
            The verdict.
        """
        best = int(probability.argmax())
        if not self._has_locations:
            return Named(self.names[best], float(probability[best]), None)
        # NumPy takes several times as long to sum so few numbers.
        of_conditions = probability.tolist()
        of_groups = [
            sum([of_conditions[i] for i in group.members]) for group in self._groups
        ]
        healthy = 0.0 if self._healthy is None else of_groups[self._healthy]
        faulty = sum(of_groups) - healthy
        if unknown > max(healthy, faulty):
            return Named(UNKNOWN, float(unknown), str(self.conditions[best]))
        if self._healthy is not None and healthy >= faulty:
            return self._named_in(self._groups[self._healthy], of_conditions)
        of_faults = {
            g: share for g, share in enumerate(of_groups) if g != self._healthy
        }
        nearest = sorted(of_faults, key=of_faults.__getitem__, reverse=True)[:2]
        are_locations = all(self._groups[g].location in _TITLES for g in nearest)
        if are_locations and of_faults[nearest[0]] < _SURE_LOCATION * faulty:
            shares = [
                f"{self._groups[g].title} {of_faults[g]:.0%}"
                for g in nearest
                if of_faults[g] > 0
            ]
            return Named(UNCERTAIN, faulty, ", ".join(shares))
        return self._named_in(self._groups[nearest[0]], of_conditions)

    def _named_in(self, group, probability):
        best = max(group.members, key=probability.__getitem__)
        if group.states_condition:
            return Named(self.conditions[best], probability[best], None)
        total = sum(probability[i] for i in group.members)
        share = probability[best] / total if total > 0 else 0.0
        return Named(group.title, total, f"{self.conditions[best]} {share:.0%}")


def _groups(conditions, healthy, described):
    """Return the conditions by their locations, in the order of their first conditions."""
    fitted = described.conditions
    locations = described.locations or [None] * len(fitted)
    n_specimens = described.n_specimens or [1] * len(fitted)
    locations = dict(zip(fitted, locations, strict=True)) | {healthy: HEALTHY}
    n_specimens = dict(zip(fitted, n_specimens, strict=True))
    members: dict[Any, list[int]] = {}
    for index, name in enumerate(conditions):
        location = locations[name] or ("condition", name)
        members.setdefault(location, []).append(index)
    groups = []
    for location, positions in members.items():
        names = [conditions[i] for i in positions]
        is_single = len(names) == 1
        title = names[0] if is_single else _TITLES.get(location, healthy or HEALTHY)
        has_specimens = all(n_specimens[name] > 1 for name in names)
        groups.append(_Group(location, positions, title, is_single or has_specimens))
    return groups
