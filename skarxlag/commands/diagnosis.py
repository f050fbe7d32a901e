"""The diagnosis of one recording: what a worker does, and its result."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from .._answers import answers
from ..recordings.listing import ListedRecording
from ..recordings.rates import rates_agree, resampled_blocks
from ..recordings.windows import block_length, cut_blocks
from ..verdicts import CHANGED, HOLD, NO_SIGNAL, NONE_OF_THESE, no_verdict
from .messages import CommandError
from .models import SavedModel, cached_model
from .workers import cancelled

#: Explanations of verdicts that are no condition.
_ADVICE = {
    NO_SIGNAL: "No window carries a signal. Check the sensor, its cable and the logger.",
    NONE_OF_THESE: "None of these: the recording resembles no condition of the model. Check the "
    "sensor, the unit and the stated speed; if they are right, the condition is new to it.",
    CHANGED: "Changed: the healthy limits are exceeded, but no condition can be named. Another "
    "load, mounting or sensor can be the reason.",
}


@dataclass(frozen=True)
class Diagnosis:
    """Result of one recording.

    Parameters
    ----------
    verdict : dict
        As `skarxlag.verdicts.Judge.recording` returns it. If the recording failed, the verdict is
        "no verdict: ..." and the other entries are missing.
    windows : DataFrame or None
        One row for each window; None if the recording failed.
    sampling_rate : float or None
        In Hz; None if it is not known.
    remarks : tuple of str
        Sentences for the reader of the verdict.
    error : str or None
        Reason of a failure.
    file : tuple of int or None
        Size and time of modification of the file that was read.
    """

    verdict: dict[str, Any]
    windows: pd.DataFrame | None
    sampling_rate: float | None = None
    remarks: tuple[str, ...] = ()
    error: str | None = None
    file: tuple[int, ...] | None = None

    @classmethod
    def failed(cls, reason: object) -> Self:
        """Return the result of a recording that could not be diagnosed."""
        reason = " ".join(str(reason).split())
        return cls({"verdict": no_verdict(reason)}, None, error=reason)


@dataclass(frozen=True)
class Task:
    """A recording and the model to diagnose it with, small enough to be sent to a worker.

    Parameters
    ----------
    recording : ListedRecording or similar
        With ``name``, ``path``, ``rpm``, ``with_speed`` and ``blocks``.
    model : tuple
        Arguments of `cached_model`.
    resample : bool
        Whether to bring the recording to the model's sampling rate.
    """

    recording: object
    model: tuple[Any, ...]
    resample: bool = False

    def __call__(self) -> Diagnosis:
        """Diagnose the recording. Errors are stored in the result, not raised."""
        try:
            model = cached_model(*self.model)
            before = file_state(self.recording)
            found = diagnose_recording(self.recording, model, self.resample)
            if file_state(self.recording) != before:
                return Diagnosis.failed(
                    f"{self.recording.path}: the file changed while it was read"
                )
            return replace(found, file=before)
        except (OSError, ValueError, ImportError, MemoryError, CommandError) as error:
            return Diagnosis.failed(error)


def file_state(recording: ListedRecording) -> tuple[int, ...]:
    """Return size and time of modification of a recording's file."""
    status = recording.path.stat()
    return status.st_size, status.st_mtime_ns


def diagnose_recording(
    recording: ListedRecording, model: SavedModel, resample: bool = False
) -> Diagnosis:
    """Diagnose one recording, block by block.

    Parameters
    ----------
    recording : ListedRecording or similar
        With ``name``, ``rpm``, ``with_speed`` and ``blocks``.
    model : SavedModel
        The diagnoser.
    resample : bool, default=False
        Whether to bring the recording to the model's sampling rate.

    Returns
    -------
    Diagnosis
        With a verdict.
    """
    old_rates, parts, rates = [], [], []
    if recording.rpm is None and answers(model.diagnoser).takes_rpm:
        recording = recording.with_speed()
    for X, rate in recording_windows(recording, model, resample, old_rates.append):
        if cancelled.is_set():
            raise KeyboardInterrupt
        parts.append(model.judge.windows(X, recording.rpm))
        rates.append(rate)
    windows = pd.concat(parts, ignore_index=True)
    windows.insert(0, "start", np.arange(len(windows)) * model.window_length)
    verdict = model.judge.recording(windows)
    remarks = [f"Resampled from {r:g} to {model.sampling_rate:g} Hz." for r in old_rates]
    remarks += _remarks(windows, verdict)
    if recording.rpm is None and answers(model.diagnoser).is_stretch and model.train_rpm:
        remarks.append("The speed is not stated. Speeds near those of fit were searched.")
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


def _remarks(windows, verdict):
    """Sentences for the reader of a verdict."""
    if verdict["verdict"] in _ADVICE:
        yield _ADVICE[verdict["verdict"]]
    if verdict["no signal"]:
        reasons = windows.loc[windows["quality"] != "good", "quality"].value_counts()
        listed = ", ".join(f"{reason}: {count}" for reason, count in reasons.items())
        yield f"{verdict['no signal']} of {verdict['windows']} windows carry no signal ({listed})."
    if verdict["limits"] not in ("", HOLD):
        yield f"No alarm: {verdict['limits']}."
