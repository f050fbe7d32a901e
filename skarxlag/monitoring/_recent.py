"""Evidence of recent windows of a sensor, with weights that fade, and its verdicts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.state import expect
from ..kernels.evidence import combined_score, p_value_score
from ..kernels.fault_orders import N_ORDERS
from ..verdicts.judge import Judge
from ..verdicts.windows import WindowResults
from .verdict import MonitorVerdict


class FadingEvidence:
    r"""Weighted mean of what windows contribute, in which older windows weigh less.

    A window that is t seconds old weighs :math:`2^{-t/T}` with the half-life T.

    Parameters
    ----------
    n_values : int
        Number of values that a window contributes, such as one logarithm for each
        condition.
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

    def __init__(self, n_values: int, half_life: float) -> None:
        self._half_life = half_life
        self.weight = 0.0
        self._time = 0.0
        self._age = 0.0
        self._sums = np.zeros(n_values)

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
        n_values = len(self._sums)
        self.weight = float(state["weight"])
        self._age = float(state["age"])
        self._time = float(state["time"])
        self._sums = np.array(state["sums"], dtype=np.float64)
        numbers = [self.weight, self._age, self._time, *self._sums]
        fits = self._sums.shape == (n_values,) and np.isfinite(numbers).all()
        is_past = self.weight >= 0 and self._age >= 0
        expect(fits and is_past, "evidence", state, f"{n_values} finite sums")


class RecentMeans(NamedTuple):
    """Means over the recent windows of a sensor at one time.

    Parameters
    ----------
    evidence : ndarray of shape (n_evidence,)
        Mean of the evidence.
    n_windows : float
        Sum of the weights.
    contrast : tuple
        With a bearing: mean contrast over orders, sum of weights and speed.
    """

    evidence: np.ndarray
    n_windows: float
    contrast: tuple[Any, ...]


class RecentWindows:
    """Fading evidence, combs and p-values of the windows of a sensor.

    Parameters
    ----------
    judge : Judge
        Judge of the windows.
    half_life : float
        Seconds in which the weight of a window halves.

    Attributes
    ----------
    parts : dict of str to FadingEvidence
        Means that a saved state has to keep.
    """

    def __init__(self, judge: Judge, half_life: float) -> None:
        self._judge = judge
        self._evidence = FadingEvidence(judge.n_evidence, half_life)
        # The speed of the windows is one more value.
        n_values = N_ORDERS + 1 if judge.gathers_combs else 0
        self._contrasts = FadingEvidence(n_values, half_life)
        self._p_values = FadingEvidence(1, half_life)
        self.parts: dict[str, FadingEvidence] = {
            "evidence": self._evidence,
            "contrasts": self._contrasts,
            "p_values": self._p_values,
        }

    def move_to(self, time: float) -> None:
        """Reduce the weights of all windows to those at a time."""
        for part in self.parts.values():
            part.move_to(time)

    def add_p_value(self, p_value: float) -> None:
        """Add the p-value of a window, if it is known."""
        if not math.isnan(p_value):
            self._p_values.add(p_value_score(p_value))

    def add(self, results: WindowResults, row: int) -> None:
        """Add the evidence of a window that was diagnosed."""
        self._evidence.add(results.evidence[row])
        if self._judge.gathers_combs and not np.isnan(results.gathered["rpm"][row]):
            contrast = results.gathered["contrasts"][row]
            self._contrasts.add([*contrast, results.gathered["rpm"][row]])

    def means(self) -> RecentMeans | None:
        """Return the means over all recent windows, None if there are none."""
        evidence = self._evidence.mean()
        if evidence is None:
            return None
        contrast = self._contrast() if self._judge.gathers_combs else ()
        return RecentMeans(evidence, self._evidence.weight, contrast)

    def _contrast(self) -> tuple[Any, ...]:
        """Return mean contrast, sum of weights and speed."""
        mean = self._contrasts.mean()
        if mean is None:
            return np.zeros(N_ORDERS), self._contrasts.weight, np.nan
        return mean[:-1], self._contrasts.weight, mean[-1]

    def p_value(self) -> float:
        """Return the p-value of recent windows; NaN if there are none."""
        mean = self._p_values.mean()
        if mean is None:
            return np.nan
        return combined_score(float(mean[0]), self._p_values.weight)


class JudgedWindow(NamedTuple):
    """Verdict on a window, and what the verdict by recent windows follows from.

    Parameters
    ----------
    verdict : MonitorVerdict
        All but the verdict by recent windows.
    means : RecentMeans or None
        Means over recent windows; None if they give no verdict.
    alarm : bool or None
        Whether windows keep the alarm on.
    """

    verdict: MonitorVerdict
    means: RecentMeans | None
    alarm: bool | None


def with_recent_verdicts(
    judge: Judge, judged: Sequence[JudgedWindow]
) -> list[MonitorVerdict]:
    """Return the verdicts on windows with those by recent windows, named together."""
    with_means = [window for window in judged if window.means is not None]
    if not with_means:
        return [window.verdict for window in judged]
    evidence, n_windows, contrasts = zip(
        *(window.means for window in with_means), strict=True
    )
    alarms = [window.alarm for window in with_means]
    named = iter(
        judge.named(np.array(evidence), np.array(n_windows), alarms, contrasts)
    )
    verdicts = []
    for window in judged:
        verdict = window.verdict
        if window.means is not None:
            by_recent = next(named)
            verdict = verdict._replace(
                verdict=by_recent.verdict, probability=by_recent.probability
            )
        verdicts.append(verdict)
    return verdicts
