"""Choice of the name of a verdict, given the probabilities of conditions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.capabilities import Capabilities
from ..core.fault_locations import HEALTHY, NOT_IDENTIFIABLE
from ..core.state import expect

#: Verdict on a recording whose healthy limits are exceeded and whose condition cannot
#: be named.
CHANGED = "changed"
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


def check_conditions(conditions: Sequence[Any], known: Sequence[Any] | None) -> None:
    """Check the conditions that a user states for a model.

    Parameters
    ----------
    conditions : sequence of label
        Stated conditions.
    known : sequence of label or None
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
    is_whole = np.ndim(conditions) == 1 and len(conditions) == len(known or [HEALTHY])
    is_whole = is_whole and (known is None or {*conditions} == {*known})
    expected = (
        "the healthy one only" if known is None else f"a permutation of {list(known)}"
    )
    expect(is_whole, "conditions", conditions, expected)
    verdicts = (CHANGED, UNKNOWN, UNCERTAIN, NO_SIGNAL, NOT_IDENTIFIABLE)
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


class VerdictNames:
    """Names of the verdicts of a classifier.

    The conditions of a bearing's location are named by the location: "inner race". Which of
    them it is, such as the size of a crack, holds for the recorded specimens only. So
    it is stated as a resemblance, unless `fit` had at least two specimens of each
    condition of the location. A location with one condition has the name of that condition.

    Parameters
    ----------
    conditions : list of label
        Conditions, in the order of their probabilities.
    healthy : label or None
        The healthy condition.
    known : Capabilities
        Description of the classifier.

    Attributes
    ----------
    names : list of label
        Verdicts that name a condition or a location.
    """

    def __init__(
        self, conditions: list[Any], healthy: Any, known: Capabilities
    ) -> None:
        self.conditions = conditions
        order = [] if known.conditions is None else known.conditions
        #: Whether the probabilities answer the questions about the fault and its location.
        self._has_locations = known.locations is not None
        locations = dict(
            zip(order, known.locations or len(order) * [None], strict=True)
        )
        counts = dict(zip(order, known.n_specimens or len(order) * [1], strict=True))
        groups: dict[Any, list[int]] = {}
        for index, name in enumerate(conditions):
            location = HEALTHY if name == healthy else locations.get(name)
            groups.setdefault(
                ("condition", name) if location is None else location, []
            ).append(index)
        self._members = list(groups.values())
        self._locations = list(groups)
        self._healthy = self._locations.index(HEALTHY) if HEALTHY in groups else None
        self._states_condition = [
            len(own) == 1 or all(counts[conditions[i]] > 1 for i in own)
            for own in self._members
        ]
        self._titles = [
            conditions[own[0]]
            if len(own) == 1
            else _TITLES.get(location, healthy or HEALTHY)
            for location, own in groups.items()
        ]
        self.names: list[Any] = []
        for title, own, states in zip(
            self._titles, self._members, self._states_condition, strict=True
        ):
            self.names += [conditions[i] for i in own] if states else [title]

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
            return Named(self.conditions[best], float(probability[best]), None)
        # NumPy takes several times as long to sum so few numbers.
        of_conditions = probability.tolist()
        of_groups = [sum(of_conditions[i] for i in own) for own in self._members]
        healthy = 0.0 if self._healthy is None else of_groups[self._healthy]
        faulty = sum(of_groups) - healthy
        if unknown > max(healthy, faulty):
            return Named(UNKNOWN, float(unknown), str(self.conditions[best]))
        if self._healthy is not None and healthy >= faulty:
            return self._named_in(self._healthy, of_conditions)
        of_faults = of_groups.copy()
        if self._healthy is not None:
            of_faults[self._healthy] = -1.0
        order = sorted(range(len(of_faults)), key=of_faults.__getitem__, reverse=True)
        first, *others = order
        second = others[0] if others else first
        is_location = (
            self._locations[first] in _TITLES and self._locations[second] in _TITLES
        )
        if is_location and of_faults[first] < _SURE_LOCATION * faulty:
            shown = [g for g in (first, second) if of_faults[g] > 0]
            parts = [f"{self._titles[g]} {of_faults[g]:.0%}" for g in shown]
            return Named(UNCERTAIN, faulty, ", ".join(parts))
        return self._named_in(first, of_conditions)

    def _named_in(self, group, probability):
        members = self._members[group]
        best = max(members, key=probability.__getitem__)
        if self._states_condition[group]:
            return Named(self.conditions[best], probability[best], None)
        total = sum(probability[i] for i in members)
        share = probability[best] / total if total > 0 else 0.0
        return Named(self._titles[group], total, f"{self.conditions[best]} {share:.0%}")
