"""Sentences for the reader of a verdict."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import pandas as pd

from ...core.fault_locations import NO_FINDING
from ...core.speeds import LEAST_REVOLUTIONS, REVOLUTIONS_LEFT
from ...verdicts.limits import FEW_HEALTHY, HOLD_FOR_RECORDED, LEAST_HEALTHY
from ...verdicts.names import CHANGED, NO_SIGNAL, UNCERTAIN, UNKNOWN
from ...verdicts.windows import HOLD
from ..readers.entries import ListedRecording, OpenRecording
from .messages import sentence
from .training_facts import channel_difference

if TYPE_CHECKING:
    from .models import RecordingModel

#: Speeds in rpm below this one are repeated, because they may be in Hertz.
_SLOW = 60.0
#: Reservation to a verdict of combs alone.
NO_COMB = "No fault pattern was found. Most ball faults show none."
#: Advice on verdicts that are no condition.
_ADVICE = {
    NO_SIGNAL: "No window carries a signal. Check the sensor, its cable and the logger.",
    UNKNOWN: "The recording resembles no condition of the model. Check the sensor, the speed, the "
    "load and the mounting. If they are as in training, the condition is new.",
    UNCERTAIN: "A fault is more probable than not. Its location is not certain.",
    CHANGED: "Changed: a new fault, or another load, mounting or sensor, can be the reason.",
}


def recording_remarks(
    model: RecordingModel,
    opened: OpenRecording,
    recording: ListedRecording,
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
    recording : ListedRecording
        The recording as it was stated.
    windows : DataFrame
        As `window_verdicts` returns it.
    verdict : dict
        As `Judge.recording` returns it.
    """
    is_trained = model.judge is not None
    rpm = opened.entry.rpm
    if rpm is not None and rpm < _SLOW:
        yield f"The speed was read as {rpm:g} rpm ({rpm / 60:.3g} Hz)."
    if opened.old_rate is not None:
        yield f"Resampled from {opened.old_rate:g} to {model.sampling_rate:g} Hz."
    difference = channel_difference(opened.channels, model.facts, recording.channel)
    if difference and verdict["limits"] != difference:
        yield sentence(difference)
    if not is_trained and "evidence" in windows:
        for text in windows["evidence"].dropna().unique():
            yield sentence(text)
    yield from verdict_remarks(windows, verdict)
    has_no_pattern = verdict["verdict"] in (NO_FINDING, model.healthy)
    if has_no_pattern and (not is_trained or model.capabilities.combs_alone):
        yield NO_COMB
    if not is_trained:
        return
    bearing = model.other_bearing or model.facts.get("bearing")
    if verdict["verdict"] == CHANGED and bearing:
        yield f"No comb of bearing {bearing} shows a fault."
    if opened.sampling_rate is None and model.sampling_rate is not None:
        yield f"No sampling rate is stated; {model.sampling_rate:g} Hz was assumed."
    rate = opened.sampling_rate or model.sampling_rate
    slowest = windows["rpm"].min() if "rpm" in windows else rpm
    reason = why_no_orders(model.window_length, rate, slowest)
    if reason and model.capabilities.compares_orders:
        yield reason
    if rpm is None and model.capabilities.is_stretch and model.train_rpm:
        yield "The speed is not stated. Speeds near those of fit were searched."


def verdict_remarks(windows: pd.DataFrame, verdict: dict[str, Any]) -> Iterator[str]:
    """Yield remarks on the verdict, the quality and the healthy limits of a recording.

    Parameters
    ----------
    windows : DataFrame
        As `window_verdicts` returns it.
    verdict : dict
        As `Judge.recording` returns it.
    """
    if verdict["verdict"] == UNCERTAIN and verdict["alarm"] == "no":
        yield "The healthy limits are not exceeded, so this is no alarm."
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


def why_no_orders(
    n_samples: int, sampling_rate: float | None, rpm: float | None
) -> str:
    """Return why the order spectra of a stretch are not compared, or an empty text if they are.

    Examples
    --------
    >>> why_no_orders(6000, 10_000.0, 900.0)
    ''
    >>> why_no_orders(6000, 10_000.0, 150.0)
    'Order spectra are not compared: 0.6 s are 1.5 revolutions at 150 rpm, and it takes 3.'
    """
    if sampling_rate is None or rpm is None:
        return ""
    seconds = n_samples / sampling_rate
    n_revolutions = seconds * rpm / 60
    if not n_revolutions < REVOLUTIONS_LEFT:
        return ""
    return (
        f"Order spectra are not compared: {seconds:.3g} s are {n_revolutions:.3g} "
        f"revolutions at {rpm:g} rpm, and it takes {LEAST_REVOLUTIONS}."
    )
