"""Memory of a monitor: fading evidence, and an alarm by Page's cumulative sum."""

from collections import Counter
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..kernels.cumulative_sum import alarm_limit, reference_step
from .windowing import check_count


class FadingEvidence:
    r"""Weighted mean of what windows contribute, in which older windows weigh less.

    A window that is t seconds old weighs :math:`2^{-t/T}` with the half-life T.

    Parameters
    ----------
    n_values : int
        Number of values that a window contributes, such as one logarithm for each condition.
    half_life : float
        T in seconds; infinity for no fading.

    Attributes
    ----------
    weight : float
        Sum of the weights of all windows.

    Examples
    --------
    >>> evidence = FadingEvidence(1, half_life=2.0)
    >>> evidence.add([3.0])
    >>> evidence.move_to(2.0)
    >>> evidence.add([0.0])
    >>> evidence.weight, evidence.mean()
    (1.5, array([1.]))
    """

    weight: float

    def __init__(self, n_values: int, half_life: float) -> None:
        self._half_life = half_life
        self.weight, self._time, self._age, self._sums = 0.0, 0.0, 0.0, np.zeros(n_values)

    def move_to(self, time: float) -> None:
        """Reduce the weights by the time since the last call; a clock may be set back."""
        passed = max(time - self._time, 0.0)
        kept = 0.5 ** (passed / self._half_life)
        self.weight *= kept
        self._sums *= kept
        self._age += passed
        self._time = time

    def add(self, values: Any) -> None:
        """Add the values of a window."""
        self._sums += values
        self.weight += 1.0
        self._age = 0.0

    def mean(self) -> NDArray[Any] | None:
        """Return the weighted means; None if no window is younger than the half-life."""
        if self.weight == 0.0 or self._age > self._half_life:
            return None
        return self._sums / self.weight

    def state(self) -> dict[str, Any]:
        """Return the state in plain values."""
        numbers = {"weight": self.weight, "age": self._age, "time": self._time}
        return numbers | {"sums": self._sums.tolist()}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a state, or raise a ValueError if its numbers cannot be."""
        weight, age, time = (float(state[name]) for name in ("weight", "age", "time"))
        sums = np.array(state["sums"], dtype=np.float64)
        is_finite = np.isfinite([weight, age, time, *sums]).all()
        if sums.shape != self._sums.shape or not is_finite or min(weight, age) < 0:
            raise ValueError(f"evidence {state!r}, expected {len(self._sums)} finite sums")
        self.weight, self._age, self._time, self._sums = weight, age, time, sums


class CumulativeSumAlarm:
    r"""Alarm if windows exceed the healthy limits more often than healthy windows do.

    Page's cumulative sum (1954) in integers (Reynolds and Stoumbos 1999):

    .. math::

        s \leftarrow \min(\max(s + m - 1, 0), h) \text{ if the window exceeds,} \qquad
        s \leftarrow \max(s - 1, 0) \text{ otherwise.}

    The alarm goes on when s reaches its limit h, and off when s is back at 0: this is its
    hysteresis. h is the smallest limit at which the mean number of healthy windows until an alarm
    is at least the stated one. The windows that exceed may come in runs.

    Parameters
    ----------
    run_length : float
        Mean number of healthy windows between false alarms.
    rate : float
        Share of healthy windows that exceed.
    persistence : float
        Probability that a healthy window exceeds after one that did.
    faulty_rate : float, default=0.5
        Share of windows which exceed that is to be detected soonest.

    Attributes
    ----------
    step, limit : int
        m and h.
    sum : int
        s.
    active : bool
        Whether the alarm is on.
    n_raised : int
        Number of times that it went on.

    References
    ----------
    E. S. Page (1954), "Continuous inspection schemes", Biometrika 41, 100-115.

    M. R. Reynolds and Z. G. Stoumbos (1999), "A CUSUM chart for monitoring a proportion when
    inspecting continuously", Journal of Quality Technology 31(1), 87-108.

    D. Brook and D. A. Evans (1972), "An approach to the probability distribution of cusum run
    length", Biometrika 59(3), 539-549.

    Examples
    --------
    >>> alarm = CumulativeSumAlarm(1e6, rate=0.01, persistence=0.01, faulty_rate=0.5)
    >>> alarm.step, alarm.limit
    (7, 19)
    >>> [alarm.add(exceeds) for exceeds in (True, False, True, True, True, False)]
    [False, False, False, False, True, True]
    """

    step: int
    limit: int
    sum: int
    active: bool
    n_raised: int

    def __init__(
        self, run_length: float, rate: float, persistence: float, faulty_rate: float = 0.5
    ) -> None:
        self.step = reference_step(rate, faulty_rate)
        self.limit = alarm_limit(run_length, self.step, rate, persistence)
        self.sum, self.active, self.n_raised = 0, False, 0

    def add(self, exceeds: bool) -> bool:
        """Add a window, and return whether the alarm is on."""
        change = self.step - 1 if exceeds else -1
        self.sum = min(max(self.sum + change, 0), self.limit)
        if self.sum == self.limit:
            self.n_raised += not self.active
            self.active = True
        elif self.sum == 0:
            self.active = False
        return self.active

    def state(self) -> dict[str, Any]:
        """Return the state in plain values."""
        return {"sum": self.sum, "active": self.active, "n_raised": self.n_raised}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a state, or raise a ValueError if its sum exceeds the limit."""
        if check_count(state["sum"]) > self.limit:
            raise ValueError(f"alarm {state!r}, expected a sum from 0 to {self.limit}")
        self.sum, self.active = state["sum"], bool(state["active"])
        self.n_raised = check_count(state["n_raised"])


def runs_of(exceeds: list[bool]) -> Counter[str]:
    """Count windows that exceed the limits, and how often one follows another.

    Parameters
    ----------
    exceeds : list of bool
        Windows of one recording, in the order of time.

    Returns
    -------
    Counter
        ``windows``; ``exceeding`` ones; ``followed``, exceeding ones that another window follows;
        and ``runs``, those that another exceeding one follows.

    Examples
    --------
    >>> dict(runs_of([False, True, True, False, True]))
    {'windows': 5, 'exceeding': 3, 'followed': 2, 'runs': 1}
    """
    pairs = list(pairwise(exceeds))
    return Counter(
        windows=len(exceeds),
        exceeding=sum(exceeds),
        followed=sum(first for first, _ in pairs),
        runs=sum(first and second for first, second in pairs),
    )


def healthy_shares(counts: Counter[str]) -> dict[str, float]:
    """Estimate rate and persistence of exceeding windows: means of Beta(1, 1) posteriors.

    Parameters
    ----------
    counts : Counter
        Sum of results of `runs_of`.

    Returns
    -------
    dict
        ``rate`` and ``persistence``, as `CumulativeSumAlarm` takes them.

    Examples
    --------
    >>> healthy_shares(runs_of([False] * 98))
    {'rate': 0.01, 'persistence': 0.5}
    """
    return {
        "rate": (counts["exceeding"] + 1) / (counts["windows"] + 2),
        "persistence": (counts["runs"] + 1) / (counts["followed"] + 2),
    }
