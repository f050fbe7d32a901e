"""Evidence of recent windows of a sensor, with weights that fade."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.state import expect
from ..kernels.evidence import combined_score, p_value_score
from ..kernels.fault_orders import N_ORDERS
from ..verdicts.judge import Judge


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
    """

    def __init__(self, judge: Judge, half_life: float) -> None:
        self._time = 0.0
        # The speed of the windows is one more value of the combs.
        sizes = {"evidence": judge.n_evidence, "p_values": 1}
        if judge.gathers_combs:
            sizes["contrasts"] = N_ORDERS + 1
        self._parts = {
            name: FadingEvidence(size, half_life) for name, size in sizes.items()
        }

    def move_to(self, time: float) -> None:
        """Reduce the weights of all windows to those at a time; a clock may be set back."""
        for part in self._parts.values():
            part.fade(max(time - self._time, 0.0))
        self._time = time

    def add(self, evidence: NDArray[Any], gathered: dict[str, Any], row: int) -> None:
        """Add the evidence of a window that was diagnosed, and its combs at a known speed."""
        self._parts["evidence"].add(evidence[row])
        if "contrasts" in self._parts and not np.isnan(gathered["rpm"][row]):
            values = [*gathered["contrasts"][row], gathered["rpm"][row]]
            self._parts["contrasts"].add(values)

    def add_p_value(self, p_value: float) -> None:
        """Add the p-value of a window, if it is known."""
        if not math.isnan(p_value):
            self._parts["p_values"].add(p_value_score(p_value))

    def means(self) -> RecentMeans | None:
        """Return the means over all recent windows, None if there are none."""
        evidence = self._parts["evidence"]
        mean = evidence.mean()
        if mean is None:
            return None
        contrast: tuple[Any, ...] = ()
        if "contrasts" in self._parts:
            combs = self._parts["contrasts"]
            values = combs.mean()
            if values is None:
                values = np.append(np.zeros(N_ORDERS), np.nan)
            contrast = values[:-1], combs.weight, values[-1]
        return RecentMeans(mean, evidence.weight, contrast)

    def p_value(self) -> float:
        """Return the p-value of recent windows; NaN if there are none."""
        scores = self._parts["p_values"]
        mean = scores.mean()
        return np.nan if mean is None else combined_score(float(mean[0]), scores.weight)

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
