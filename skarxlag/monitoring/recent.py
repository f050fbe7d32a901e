"""Evidence of recent windows of a sensor, with weights that fade."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.state import expect


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

    Examples
    --------
    >>> evidence = FadingEvidence(1, half_life=2.0)
    >>> evidence.add([3.0])
    >>> evidence.move_to(2.0)
    >>> evidence.add([0.0])
    >>> evidence.mean()
    (array([1.]), 1.5)
    """

    def __init__(self, n_values: int, half_life: float) -> None:
        self._half_life = half_life
        self._time = 0.0
        self._age = 0.0
        self._weight = 0.0
        self._sums = np.zeros(n_values)

    def move_to(self, time: float) -> None:
        """Reduce the weights to those at a time in seconds; a clock may be set back."""
        seconds = max(time - self._time, 0.0)
        kept = 0.5 ** (seconds / self._half_life)
        self._time = time
        self._age += seconds
        self._weight *= kept
        self._sums *= kept

    def add(self, values: Any) -> None:
        """Add the values of a window."""
        self._sums += values
        self._weight += 1.0
        self._age = 0.0

    def mean(self) -> tuple[NDArray[Any], float] | None:
        """Return weighted means and the sum of the weights.

        None if no window is younger than the half-life.
        """
        if self._weight == 0.0 or self._age > self._half_life:
            return None
        return self._sums / self._weight, self._weight

    def state(self) -> dict[str, Any]:
        """Return the state in plain values."""
        return {
            "time": self._time,
            "age": self._age,
            "weight": self._weight,
            "sums": self._sums.tolist(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a state, or raise a ValueError if its numbers cannot be."""
        n_values = len(self._sums)
        self._time = float(state["time"])
        self._age = float(state["age"])
        self._weight = float(state["weight"])
        self._sums = np.array(state["sums"], dtype=np.float64)
        numbers = [self._time, self._age, self._weight, *self._sums]
        fits = self._sums.shape == (n_values,) and np.isfinite(numbers).all()
        is_past = self._weight >= 0 and self._age >= 0
        expect(fits and is_past, "evidence", state, f"{n_values} finite sums")
