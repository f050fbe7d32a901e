"""What a monitor says of a window and of all windows so far."""

from typing import NamedTuple


class MonitorVerdict(NamedTuple):
    """What a `ConditionMonitor` says when a window is complete.

    Parameters
    ----------
    start : int
        Number of samples that came before the window.
    time : float
        Seconds at the end of the window: on the clock of the blocks' times, or since the first
        sample where none were given.
    quality : str
        ``"good"``, or why the window carries no signal, see `signal_quality`.
    window_verdict : object
        Condition of this window alone; None where it is not good, or there is no diagnoser.
    verdict : object
        Condition by the evidence of all late windows; None where no window said anything for longer
        than the half-life.
    confidence : float
        Probability of `verdict`; NaN where that is None.
    exceeds : bool or None
        Whether this window alone exceeds the detection threshold; None where it is not good.
    alarm : bool or None
        Whether the alarm is on; None where nothing detects.
    alarm_level : float
        Cumulative sum over its limit, from 0 to 1; NaN where nothing detects.
    """

    start: int
    time: float
    quality: str
    window_verdict: object
    verdict: object
    confidence: float
    exceeds: bool | None
    alarm: bool | None
    alarm_level: float
