"""Evidence of recent windows of a sensor, with weights that fade."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ..kernels.evidence import combined_score, p_value_score
from ..kernels.fault_orders import N_ORDERS
from ..verdicts.judge import Judge
from ..verdicts.windows import WindowResults
from ._memory import FadingEvidence


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
            contrast, rpm = results.gathered["contrasts"], results.gathered["rpm"]
            self._contrasts.add([*contrast[row], rpm[row]])

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
