"""Windows of a signal that arrives in blocks, with gaps."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

_COUNTS = ("n_samples", "next_start", "n_gaps", "n_steps_back")


def check_count(value: object) -> int:
    """Return an integer of a saved state, or raise a ValueError.

    Examples
    --------
    >>> check_count(7)
    7
    """
    if type(value) is not int or not 0 <= value < 2**62:
        raise ValueError(f"{value!r}, expected an integer of at least 0")
    return value


class WindowStream:
    """Cutter of blocks of any lengths into windows, as if they were one recording.

    Parameters
    ----------
    n_rows : int
        Rows of a block.
    window_length, hop : int
        Samples in a window, and from the start of one window to the start of the next.
    sampling_rate : float
        In Hz.
    gap_tolerance : float
        Seconds by which the time of a block may differ from the end of the block before. Beyond
        it there is a gap, and a new window starts.

    Attributes
    ----------
    rest : ndarray of shape (n_rows, n_waiting)
        Samples of the incomplete window.
    n_samples : int
        Number of samples so far.
    next_start : int
        Number of samples before the next window.
    n_gaps, n_steps_back : int
        Number of blocks that began later, and earlier, than expected.
    missing_seconds : float
        Sum over the gaps.
    """

    rest: NDArray[Any]
    n_samples: int
    next_start: int
    n_gaps: int
    n_steps_back: int
    missing_seconds: float

    def __init__(
        self, n_rows: int, window_length: int, hop: int, sampling_rate: float, gap_tolerance: float
    ) -> None:
        self._length, self._hop = window_length, hop
        self._rate, self._tolerance = sampling_rate, gap_tolerance
        self.rest = np.empty((n_rows, 0))
        self.n_samples = self.next_start = self.n_gaps = self.n_steps_back = 0
        self.missing_seconds = 0.0
        # The sample whose time is known, and its time.
        self._reference = (0, 0.0)

    def push(self, block: NDArray[Any], time: float | None) -> tuple[int, NDArray[Any]]:
        """Add a block, and return the windows that are complete now.

        Parameters
        ----------
        block : ndarray of float64 of shape (n_rows, n_samples)
            The block.
        time : float or None
            Time of its first sample in seconds; None if it follows the block before.

        Returns
        -------
        start : int
            Number of samples before the first of the windows.
        windows : ndarray of shape (n_windows, n_rows, window_length)
            A view of the samples.
        """
        if time is not None:
            self._note_time(time)
        signal = np.concatenate([self.rest, block], axis=1)
        first = self.n_samples - self.rest.shape[1]
        self.n_samples += block.shape[1]
        signal = signal[:, self.next_start - first :]
        start, n_windows = (
            self.next_start,
            max((signal.shape[1] - self._length) // self._hop + 1, 0),
        )
        self.next_start += n_windows * self._hop
        # A view would keep the whole block in memory.
        self.rest = signal[:, n_windows * self._hop :].copy()
        if n_windows == 0:
            return start, np.empty((0, len(signal), self._length))
        views = np.lib.stride_tricks.sliding_window_view(signal, self._length, axis=1)
        return start, views[:, :: self._hop].transpose(1, 0, 2)

    def _note_time(self, time):
        late, is_first = time - self.time_of(self.n_samples), self.n_samples == 0
        self._reference = (self.n_samples, float(time))
        if is_first or abs(late) <= self._tolerance:
            return
        self.n_gaps += late > 0
        self.n_steps_back += late < 0
        self.missing_seconds += max(late, 0.0)
        self.rest, self.next_start = self.rest[:, :0], self.n_samples

    def time_of(self, sample: int) -> float:
        """Return the time of a sample in seconds."""
        known, time = self._reference
        return time + (sample - known) / self._rate

    def state(self) -> dict[str, Any]:
        """Return the state in plain values."""
        return {name: getattr(self, name) for name in _COUNTS} | {
            "missing_seconds": self.missing_seconds,
            "reference": list(self._reference),
            "rest": self.rest.tolist(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a state, or raise a ValueError if its numbers do not fit each other."""
        counts = {name: check_count(state[name]) for name in _COUNTS}
        rest = np.array(state["rest"], dtype=np.float64)
        known, time = state["reference"]
        n_samples, next_start = counts["n_samples"], counts["next_start"]
        fits = (
            rest.ndim == 2
            and len(rest) == len(self.rest)
            and 0 <= n_samples - rest.shape[1] == min(next_start, n_samples)
            and next_start + self._length > n_samples
            and check_count(known) <= n_samples
            and math.isfinite(time)
            and 0 <= state["missing_seconds"] < math.inf
        )
        if not fits:
            raise ValueError("its samples and counts do not fit each other")
        vars(self).update(counts, rest=rest, missing_seconds=state["missing_seconds"])
        self._reference = (known, time)
