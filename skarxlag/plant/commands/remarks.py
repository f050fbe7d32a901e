"""Sentences for the reader of a verdict."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import pandas as pd

from ...core.capabilities import unfolded_steps
from ...decisions.fault_orders import FaultOrderClassifier
from ...verdicts.limits import FEW_HEALTHY, HOLD_FOR_RECORDED, LEAST_HEALTHY
from ...verdicts.names import CHANGED, NO_SIGNAL, UNCERTAIN, UNKNOWN
from ...verdicts.windows import HOLD
from ..readers.entries import OpenRecording
from .channels import are_compared, channel_remarks
from .refused_rows import compares_orders, why_no_orders

if TYPE_CHECKING:
    from .models import RecordingModel

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


def recording_remarks(
    model: RecordingModel,
    opened: OpenRecording,
    stated_channels: Any,
    windows: pd.DataFrame,
    verdict: dict[str, Any],
) -> Iterator[str]:
    """Yield remarks on a recording, its verdict, and what the model assumed.

    Parameters
    ----------
    model : RecordingModel
        The model.
    opened : OpenRecording
        The recording.
    stated_channels : str, list of str or None
        Its channels as they were stated.
    windows : DataFrame
        As `window_verdicts` returns it.
    verdict : dict
        As `Judge.recording` returns it.
    """
    is_healthy = verdict["verdict"] == model.healthy
    is_trained = model.judge is not None
    if opened.old_rate is not None:
        yield f"Resampled from {opened.old_rate:g} to {model.sampling_rate:g} Hz."
    if are_compared(model.facts, stated_channels):
        yield from channel_remarks(opened.channels, model.facts, stated_channels)
    if not is_trained and "evidence" in windows:
        for text in windows["evidence"].dropna():
            yield f"{text[0].upper()}{text[1:]}."
    yield from verdict_remarks(windows, verdict)
    if is_healthy and _has_combs_alone(model):
        yield NO_COMB
    if not is_trained:
        return
    if verdict["verdict"] == CHANGED and model.facts.get("bearing"):
        yield f"No comb of bearing {model.facts['bearing']} shows a fault."
    if opened.sampling_rate is None and model.sampling_rate is not None:
        yield f"No sampling rate is stated; {model.sampling_rate:g} Hz was assumed."
    rate = opened.sampling_rate or model.sampling_rate
    rpm = opened.entry.rpm
    slowest = windows["rpm"].min() if "rpm" in windows else rpm
    reason = why_no_orders(model.window_length, rate, slowest)
    if reason and compares_orders(model.diagnoser):
        yield reason
    if rpm is None and model.capabilities.is_stretch and model.train_rpm:
        yield "The speed is not stated. Speeds near those of fit were searched."


def _has_combs_alone(model):
    """Return whether combs of a bearing decide, without spectra of faults."""
    decide = unfolded_steps(model.diagnoser)[-1]
    has_combs = isinstance(decide, FaultOrderClassifier)
    return has_combs and (model.judge is None or decide.conditions_ is None)


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
