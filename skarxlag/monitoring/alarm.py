"""Alarm if windows exceed the healthy limits too often: Page's cumulative sum."""

from typing import Any

from ..core.state import expect
from ..kernels.cumulative_sum import alarm_limit, mean_run_length, reference_step
from .windows import saved_count

#: Share of windows which exceed that is to be detected soonest.
_FAULTY_RATE = 0.5


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
    latch : bool, default=False
        Whether an alarm stays on until it is acknowledged.

    Attributes
    ----------
    step, limit : int
        m and h.
    delay : int
        Smallest number of windows in a row after which s reaches h from 0.
    sum : int
        s.
    active : bool
        Whether windows keep the alarm on.
    latched : bool
        Whether an alarm was on that is not acknowledged; False without `latch`.
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
        latch: bool = False,
    ) -> None:
        self.step: int = reference_step(rate, _FAULTY_RATE)
        if delay is None:
            self.limit: int = alarm_limit(run_length, self.step, rate, persistence)
        else:
            self.limit = delay * (self.step - 1)
        self.delay: int = -(-self.limit // (self.step - 1))
        self._rate = rate
        self._persistence = persistence
        self._latch = latch
        self.sum: int = 0
        self.active: bool = False
        self.latched: bool = False
        self.n_raised: int = 0

    @property
    def level(self) -> float:
        """Cumulative sum over its limit."""
        return self.sum / self.limit

    @property
    def alarm_state(self) -> str:
        """State of the alarm in words, see `MonitorVerdict`."""
        if self.active:
            return "on"
        if self.latched:
            return "latched"
        # One window that exceeds adds so much; later ones within the limits take it back.
        return "not yet an alarm" if self.sum >= self.step - 1 else "off"

    def run_length(self) -> float:
        """Return the mean number of healthy windows until an alarm."""
        return mean_run_length(self.limit, self.step, self._rate, self._persistence)

    def add(self, exceeds: bool) -> bool:
        """Add a window, and return whether the alarm is on."""
        change = self.step - 1 if exceeds else -1
        self.sum = min(max(self.sum + change, 0), self.limit)
        if self.sum == self.limit:
            self.n_raised += not self.active
            self.latched = self.latched or (self._latch and not self.active)
            self.active = True
        elif self.sum == 0:
            self.active = False
        return self.active

    def state(self) -> dict[str, Any]:
        """Return the state in plain values."""
        return {
            "sum": self.sum,
            "active": self.active,
            "latched": self.latched,
            "n_raised": self.n_raised,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a state, or raise a ValueError if its sum exceeds the limit."""
        total = saved_count(state["sum"])
        n_raised = saved_count(state["n_raised"])
        expect(total <= self.limit, "alarm", state, f"a sum from 0 to {self.limit}")
        self.sum = total
        self.n_raised = n_raised
        self.active = bool(state["active"])
        self.latched = self._latch and bool(state["latched"])
