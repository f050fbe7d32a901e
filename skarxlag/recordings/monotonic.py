"""Columns that only rise or only fall: times and counts, which are no signal."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Steps from which the direction is judged, and the share of them that must have the
#: same sign. The others are those of a clock or a counter that starts again. Vibration
#: has as many of both.
_FEWEST_STEPS = 64
_ONE_WAY = 0.99


class Direction:
    """Counts of the steps up and down of a signal that comes in blocks.

    Examples
    --------
    >>> direction = Direction()
    >>> for block in np.split(np.arange(1000) % 250 / 20_000, 4):
    ...     direction.add(block)
    >>> direction.is_monotonic
    True
    """

    def __init__(self) -> None:
        self._n_up = self._n_down = 0
        self._last = np.empty(0)

    def add(self, signal: NDArray[Any]) -> None:
        """Count the steps of the next samples, of shape (n_samples,)."""
        for values in (np.append(self._last, signal[:1]), signal):
            # Differences would take as much memory as the block.
            self._n_up += int(np.count_nonzero(values[1:] > values[:-1]))
            self._n_down += int(np.count_nonzero(values[1:] < values[:-1]))
        # Without the copy, one sample would keep the whole block in memory.
        self._last = signal[-1:].copy()

    @property
    def is_monotonic(self) -> bool:
        """True if nearly all steps have the same direction."""
        n_steps = self._n_up + self._n_down
        return (
            n_steps >= _FEWEST_STEPS
            and max(self._n_up, self._n_down) > _ONE_WAY * n_steps
        )
