"""The diagnosis of one recording: what a worker does, and its result."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from .._answers import answers
from ..recordings.listing import ListedRecording
from ..recordings.rates import rates_agree, resampled_blocks
from ..recordings.windows import block_length, cut_blocks
from ..verdicts import NO_SIGNAL, recording_verdict, window_verdicts
from .errors import CommandError
from .models import SavedModel, cached_model
from .runner import cancelled

#: Alarms in more windows than this share contradict the verdict "healthy", in fewer a fault.
_MOST_WINDOWS = 0.5


@dataclass(frozen=True)
class Diagnosis:
    """What came of one recording.

    Parameters
    ----------
    verdict : dict
        As `recording_verdict` returns it; empty if the recording failed.
    windows : DataFrame or None
        One row for each window; None if the recording failed.
    sampling_rate : float or None
        In Hz, where it is known.
    remarks : tuple of str
        What to know before the verdict is used.
    error : str or None
        Why there is no verdict.
    """

    verdict: dict[str, Any]
    windows: pd.DataFrame | None
    sampling_rate: float | None = None
    remarks: tuple[Any, ...] = ()
    error: str | None = None

    @classmethod
    def failed(cls, reason: object) -> Self:
        """A recording without a verdict, and why."""
        return cls({}, None, error=" ".join(str(reason).split()))


@dataclass(frozen=True)
class Task:
    """A recording and the model to diagnose it with, small enough to be sent to a worker.

    Parameters
    ----------
    recording : ListedRecording or similar
        With ``name``, ``path``, ``rpm`` and ``blocks``.
    model : tuple
        Arguments of `cached_model`.
    resample : bool
        Whether to bring the recording to the model's sampling rate.
    """

    recording: object
    model: tuple[Any, ...]
    resample: bool = False

    def __call__(self) -> Any:
        """Diagnose the recording; what is wrong with it is told, not raised."""
        try:
            model = cached_model(*self.model)
            return diagnose_recording(self.recording, model, self.resample)
        except (OSError, ValueError, ImportError, MemoryError, CommandError) as error:
            return Diagnosis.failed(error)


def diagnose_recording(
    recording: ListedRecording, model: SavedModel, resample: bool = False
) -> Diagnosis:
    """Diagnose one recording, read part by part.

    Parameters
    ----------
    recording : ListedRecording or similar
        With ``name``, ``rpm`` and ``blocks``.
    model : SavedModel
        The diagnoser.
    resample : bool, default=False
        Whether to bring the recording to the model's sampling rate.

    Returns
    -------
    Diagnosis
        With a verdict.
    """
    rpm, old_rates, parts, rates = _speed(recording, model), [], [], []
    for X, rate in recording_windows(recording, model, resample, old_rates.append):
        if cancelled.is_set():
            raise KeyboardInterrupt
        parts.append(window_verdicts(model.diagnoser, X, model.conditions, rpm, model.known))
        rates.append(rate)
    windows = pd.concat(parts, ignore_index=True)
    windows.insert(0, "start", np.arange(len(windows)) * model.window_length)
    limit = () if model.known is None else (answers(model.known).stated_rate,)
    verdict = recording_verdict(windows, model.conditions, *limit)
    remarks = verdict_remarks(windows, verdict, model.conditions)
    remarks += [f"Resampled from {r:g} to {model.sampling_rate:g} Hz." for r in old_rates]
    return Diagnosis(verdict, windows, rates[-1], tuple(remarks))


def recording_windows(
    recording: ListedRecording,
    model: SavedModel,
    resample: bool = False,
    note: Callable[[float], object] = lambda rate: None,
) -> Iterator[tuple[NDArray[Any], float | None]]:
    """Yield the windows of a recording that a model takes, block by block.

    Parameters
    ----------
    recording, model, resample
        As in `diagnose_recording`.
    note : callable, optional
        Takes the sampling rate of a recording that is resampled.

    Yields
    ------
    X : ndarray of shape (n_windows, ...)
        Consecutive windows.
    sampling_rate : float or None
        In Hz, if it is known.

    Raises
    ------
    CommandError
        If number of channels or sampling rate differ from those of the model.
    """
    sampling_rate = None

    def signals():
        nonlocal sampling_rate
        blocks = recording.blocks(block_length(model.window_length))
        if resample:
            blocks = resampled_blocks(blocks, model.sampling_rate, note=note)
        for signal, sampling_rate in blocks:
            _check_fits(recording.name, signal, sampling_rate, model)
            yield signal

    for X in cut_blocks(signals(), recording.name, model.window_length):
        yield X, sampling_rate


def _speed(recording, model):
    """Speed of a recording, which a detector that was fitted with speeds must know."""
    can = answers(model.diagnoser)
    if can.needs_rpm and recording.rpm is None:
        listed = ", ".join(f"{speed:g}" for speed in can.speeds)
        raise CommandError(
            f"{recording.name}: its speed is not stated, but {model.path} was fitted at {listed} "
            "rpm; give --rpm or a column rpm"
        )
    return recording.rpm


def _check_fits(name, signal, sampling_rate, model):
    n_channels = 1 if signal.ndim == 1 else len(signal)
    if n_channels != model.n_channels:
        raise CommandError(
            f"{name}: {n_channels} channels, but {model.path} was fitted on {model.n_channels}"
        )
    if not rates_agree(sampling_rate, model.sampling_rate):
        raise CommandError(
            f"{name}: sampled at {sampling_rate:g} Hz, but {model.path} was fitted at "
            f"{model.sampling_rate:g} Hz; --resample brings it to that"
        )


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
