"""An alarm with memory: Page's cumulative sum over windows."""

from collections import Counter
from itertools import pairwise
from typing import Any

from ..kernels.cumulative_sum import alarm_limit, reference_step


class CumulativeSumAlarm:
    r"""Alarm when windows exceed the detection threshold more often than healthy ones do.

    Page's cumulative sum (1954) of windows that exceed and of windows that do not, in whole numbers
    (Reynolds and Stoumbos 1999):

    .. math::

        s \leftarrow \min(\max(s + m - 1, 0), h) \text{ if the window exceeds,} \qquad
        s \leftarrow \max(s - 1, 0) \text{ otherwise.}

    The alarm goes on when s reaches its limit h, and off when s is back at 0: between them it keeps
    its state, which is its hysteresis. h is the smallest limit for which healthy windows take at
    least the stated number of windows in the mean until they raise an alarm; windows that exceed
    are allowed to come in runs.

    Parameters
    ----------
    run_length : float
        Mean number of healthy windows between false alarms.
    rate : float
        Share of healthy windows that exceed.
    persistence : float
        Probability that a healthy window exceeds after one that did.
    faulty_rate : float
        Share of windows which exceed that the alarm shall find soonest.

    Attributes
    ----------
    step, limit : int
        m and h.
    sum : int
        s.
    active : bool
        Whether the alarm is on.
    n_raised : int
        How often it went on.

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
        """Take a window, and say whether the alarm is on."""
        change = self.step - 1 if exceeds else -1
        self.sum = min(max(self.sum + change, 0), self.limit)
        if self.sum == self.limit:
            self.n_raised += not self.active
            self.active = True
        elif self.sum == 0:
            self.active = False
        return self.active

    def state(self) -> dict[str, Any]:
        """Everything that the next windows depend on, in plain values."""
        return {"sum": self.sum, "active": self.active, "n_raised": self.n_raised}

    def restore(self, state: dict[str, Any]) -> None:
        """Go on where `state` was taken.

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
    """Counts that tell how often windows exceed, and in what runs.

    Parameters
    ----------
    exceeds : list of bool
        Windows of one recording, in the order of time.

    Returns
    -------
    Counter
        ``windows``; ``exceeding`` ones; those of them that another window follows, ``followed``;
        and those that another one follows which exceeds, ``runs``.

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


def healthy_windows(counts: Counter[str]) -> dict[str, Any]:
    """Rate and persistence of windows that exceed, means of Beta(1, 1) posteriors.

    Parameters
    ----------
    counts : Counter
        Sum of what `runs_of` gave.

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
