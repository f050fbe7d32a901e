"""Diagnosis of one recording: its samples, its rows, and the verdict on them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, Self

import numpy as np
import pandas as pd
from joblib import parallel_config
from numpy.typing import NDArray

from ...core.speeds import SPEED_FACTOR
from ...core.validation import output_of_windows
from ...verdicts.names import no_verdict
from ...verdicts.windows import joined_tables
from ..readers.entries import ListedRecording, OpenRecording
from ..readers.rates import NO_RATE
from .channels import plain_unit
from .messages import CommandError
from .models import RecordingModel
from .remarks import recording_remarks
from .velocity import velocity_rms
from .workers import cancelled

#: Entries of the verdict on a recording that the commands need.
_ENTRIES = {"verdict", "probability", "alarm", "windows"}
#: Error on a recording of unknown speed.
_NO_SPEED = "rpm is missing; expected --rpm, a column, or the file to state it"


@dataclass(frozen=True)
class Diagnosis:
    """Result of one recording.

    Parameters
    ----------
    verdict : dict
        As `skarxlag.verdicts.judge.Judge.recording` returns it. If the recording
        failed, the verdict is "no verdict: ..." and the other entries are missing.
    windows : DataFrame or None
        One row for each window; None if the recording failed.
    sampling_rate : float or None
        In Hz; None if it is not known.
    remarks : list of str
        Sentences for the reader of the verdict.
    error : str or None
        Reason of a failure.
    file : tuple of int or None
        Size and time of modification of the file that was read.
    """

    verdict: dict[str, Any]
    windows: pd.DataFrame | None
    sampling_rate: float | None = None
    remarks: list[str] = field(default_factory=list)
    error: str | None = None
    file: tuple[int, ...] | None = None

    @classmethod
    def failed(cls, recording: ListedRecording, reason: object) -> Self:
        """Return the result of a recording that could not be diagnosed, without its name."""
        reason = (
            str(reason)
            .removeprefix(f"{recording.path}: ")
            .removeprefix(f"{recording.name}: ")
        )
        return cls(
            {"verdict": no_verdict(reason)}, None, error=" ".join(reason.split())
        )

    @property
    def is_whole(self) -> bool:
        """Return whether it holds an error, or a verdict and its windows."""
        if self.error is not None:
            return isinstance(self.error, str)
        is_table = isinstance(self.windows, pd.DataFrame) and not self.windows.empty
        return (
            is_table
            and isinstance(self.verdict, dict)
            and self.verdict.keys() >= _ENTRIES
        )

    def details(self) -> str:
        """Return details for --verbose: windows, alarm, and verdicts of several outputs."""
        shown = [
            name
            for name in self.verdict
            if name.startswith(("alarm", "windows", "verdict "))
        ]
        return ", ".join(f"{name} {self.verdict[name]}" for name in shown)


def diagnose_file(
    recording: Any, load: Any, resample: bool = False, n_threads=1
) -> Diagnosis:
    """Diagnose a recording with the model that `load` returns, in a worker.

    Errors are stored in the result, not raised.
    """
    try:
        before = file_state(recording)
        with parallel_config("threading", n_jobs=n_threads):
            diagnosis = diagnose(load(), recording, resample)
        if file_state(recording) != before:
            return Diagnosis.failed(recording, "the file changed while it was read")
        return replace(diagnosis, file=before)
    except (OSError, ValueError, ImportError, MemoryError, CommandError) as error:
        return Diagnosis.failed(recording, error)


def file_state(recording: ListedRecording) -> tuple[int, ...]:
    """Return the size of a recording's file, and when its content and its entry changed."""
    status = recording.path.stat()
    # Programs that copy a file may set back the time of its content, but not that of
    # its entry.
    return status.st_size, status.st_mtime_ns, status.st_ctime_ns


class RowBlock(NamedTuple):
    """Rows of a recording that follow each other.

    Attributes
    ----------
    start : ndarray of int of shape (n_rows,)
        Position of the first sample of each row.
    X : ndarray of shape (n_rows[, n_channels], n_samples)
        The rows.
    rpm : float, ndarray of shape (n_rows, n_samples), or None
        Their speed, or those at each sample; None if it is not known.
    """

    start: NDArray[Any]
    X: NDArray[Any]
    rpm: Any


def diagnose(
    model: RecordingModel, recording: ListedRecording, resample: bool = False
) -> Diagnosis:
    """Diagnose a recording, block by block.

    Parameters
    ----------
    model : RecordingModel
        The model.
    recording : ListedRecording
        The recording.
    resample : bool, default=False
        Whether it is brought to the sampling rate of the model.

    Raises
    ------
    FileNotFoundError, ImportError, ValueError, CommandError
        If the recording cannot be read, or does not fit the model.
    """
    opened = model.open(recording, resample)
    has_profile = opened.entry.profile is not None
    unit = plain_unit(opened.channels[0][1] or "")
    judge = model.judge
    starts = []
    results = []
    mean_speeds = []
    velocities = []
    for block in row_blocks(model, opened):
        if cancelled.is_set():
            raise KeyboardInterrupt
        if judge is None:
            judge = model.judge_of(block.X[0], block.rpm, opened.sampling_rate)
        starts.append(block.start)
        results.append(judge.window_results(block.X, block.rpm))
        if has_profile:
            mean_speeds.append(block.rpm.mean(axis=1))
        output = output_of_windows(block.X)
        velocities.append(velocity_rms(output.ravel(), opened.sampling_rate, unit))
    windows, evidence = joined_tables(results)
    windows.insert(0, "start", np.concatenate(starts))
    if has_profile:
        windows.insert(1, "rpm", np.concatenate(mean_speeds))
    verdict = judge.recording(windows, evidence)
    if velocities[0] is not None:
        # Blocks are of equal length, except for the last, which may be too short.
        stated = [velocity for velocity in velocities if velocity is not None]
        verdict["velocity_rms_mm_s"] = float(np.sqrt(np.mean(np.square(stated))))
    remarks = recording_remarks(model, opened, recording.channel, windows, verdict)
    return Diagnosis(verdict, windows, opened.sampling_rate, [*remarks])


def row_blocks(model: RecordingModel, opened: OpenRecording) -> Iterator[RowBlock]:
    """Yield the rows of an open recording with their speeds, block by block."""
    if model.window_length is None:
        yield _whole_recording(model, opened)
        return
    rate = opened.sampling_rate or model.sampling_rate
    n_before = 0
    for X in model.windows(opened):
        start = np.arange(n_before, n_before + len(X)) * model.window_length
        yield RowBlock(start, X, opened.entry.speeds(start, X.shape[-1], rate))
        n_before += len(X)


def _whole_recording(model, opened):
    """Return a recording as one row, without the part of a run-up that is slow."""
    (X,) = model.windows(opened)
    entry = opened.entry
    if opened.sampling_rate is None:
        raise ValueError(f"{entry.name}: {NO_RATE}")
    if entry.rpm is None:
        raise ValueError(f"{entry.name}: {_NO_SPEED}")
    rpm = entry.speeds([0], X.shape[-1], opened.sampling_rate)
    if entry.profile is None:
        return RowBlock(np.array([0]), X, rpm)
    # A run-up may begin at rest, and a run-down end there.
    fast = np.flatnonzero(SPEED_FACTOR * rpm[0] >= rpm.max())
    first = fast[0]
    end = fast[-1] + 1
    return RowBlock(np.array([first]), X[..., first:end], rpm[:, first:end])
