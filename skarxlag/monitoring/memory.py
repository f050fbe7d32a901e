"""Memory of a monitor: fading evidence, and an alarm by Page's cumulative sum."""

from collections import Counter
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import softmax

from ..kernels.cumulative_sum import alarm_limit, reference_step
from ..verdicts import combined_score, effective_number, p_value_score


class FadingEvidence:
    r"""Log probabilities of the windows so far, in which older windows weigh less.

    A window that is t seconds old weighs :math:`2^{-t/T}` with the half-life T. The probabilities
    are the softmax of the weighted mean of the logarithms, times the effective number of windows
    (see `effective_number`) at the sum of the weights.

    Parameters
    ----------
    n_conditions : int
        Number of conditions.
    half_life : float
        T in seconds; infinity for no fading.

    Attributes
    ----------
    weight : float
        Sum of the weights of all windows.
    age : float
        Seconds since the last window that was added; infinity before the first.
    """

    weight: float
    age: float

    def __init__(self, n_conditions: int, half_life: float) -> None:
        self.half_life = half_life
        self.weight, self.age = 0.0, np.inf
        self._sums = np.zeros(n_conditions)

    def pass_time(self, seconds: float) -> None:
        """Reduce the weights by the passed time."""
        kept = 0.5 ** (seconds / self.half_life)
        self.weight *= kept
        self._sums *= kept
        self.age += seconds

    def add(self, log_probability: NDArray[Any]) -> None:
        """Add the log probabilities of a window."""
        self._sums += log_probability
        self.weight += 1.0
        self.age = 0.0

    def probabilities(self) -> NDArray[Any] | None:
        """Return the probability of each condition; None if no window is younger than T."""
        mean = self.mean()
        return None if mean is None else softmax(effective_number(self.weight) * mean)

    def mean(self) -> NDArray[Any] | None:
        """Return the weighted means; None if no window is younger than T."""
        if self.weight == 0.0 or self.age > self.half_life:
            return None
        return self._sums / self.weight

    def state(self) -> dict[str, Any]:
        """Return the state in plain values."""
        return {"weight": self.weight, "age": self.age, "sums": self._sums.tolist()}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a state.

        Raises
        ------
        ValueError
            If the state has other conditions, or numbers that cannot be.
        """
        sums = np.asarray(state["sums"], dtype=np.float64)
        if sums.shape != self._sums.shape or not (
            np.all(np.isfinite(sums)) and 0 <= state["weight"] < np.inf and state["age"] >= 0
        ):
            raise ValueError(
                f"state: evidence {state!r}, expected finite sums for {len(self._sums)} conditions"
            )
        self.weight, self.age, self._sums = state["weight"], state["age"], sums


class FadingPValue:
    """P-values of the windows so far as one, in which older windows weigh less.

    Stouffer's method as in `combined_p_value`, with the weights of `FadingEvidence`.

    Parameters
    ----------
    half_life : float
        In seconds; infinity for no fading.

    Examples
    --------
    >>> from scipy.stats import norm
    >>> deviation = FadingPValue(1.0)
    >>> for p_value in (0.01, 0.01):
    ...     deviation.add(p_value)
    >>> round(deviation.p_value(), 5) == round(combined_score(norm.ppf(0.01), 2), 5)
    True
    """

    pass_time: Callable[[float], None]
    state: Callable[[], dict[str, Any]]
    restore: Callable[[dict[str, Any]], None]

    def __init__(self, half_life: float) -> None:
        self._scores = FadingEvidence(1, half_life)
        self.pass_time, self.state = self._scores.pass_time, self._scores.state
        self.restore = self._scores.restore

    def add(self, p_value: float) -> None:
        """Add the p-value of a window."""
        self._scores.add(p_value_score(p_value))

    def p_value(self) -> float:
        """Return the combined p-value; NaN if no window is younger than the half-life."""
        mean = self._scores.mean()
        if mean is None:
            return np.nan
        return combined_score(float(mean[0]), self._scores.weight)


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
    faulty_rate : float
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
        self, run_length: float, rate: float, persistence: float, faulty_rate: float
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
        """Continue from a state.

        Raises
        ------
        ValueError
            If the sum is beyond the limit.
        """
        if not 0 <= state["sum"] <= self.limit or state["n_raised"] < 0:
            raise ValueError(f"state: alarm {state!r}, expected a sum from 0 to {self.limit}")
        self.sum, self.active = int(state["sum"]), bool(state["active"])
        self.n_raised = int(state["n_raised"])


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


def healthy_windows(counts: Counter[str]) -> dict[str, float]:
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
    >>> healthy_windows(runs_of([False] * 98))
    {'rate': 0.01, 'persistence': 0.5}
    """
    return {
        "rate": (counts["exceeding"] + 1) / (counts["windows"] + 2),
        "persistence": (counts["runs"] + 1) / (counts["followed"] + 2),
    }
