"""Windows of a signal that arrives in blocks, with gaps."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray


def check_count(value: object, least: int = 0) -> int:
    """Return an integer of a saved state.

    Raises
    ------
    ValueError
        If it is no integer, is smaller than `least`, or larger than any number of samples.

    Examples
    --------
    >>> check_count(7)
    7
    """
    if type(value) is not int or not least <= value < 2**62:
        raise ValueError(f"state: {value!r}, expected an integer of at least {least}")
    return value


class WindowStream:
    """Cutter of blocks of any lengths into windows, as if they were one recording.

    Parameters
    ----------
    window_length, hop : int
        Samples in a window, and from the start of one window to the start of the next.
    sampling_rate : float
        In Hz.
    gap_tolerance : float
        Seconds by which the time of a block may differ from the end of the block before. Beyond
        it there is a gap, and a new window starts.

    Attributes
    ----------
    n_samples : int
        Number of samples so far.
    n_gaps, n_steps_back : int
        Number of blocks that began later, and earlier, than expected.
    missing_seconds : float
        Sum over the gaps.
    """

    n_samples: int
    n_gaps: int
    n_steps_back: int
    missing_seconds: float

    def __init__(
        self, window_length: int, hop: int, sampling_rate: float, gap_tolerance: float
    ) -> None:
        self.window_length = window_length
        self.hop = hop
        self.sampling_rate = sampling_rate
        self.gap_tolerance = gap_tolerance
        self.n_samples = self.n_gaps = self.n_steps_back = 0
        self.missing_seconds = 0.0
        self._rest = None
        self._next_start = 0
        self._reference = (0, 0.0)
        self._gap_ahead = 0.0

    def push(
        self, samples: NDArray[Any], time: float | None
    ) -> Iterator[tuple[int, NDArray[Any], float]]:
        """Add a block, and yield the windows that are complete now.

        Parameters
        ----------
        samples : ndarray of float64 of shape (n_channels, n_samples)
            The block.
        time : float or None
            Time of its first sample in seconds; None if it follows the block before.

        Yields
        ------
        start : int
            Number of samples before the first of the windows.
        windows : ndarray of shape (n_windows, n_channels, window_length)
            A view of the samples.
        gap : float
            Missing seconds before the first of them, in addition to the hop.
        """
        if time is not None:
            self._note_time(time)
        self.n_samples += samples.shape[1]
        signal = samples if self._rest is None else np.concatenate([self._rest, samples], axis=1)
        first = self.n_samples - signal.shape[1]
        skipped = self._next_start - first
        n_windows = max((signal.shape[1] - skipped - self.window_length) // self.hop + 1, 0)
        if n_windows > 0:
            views = np.lib.stride_tricks.sliding_window_view(signal, self.window_length, axis=1)
            start, gap, self._gap_ahead = self._next_start, self._gap_ahead, 0.0
            self._next_start += n_windows * self.hop
            yield start, views[:, skipped :: self.hop].transpose(1, 0, 2), gap
        # A view would keep the whole block in memory.
        self._rest = signal[:, min(max(self._next_start - first, 0), signal.shape[1]) :].copy()

    def _note_time(self, time):
        expected = self.time_of(self.n_samples)
        self._reference = (self.n_samples, time)
        if self.n_samples == 0:
            return
        late = time - expected
        if abs(late) <= self.gap_tolerance:
            return
        if late > 0:
            self.n_gaps += 1
            self.missing_seconds += late
            self._gap_ahead += late
        else:
            self.n_steps_back += 1
        self._rest, self._next_start = None, self.n_samples

    def time_of(self, sample: float) -> float:
        """Return the time of a sample in seconds."""
        known, time = self._reference
        return time + (sample - known) / self.sampling_rate

    def state(self) -> dict[str, Any]:
        """Return the state in plain values and one array."""
        names = ("n_samples", "n_gaps", "n_steps_back", "missing_seconds")
        return {name: getattr(self, name) for name in names} | {
            "next_start": self._next_start,
            "reference": list(self._reference),
            "gap_ahead": self._gap_ahead,
            "rest": self._rest,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a state.

        Raises
        ------
        ValueError
            If the state is not one of a stream of such windows.
        """
        rest = state["rest"]
        for name in ("n_samples", "n_gaps", "n_steps_back", "next_start"):
            check_count(state[name])
        check_count(state["reference"][0])
        first = state["n_samples"] - (0 if rest is None else rest.shape[1])
        numbers = [state["missing_seconds"], state["gap_ahead"], *state["reference"]]
        fits = (
            (rest is None or (rest.ndim == 2 and rest.dtype == np.float64))
            and 0 <= first == min(state["next_start"], state["n_samples"])
            and state["next_start"] + self.window_length > state["n_samples"]
            and len(numbers) == 4
            and all(map(math.isfinite, numbers))
            and 0 <= state["reference"][0] <= state["n_samples"]
        )
        if not fits:
            raise ValueError("state: its samples and counts do not fit each other")
        for name in ("n_samples", "n_gaps", "n_steps_back", "missing_seconds"):
            setattr(self, name, state[name])
        self._next_start, self._rest = state["next_start"], rest
        self._reference, self._gap_ahead = tuple(state["reference"]), state["gap_ahead"]
