"""From one window after another to a verdict and an alarm."""

from collections import Counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .alarm import CumulativeSumAlarm
from .evidence import FadingEvidence
from .verdict import MonitorVerdict


class VerdictMemory:
    """Evidence and alarm over time, and how many windows of which quality there were.

    Parameters
    ----------
    conditions : list
        Those that windows are of.
    evidence : FadingEvidence
        Adds up what windows state.
    alarm : CumulativeSumAlarm or None
        Counts windows that exceed; None where nobody detects.

    Attributes
    ----------
    qualities : Counter
        Number of windows of each quality.
    """

    qualities: Counter[str]

    def __init__(
        self, conditions: list[Any], evidence: FadingEvidence, alarm: CumulativeSumAlarm | None
    ) -> None:
        self.conditions = conditions
        self.evidence = evidence
        self.alarm = alarm
        self.qualities = Counter()

    def judge(
        self,
        start: int,
        end: float,
        seconds: float,
        quality: str,
        log_probability: NDArray[Any] | None,
        exceeds: bool | None,
    ) -> MonitorVerdict:
        """Verdict after one more window.

        Parameters
        ----------
        start : int
            Place of the window.
        end : float
            Time at its end.
        seconds : float
            Time since the window before.
        quality : str
            Of the window.
        log_probability : ndarray of shape (n_conditions,) or None
            What the window states; None where it says nothing.
        exceeds : bool or None
            Whether it exceeds the detection threshold; None where it says nothing.

        Returns
        -------
        MonitorVerdict
            The verdict.
        """
        self.qualities[quality] += 1
        self.evidence.pass_time(seconds)
        window_verdict = verdict = None
        if log_probability is not None:
            self.evidence.add(log_probability)
            window_verdict = self.conditions[int(log_probability.argmax())]
        if exceeds is not None:
            self.alarm.add(exceeds)
        probability, confidence = self.evidence.probabilities(), np.nan
        if probability is not None:
            best = int(probability.argmax())
            verdict, confidence = self.conditions[best], float(probability[best])
        alarm, level = None, np.nan
        if self.alarm is not None:
            alarm, level = self.alarm.active, self.alarm.sum / self.alarm.limit
        return MonitorVerdict(
            start, end, quality, window_verdict, verdict, confidence, exceeds, alarm, level
        )

    def state(self) -> dict[str, Any]:
        """Everything that the next verdicts depend on, in plain values."""
        return {
            "qualities": dict(self.qualities),
            "evidence": self.evidence.state(),
            "alarm": None if self.alarm is None else self.alarm.state(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on where `state` was taken.

        Raises
        ------
        ValueError
            If the state is not one of such a memory.
        """
        self.evidence.restore(state["evidence"])
        if self.alarm is not None:
            self.alarm.restore(state["alarm"])
        self.qualities = Counter(state["qualities"])
