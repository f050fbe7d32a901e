"""Verdict of a monitor on a window and on all recent windows."""

from typing import NamedTuple


class MonitorVerdict(NamedTuple):
    """Verdict of a `ConditionMonitor` when a window is complete.

    Parameters
    ----------
    start : int
        Number of samples before the window.
    time : float
        Time in seconds at the end of the window: on the clock of the blocks' times, or
        since the first sample if there are none.
    rpm : float
        Stated shaft speed in the middle of the window; NaN if there is none.
    quality : str
        ``"good"``; why the window carries no signal, see `signal_quality`; or ``"no
        verdict"``.
    quality_share : float
        Share in [0, 1] of the window that this affects, as `signal_quality` returns it.
    rms, peak, crest_factor : float
        Levels of the window's output about its mean, in the unit of the samples, see
        :func:`skarxlag.measures.levels.signal_levels`.
    window_verdict : object
        Condition of this window alone; ``"no verdict: ..."`` with the reason, such as
        an implausible speed; None if the window carries no signal or there is no
        classifier.
    verdict : object
        Condition by the evidence of all recent windows. Instead of the healthy
        condition: ``"changed"`` while windows keep the alarm on, and ``"possibly
        changed"`` while `alarm_state` is ``"not yet an alarm"`` or `p_value` is below
        the stated rate of false alarms. Also
        ``"not identifiable"`` if two locations fit the combs of recent windows; ``"no
        verdict: ..."`` as for the window; None if no window within the half-life had a
        verdict.
    probability : float
        Probability of `verdict`; NaN if it is no condition.
    exceeds : bool or None
        Whether this window alone exceeds the healthy limits; None if they do not hold
        at its speed, or the window carries no signal.
    alarm : bool or None
        Whether the alarm is on, also one that is latched; None if there are no healthy
        limits.
    alarm_level : float
        Cumulative sum over its limit, from 0 to 1; NaN if there are no healthy limits.
    p_value : float
        Probability that recent windows of the healthy machine deviate as much, from
        those for which the healthy limits hold; NaN without a detector, or if there was
        none within the half-life.
    limits : str
        ``"hold"``, or why the healthy limits do not hold at the speed of the window.
    alarm_state : str
        ``"off"``; ``"not yet an alarm"`` if the window exceeds the limits, or several
        recent ones did, but the cumulative sum has not reached its limit; ``"on"``;
        ``"latched"`` if recent windows do not exceed any more, but the alarm was not
        acknowledged; ``"none"`` if there are no healthy limits.
    """

    start: int
    time: float
    rpm: float
    quality: str
    quality_share: float
    rms: float
    peak: float
    crest_factor: float
    window_verdict: object
    verdict: object
    probability: float
    exceeds: bool | None
    alarm: bool | None
    alarm_level: float
    p_value: float
    limits: str
    alarm_state: str
