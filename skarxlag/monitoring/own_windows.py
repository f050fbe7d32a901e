"""A detector whose windows are not those of the diagnoser."""

from typing import Any

from numpy.typing import NDArray

from .verdict import MonitorVerdict


class DetectorOnOwnWindows:
    """Takes the same blocks as a diagnoser, and tells the alarm where a verdict is given.

    Verdicts are given where a window of the diagnoser ends. What windows of the detector have said
    since the verdict before is then put into it, so a verdict does not depend on how the samples
    came in blocks.

    Parameters
    ----------
    monitor : ConditionMonitor
        Of the detector alone.
    length : int
        Samples in one of its windows.
    """

    def __init__(self, monitor: Any, length: int) -> None:
        self.monitor: Any = monitor
        self.length: int = length
        self.start_afresh()

    def start_afresh(self) -> None:
        """Forget what was said."""
        self._waiting, self._alarm, self._level = [], False, 0.0

    def update(self, samples: NDArray[Any], time: float | None, rpm: float | None) -> None:
        """Take a block."""
        self._waiting += [
            [said.start + self.length, said.exceeds, said.alarm, said.alarm_level]
            for said in self.monitor.update(samples, time=time, rpm=rpm)
        ]

    def told_by(self, end: int, verdict: MonitorVerdict) -> MonitorVerdict:
        """The verdict on a window that ends with sample `end`, with the alarm."""
        told = [said for said in self._waiting if said[0] <= end]
        self._waiting = self._waiting[len(told) :]
        exceeds = [said[1] for said in told if said[1] is not None]
        if told:
            _, _, self._alarm, self._level = told[-1]
        return verdict._replace(
            exceeds=any(exceeds) if exceeds else None, alarm=self._alarm, alarm_level=self._level
        )

    def state(self) -> dict[str, Any]:
        """Everything that the next verdicts depend on, in plain values and one array."""
        return self.monitor.state() | {"waiting": self._waiting, "last": [self._alarm, self._level]}

    def restore(self, state: dict[str, Any]) -> None:
        """Go on where `state` was taken.

        Raises
        ------
        ValueError
            If the state is of another detector.
        """
        self.monitor.restore(state)
        self._waiting = [list(said) for said in state["waiting"]]
        self._alarm, self._level = state["last"]
