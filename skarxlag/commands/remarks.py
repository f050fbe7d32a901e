"""What a person should know before a verdict is used."""

from typing import Any

import pandas as pd

from ..verdicts import NO_SIGNAL

#: Alarms in more windows than this share contradict the verdict "healthy", in fewer a fault.
_MOST_WINDOWS = 0.5


def verdict_remarks(
    windows: pd.DataFrame, verdict: dict[str, Any], conditions: list[str]
) -> list[str]:
    """What a person should know before the verdict on a recording is used.

    Parameters
    ----------
    windows : DataFrame
        Rows of `window_verdicts`.
    verdict : dict
        What `recording_verdict` made of them.
    conditions : list of str
        As there.

    Returns
    -------
    list of str
        Sentences; none if there is nothing to say.

    Examples
    --------
    >>> from skarxlag.verdicts import recording_verdict
    >>> windows = pd.DataFrame({
    ...     "verdict": ["good"], "alarm": [True], "quality": ["good"],
    ...     "probability of good": [0.9], "probability of worn": [0.1],
    ... })
    >>> verdict = recording_verdict(windows, ["good", "worn"])
    >>> print(*verdict_remarks(windows, verdict, ["good", "worn"]))
    The verdict is good, but most windows exceed the detection threshold: ...
    """
    remarks = []
    if verdict["no signal"]:
        reasons = windows.loc[windows["quality"] != "good", "quality"].value_counts()
        listed = ", ".join(f"{reason}: {count}" for reason, count in reasons.items())
        remarks.append(_no_signal_remark(verdict, listed))
    if "score" in windows or verdict["verdict"] == NO_SIGNAL:
        return remarks
    if verdict.get("none of these"):
        remarks.append(_none_of_these_remark(verdict, conditions))
        return remarks
    is_healthy = verdict["verdict"] == conditions[0]
    if is_healthy and verdict["alarms"] > _MOST_WINDOWS:
        remarks.append(
            f"The verdict is {conditions[0]}, but most windows exceed the detection threshold: "
            "either the speed is not one of the training, then the threshold does not hold and "
            "the verdict may, or the condition is none of those trained, then the verdict is "
            f"wrong. {_which(verdict)}"
        )
    elif not is_healthy and verdict["alarms"] < _MOST_WINDOWS:
        remarks.append(
            f"The verdict is {verdict['verdict']}, but most windows stay below the detection "
            "threshold: the fault is weak, or the speed is not one of the training, or the verdict "
            "is wrong. Measure again before anything is dismantled."
        )
    return remarks


def _which(verdict):
    """How to find out why verdict and alarm contradict each other."""
    detector = "A detector (fit --diagnoser detector)"
    if "p-value" not in verdict:
        return f"{detector} tells which."
    return (
        f"The p-value of the nearest condition, {verdict['p-value']:.2g}, speaks against the "
        "second at a speed of the training; at another it decides nothing. "
        f"{detector} tells which."
    )


def _none_of_these_remark(verdict, conditions):
    alarm = "exceed" if verdict["alarms"] > _MOST_WINDOWS else "stay below"
    return (
        "None of these: windows of the nearest condition are rarely so far off (p-value "
        f"{verdict['p-value']:.2g}), so {verdict['verdict']} is only the least unlike of "
        f"{len(conditions)} conditions, and most windows {alarm} the detection threshold. Do not "
        "act on the verdict: check sensor, unit and stated speed; if they are right, the condition "
        "was not trained."
    )


def _no_signal_remark(verdict, listed):
    if verdict["verdict"] == NO_SIGNAL:
        return (
            f"No window carries a signal ({listed}), so there is no verdict: check the sensor, "
            "its cable and the logger."
        )
    return (
        f"{verdict['no signal']} of {verdict['windows']} windows carry no signal ({listed}) and "
        "do not count."
    )
