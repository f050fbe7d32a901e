"""Sentences for the reader of a verdict."""

from collections.abc import Iterator
from typing import Any

import pandas as pd

from ..verdicts.limits import FEW_HEALTHY, HOLD_FOR_RECORDED, LEAST_HEALTHY
from ..verdicts.names import CHANGED, NO_SIGNAL, UNCERTAIN, UNKNOWN
from ..verdicts.windows import HOLD

#: Reservation to a healthy verdict of combs alone.
NO_COMB = "Most ball faults show no comb."
#: Advice on verdicts that are no condition.
_ADVICE = {
    NO_SIGNAL: "No window carries a signal. Check the sensor, its cable and the logger.",
    UNKNOWN: "The recording resembles no condition of the model. Check the sensor, the speed, the "
    "load and the mounting. If they are as in training, the condition is new.",
    UNCERTAIN: "The recording is not healthy. The location of the fault is not certain.",
    CHANGED: "Changed: a new fault, or another load, mounting or sensor, can be the reason.",
}


def verdict_remarks(windows: pd.DataFrame, verdict: dict[str, Any]) -> Iterator[str]:
    """Yield remarks on the verdict, the quality and the healthy limits of a recording.

    Parameters
    ----------
    windows : DataFrame
        As `window_verdicts` returns it.
    verdict : dict
        As `Judge.recording` returns it.
    """
    if verdict["verdict"] in _ADVICE:
        yield _ADVICE[verdict["verdict"]]
    if isinstance(verdict.get("most like"), str):
        yield f"Most like: {verdict['most like']}."
    if verdict["no signal"]:
        reasons = windows.loc[windows["quality"] != "good", "quality"].value_counts()
        listed = ", ".join(f"{reason}: {count}" for reason, count in reasons.items())
        yield f"{verdict['no signal']} of {verdict['windows']} windows carry no signal ({listed})."
    if verdict["limits"] == FEW_HEALTHY:
        yield (
            f"The alarm rests on fewer than {LEAST_HEALTHY} healthy rows, so a fault may be within "
            "its limits."
        )
    elif verdict["limits"] == HOLD_FOR_RECORDED:
        yield (
            "The recording resembles none of the training closely: it is of another bearing, load, "
            "mounting or machine. Healthy limits may not hold for it."
        )
    elif verdict["limits"] not in ("", HOLD):
        yield f"No alarm: {verdict['limits']}."
