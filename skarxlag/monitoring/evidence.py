"""What windows say of the condition, with the past slowly forgotten."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import softmax


class FadingEvidence:
    r"""Mean log probability of the windows so far, in which older windows count less.

    A window that is t seconds old weighs :math:`2^{-t/T}`, where T is the half-life. As in
    `recording_verdict` the probabilities are the softmax of the weighted *mean* of the logarithms:
    what one typical window of late states. Windows of one machine share its specimen and mounting,
    and a sum would count them as independent witnesses.

    Parameters
    ----------
    n_conditions : int
        Number of conditions.
    half_life : float
        Seconds; infinity forgets nothing.

    Attributes
    ----------
    weight : float
        Weight of all windows, in windows of age 0.
    age : float
        Seconds since the last window that said something; infinity before the first.
    """

    weight: float
    age: float

    def __init__(self, n_conditions: int, half_life: float) -> None:
        self.half_life = half_life
        self.weight, self.age = 0.0, np.inf
        self._sums = np.zeros(n_conditions)

    def pass_time(self, seconds: float) -> None:
        """Let the evidence so far grow older."""
        kept = 0.5 ** (seconds / self.half_life)
        self.weight *= kept
        self._sums *= kept
        self.age += seconds

    def add(self, log_probability: NDArray[Any]) -> None:
        """Take what a window states now."""
        self._sums += log_probability
        self.weight += 1.0
        self.age = 0.0

    def probabilities(self) -> NDArray[Any] | None:
        """Probability of each condition; None before the first window, or when all is stale.

        Evidence is stale when no window has said anything for longer than the half-life.
        """
        if self.weight == 0.0 or self.age > self.half_life:
            return None
        return softmax(self._sums / self.weight)

    def state(self) -> dict[str, Any]:
        """Everything that the next verdicts depend on, in plain values."""
        return {"weight": self.weight, "age": self.age, "sums": self._sums.tolist()}

    def restore(self, state: dict[str, Any]) -> None:
        """Go on where `state` was taken.

        Raises
        ------
        ValueError
            If the state is that of other conditions, or not of numbers that can be.
        """
        sums = np.asarray(state["sums"], dtype=np.float64)
        if sums.shape != self._sums.shape or not (
            np.all(np.isfinite(sums)) and 0 <= state["weight"] < np.inf and state["age"] >= 0
        ):
            raise ValueError(
                f"state: evidence {state!r}, expected finite sums for {len(self._sums)} conditions"
            )
        self.weight, self.age, self._sums = state["weight"], state["age"], sums
