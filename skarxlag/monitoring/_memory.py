"""Parts of a monitor that remember: windows of blocks with gaps, fading evidence, and the alarm.

The alarm is Page's cumulative sum.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.state import expect
from ..kernels.cumulative_sum import alarm_limit, mean_run_length, reference_step

_COUNTS = ("n_samples", "next_start", "n_gaps", "n_steps_back")
#: Share of windows which exceed that is to be detected soonest.
_FAULTY_RATE = 0.5


def check_count(value: Any) -> int:
    """Return an integer of a saved state, or raise a ValueError.

    Examples
    --------
    >>> check_count(7)
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
    window_length, hop : int
        Samples in a window, and from the start of one window to the start of the next.
    sampling_rate : float
        In Hz.
    gap_tolerance : float
        Seconds by which the time of a block may differ from the end of the block
        before. Beyond it there is a gap, and a new window starts.

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

    def __init__(
        self,
        n_rows: int,
        window_length: int,
        hop: int,
        sampling_rate: float,
        gap_tolerance: float,
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
            self._note_time(float(time))
        signal = np.concatenate([self.rest, block], axis=1)
        first = self.n_samples - self.rest.shape[1]
        self.n_samples += block.shape[1]
        signal = signal[:, self.next_start - first :]
        start = self.next_start
        n_windows = max((signal.shape[1] - self._length) // self._hop + 1, 0)
        self.next_start += n_windows * self._hop
        # A view would keep the whole block in memory.
        self.rest = signal[:, n_windows * self._hop :].copy()
        if n_windows == 0:
            return start, np.empty((0, len(signal), self._length))
        views = np.lib.stride_tricks.sliding_window_view(signal, self._length, axis=1)
        return start, views[:, :: self._hop].transpose(1, 0, 2)

    def _note_time(self, time):
        late, is_first = time - self.time_of(self.n_samples), self.n_samples == 0
        self._reference = (self.n_samples, time)
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
            and 0 <= state["missing_seconds"] < 1e300
        )
        expect(fits, "samples", state, "samples and counts that fit each other")
        vars(self).update(counts, rest=rest, missing_seconds=state["missing_seconds"])
        self._reference = (known, time)


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
        self.weight, self._time, self._age, self._sums = (
            0.0,
            0.0,
            0.0,
            np.zeros(n_values),
        )

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
        weight, age, time = (float(state[name]) for name in ("weight", "age", "time"))
        sums = np.array(state["sums"], dtype=np.float64)
        fits = (
            sums.shape == self._sums.shape
            and np.isfinite([weight, age, time, *sums]).all()
        )
        expect(
            fits and min(weight, age) >= 0,
            "evidence",
            state,
            f"{len(self._sums)} finite sums",
        )
        self.weight, self._age, self._time, self._sums = weight, age, time, sums


class CumulativeSumAlarm:
    r"""Alarm if windows exceed the healthy limits more often than healthy windows do.

    Page's cumulative sum (1954) in integers (Reynolds and Stoumbos 1999):

    .. math::

        s \leftarrow \min(\max(s + m - 1, 0), h) \text{ if the window exceeds,} \qquad
        s \leftarrow \max(s - 1, 0) \text{ otherwise.}

    The alarm goes on when s reaches its limit h, and off when s is back at 0: this is
    its hysteresis. h is the smallest limit at which the mean number of healthy windows
    until an alarm is at least the stated one. The windows that exceed may come in runs.

    Parameters
    ----------
    run_length : float
        Mean number of healthy windows between false alarms.
    rate : float
        Share of healthy windows that exceed.
    persistence : float
        Probability that a healthy window exceeds after one that did.
    delay : int or None, default=None
        Windows in a row that exceed, after which the alarm goes on. None: by
        `run_length`, which is not used otherwise.

    Attributes
    ----------
    step, limit : int
        m and h.
    delay : int
        Smallest number of windows in a row after which s reaches h from 0.
    sum : int
        s.
    active : bool
        Whether the alarm is on.
    n_raised : int
        Number of times that it went on.

    References
    ----------
    E. S. Page (1954), "Continuous inspection schemes", Biometrika 41, 100-115.

    M. R. Reynolds and Z. G. Stoumbos (1999), "A CUSUM chart for monitoring a proportion
    when inspecting continuously", Journal of Quality Technology 31(1), 87-108.

    D. Brook and D. A. Evans (1972), "An approach to the probability distribution of
    cusum run length", Biometrika 59(3), 539-549.

    Examples
    --------
    >>> alarm = CumulativeSumAlarm(1e6, rate=0.01, persistence=0.01)
    >>> alarm.step, alarm.limit
    (7, 19)
    >>> alarm.delay
    4
    >>> [alarm.add(exceeds) for exceeds in (True, False, True, True, True, False)]
    [False, False, False, False, True, True]
    """

    def __init__(
        self,
        run_length: float,
        rate: float,
        persistence: float,
        delay: int | None = None,
    ) -> None:
        self.step = reference_step(rate, _FAULTY_RATE)
        if delay is None:
            self.limit = alarm_limit(run_length, self.step, rate, persistence)
        else:
            self.limit = delay * (self.step - 1)
        self.delay = -(-self.limit // (self.step - 1))
        self._rates = {"rate": rate, "persistence": persistence}
        self.sum, self.active, self.n_raised = 0, False, 0

    def run_length(self) -> float:
        """Return the mean number of healthy windows until an alarm."""
        return mean_run_length(self.limit, self.step, **self._rates)

    def add(self, exceeds: bool) -> bool:
        """Add a window, and return whether the alarm is on."""
        change = self.step - 1 if exceeds else -1
        self.sum = min(max(self.sum + change, 0), self.limit)
        if self.sum == self.limit:
            self.n_raised += not self.active
            self.active = True
        elif self.sum == 0:
            self.active = False
        return self.active

    def state(self) -> dict[str, Any]:
        """Return the state in plain values."""
        return {"sum": self.sum, "active": self.active, "n_raised": self.n_raised}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a state, or raise a ValueError if its sum exceeds the limit."""
        self.sum, self.n_raised = (
            check_count(state["sum"]),
            check_count(state["n_raised"]),
        )
        expect(self.sum <= self.limit, "alarm", state, f"a sum from 0 to {self.limit}")
        self.active = bool(state["active"])


def runs_of(exceeds: list[bool]) -> NDArray[np.int64]:
    """Count windows that exceed the limits, and how often one follows another.

    Parameters
    ----------
    exceeds : list of bool
        Windows of one recording, in the order of time.

    Returns
    -------
    ndarray of shape (4,)
        Numbers of windows; of exceeding ones; of exceeding ones that another window
        follows; and of those that another exceeding one follows. None exceeds the one
        before.

    Examples
    --------
    >>> runs_of([False, True, True, False, True]).tolist()
    [5, 3, 2, 1]
    """
    windows = np.array(exceeds, dtype=bool)
    first, second = windows[:-1], windows[1:]
    return np.array([len(windows), windows.sum(), first.sum(), (first & second).sum()])


def healthy_shares(counts: NDArray[np.int64]) -> dict[str, float]:
    """Estimate rate and persistence of exceeding windows: means of Beta(1, 1) posteriors.

    Parameters
    ----------
    counts : ndarray of shape (4,)
        Sum of results of `runs_of`.

    Returns
    -------
    dict
        ``rate`` and ``persistence``, as `CumulativeSumAlarm` takes them.

    Examples
    --------
    >>> healthy_shares(runs_of([False] * 98))
    {'rate': 0.01, 'persistence': 0.5}
    """
    n, exceeding, followed, runs = counts.tolist()
    return {
        "rate": (exceeding + 1) / (n + 2),
        "persistence": (runs + 1) / (followed + 2),
    }
