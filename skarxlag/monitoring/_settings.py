"""Checked settings of a monitor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.state import expect
from ..core.validation import ABOVE_0, check_count, check_rate, check_real

#: Largest delay of an alarm in windows; the mean time between false alarms is computed
#: from it.
_LONGEST_DELAY = 1000
_REAL_NUMBERS = (
    "sampling_rate",
    "half_life",
    "false_alarm_interval",
    "persistence",
    "gap_tolerance",
)


@dataclass(kw_only=True)
class MonitorSettings:
    """Checked settings of `ConditionMonitor`, in which None is replaced by its meaning."""

    sampling_rate: float
    window_length: int
    hop: int | None
    half_life: float
    false_alarm_interval: float
    alarm_delay: int | None
    persistence: float
    gap_tolerance: float | None

    def __post_init__(self) -> None:
        self.window_length = int(check_count(self.window_length, "window_length"))
        if self.hop is None:
            self.hop = self.window_length
        self.hop = int(check_count(self.hop, "hop"))
        if self.alarm_delay is not None:
            delay = int(check_count(self.alarm_delay, "alarm_delay"))
            expected = f"at most {_LONGEST_DELAY}"
            expect(delay <= _LONGEST_DELAY, "alarm_delay", delay, expected)
            self.alarm_delay = delay
        check_real(self.sampling_rate, "sampling_rate", **ABOVE_0)
        check_real(self.false_alarm_interval, "false_alarm_interval", **ABOVE_0)
        check_rate(self.persistence, "persistence")
        if self.half_life != np.inf:
            check_real(self.half_life, "half_life", **ABOVE_0)
        if self.gap_tolerance is None:
            self.gap_tolerance = 0.5 * self.window_length / self.sampling_rate
        check_real(self.gap_tolerance, "gap_tolerance", min_val=0)
        # A saved state holds no numbers of NumPy.
        for name in _REAL_NUMBERS:
            setattr(self, name, float(getattr(self, name)))

    @property
    def windows_an_hour(self) -> float:
        """Windows in an hour of signal."""
        return 3600 * self.sampling_rate / self.hop

    @property
    def run_length(self) -> float:
        """Smallest mean number of windows between false alarms."""
        return self.false_alarm_interval * self.windows_an_hour

    @property
    def least_persistence(self) -> float:
        """Persistence of windows that may overlap: those that share samples exceed together."""
        return max(self.persistence, 1 - self.hop / self.window_length)
