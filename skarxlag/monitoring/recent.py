"""Evidence of recent windows of a sensor, with weights that fade."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.state import expect
from ..kernels.evidence import combined_score, p_value_score


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
    >>> evidence.fade(2.0)
    >>> evidence.add([0.0])
    >>> evidence.weight, evidence.mean()
    (1.5, array([1.]))
    """

    def __init__(self, n_values: int, half_life: float) -> None:
        self._half_life = half_life
        self.weight: float = 0.0
        self._age = 0.0
        self._sums = np.zeros(n_values)

    def fade(self, seconds: float) -> None:
        """Reduce the weights by the seconds since the last call."""
        kept = 0.5 ** (seconds / self._half_life)
        self.weight *= kept
        self._sums *= kept
        self._age += seconds

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
        return {"weight": self.weight, "age": self._age, "sums": self._sums.tolist()}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a state, or raise a ValueError if its numbers cannot be."""
        n_values = len(self._sums)
        self.weight = float(state["weight"])
        self._age = float(state["age"])
        self._sums = np.array(state["sums"], dtype=np.float64)
        numbers = [self.weight, self._age, *self._sums]
        fits = self._sums.shape == (n_values,) and np.isfinite(numbers).all()
        is_past = self.weight >= 0 and self._age >= 0
        expect(fits and is_past, "evidence", state, f"{n_values} finite sums")


class RecentWindows:
    """Fading evidence and p-values of the windows of a sensor.

    Parameters
    ----------
    n_evidence : int
        Number of values of the evidence of a window.
    half_life : float
        Seconds in which the weight of a window halves.
    """

    def __init__(self, n_evidence: int, half_life: float) -> None:
        self._time = 0.0
        self._evidence = FadingEvidence(n_evidence, half_life)
        self._scores = FadingEvidence(1, half_life)
        self._parts = {"evidence": self._evidence, "p_values": self._scores}

    def move_to(self, time: float) -> None:
        """Reduce the weights of all windows to those at a time; a clock may be set back."""
        for part in self._parts.values():
            part.fade(max(time - self._time, 0.0))
        self._time = time

    def add(self, evidence: NDArray[Any]) -> None:
        """Add the evidence of a window that was diagnosed."""
        self._evidence.add(evidence)

    def add_p_value(self, p_value: float) -> None:
        """Add the p-value of a window, if it is known."""
        if not math.isnan(p_value):
            self._scores.add(p_value_score(p_value))

    def mean(self) -> tuple[NDArray[Any], float] | None:
        """Return mean evidence and sum of weights; None if there are no recent windows."""
        mean = self._evidence.mean()
        return None if mean is None else (mean, self._evidence.weight)

    def p_value(self) -> float:
        """Return the p-value of recent windows; NaN if there are none."""
        mean = self._scores.mean()
        if mean is None:
            return np.nan
        return combined_score(float(mean[0]), self._scores.weight)

    def state(self) -> dict[str, Any]:
        """Return the state in plain values."""
        parts = {name: part.state() for name, part in self._parts.items()}
        return {"time": self._time, **parts}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a state, or raise a ValueError if its numbers cannot be."""
        self._time = float(state["time"])
        expect(math.isfinite(self._time), "time", self._time, "a finite number")
        for name, part in self._parts.items():
            part.restore(state[name])
