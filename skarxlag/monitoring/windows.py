"""Windows of a sensor, cut from blocks with gaps."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd
from numpy.lib.stride_tricks import as_strided
from numpy.typing import ArrayLike, NDArray

from ..core.speeds import speeds_of_rows
from ..core.state import expect
from ..core.validation import as_samples

_COUNTS = ("n_samples", "next_start", "n_gaps", "n_steps_back")


def saved_count(value: Any) -> int:
    """Return an integer of a saved state, or raise a ValueError.

    Examples
    --------
    >>> saved_count(7)
    7
    """
    expect(
        type(value) is int and 0 <= value < 2**62,
        "count",
        value,
        "an integer of at least 0",
    )
    return value


class WindowStream:
    """Cutter of blocks of any lengths into windows, as if they were one recording.

    Parameters
    ----------
    n_rows : int
        Rows of a block.
    length, hop : int
        Samples in a window, and from one window to the next.
    rate : float
        Sampling rate in Hz.

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

    def __init__(self, n_rows: int, length: int, hop: int, rate: float) -> None:
        self._length = length
        self._hop = hop
        self._rate = rate
        self.rest: NDArray[Any] = np.empty((n_rows, 0))
        self.n_samples: int = 0
        self.next_start: int = 0
        self.n_gaps: int = 0
        self.n_steps_back: int = 0
        self.missing_seconds: float = 0.0
        # A sample whose time is stated, and its time.
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
            self.note_time(float(time))
        signal = np.concatenate([self.rest, block], axis=1)
        first = self.n_samples - self.rest.shape[1]
        self.n_samples += block.shape[1]
        signal = signal[:, self.next_start - first :]
        start = self.next_start
        n_windows = max((signal.shape[1] - self._length) // self._hop + 1, 0)
        self.next_start += n_windows * self._hop
        # A view would keep the whole block in memory.
        self.rest = signal[:, n_windows * self._hop :].copy()
        # NumPy's view of all windows takes as long to make as a window to be cut.
        of_row, of_sample = signal.strides
        shape = (n_windows, len(signal), self._length)
        strides = (self._hop * of_sample, of_row, of_sample)
        return start, as_strided(signal, shape, strides, writeable=False)

    def note_time(self, time: float) -> None:
        """State the time of the next sample; if it is not as expected, windows start again."""
        delay = time - self.time_of(self.n_samples)
        self._reference = (self.n_samples, time)
        # The stated time of a block may be wrong by half a window.
        if self.n_samples == 0 or abs(delay) <= 0.5 * self._length / self._rate:
            return
        self.n_gaps += delay > 0
        self.n_steps_back += delay < 0
        self.missing_seconds += max(delay, 0.0)
        self.rest = self.rest[:, :0]
        self.next_start = self.n_samples

    def time_of(self, sample: int) -> float:
        """Return the time of a sample in seconds."""
        timed_sample, time = self._reference
        return time + (sample - timed_sample) / self._rate

    def state(self) -> dict[str, Any]:
        """Return the state in plain values."""
        counts = {name: getattr(self, name) for name in _COUNTS}
        return counts | {
            "missing_seconds": self.missing_seconds,
            "reference": list(self._reference),
            "rest": self.rest.tolist(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a state, or raise a ValueError if its numbers do not fit each other."""
        for name in _COUNTS:
            setattr(self, name, saved_count(state[name]))
        timed_sample, time = state["reference"]
        n_rows = len(self.rest)
        self._reference = (timed_sample, time)
        self.missing_seconds = state["missing_seconds"]
        self.rest = np.array(state["rest"], dtype=np.float64)
        fits = (
            self.rest.ndim == 2
            and len(self.rest) == n_rows
            and self.rest.shape[1] == max(self.n_samples - self.next_start, 0)
            and self.next_start + self._length > self.n_samples
            and saved_count(timed_sample) <= self.n_samples
            and math.isfinite(time)
            and 0 <= self.missing_seconds < 1e300
        )
        expect(fits, "samples", state, "samples and counts that fit each other")


def checked_samples(samples: ArrayLike, n_channels: int) -> NDArray[Any]:
    """Return samples of shape (n_channels, n_samples), or raise a ValueError."""
    signal = np.asarray(as_samples(samples, "samples"))
    if signal.ndim == 1 and (n_channels == 1 or signal.size == 0):
        signal = signal.reshape(n_channels, -1)
    fits = signal.ndim == 2 and len(signal) == n_channels
    expected = (
        f"{n_channels} channels as in fit: "
        f"real numbers of shape ({n_channels}, n_samples)"
    )
    shown = f"{signal.dtype} of shape {signal.shape}"
    expect(fits and signal.dtype.kind in "iuf", "samples", shown, expected)
    return signal


def speeds_of_samples(
    rpm: ArrayLike, n_samples: int, before: float
) -> NDArray[np.float64]:
    """Return the speed at each sample.

    Parameters
    ----------
    rpm : float or array-like of shape (n_samples,)
        Revolutions per minute; NaN within an array is the speed before.
    n_samples : int
        Number of samples.
    before : float
        Speed before the first sample.

    Returns
    -------
    ndarray of shape (n_samples,)
        Speeds; NaN if a speed is not known.

    Examples
    --------
    >>> speeds_of_samples([float("nan"), 910.0, float("nan")], 3, 900.0)
    array([900., 910., 910.])
    """
    speeds = speeds_of_rows(rpm, n_samples)
    expected = f"one number, or one for each of {n_samples} samples"
    expect(speeds.shape == (n_samples,), "rpm", rpm, expected)
    if np.ndim(rpm) == 0:
        return speeds
    return pd.Series([before, *speeds]).ffill().to_numpy()[1:]
