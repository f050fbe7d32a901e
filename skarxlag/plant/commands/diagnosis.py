"""Diagnosis of one recording: its samples, its rows, and the verdict on them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np
import pandas as pd
from joblib import parallel_config

from ...core.validation import output_of_windows
from ...measures.levels import joined_levels, signal_levels
from ...measures.velocity import velocity_rms
from ...verdicts.names import no_verdict
from ..readers.entries import ListedRecording
from .messages import CommandError
from .models import RecordingModel
from .remarks import recording_remarks
from .training_facts import plain_unit, why_no_limits
from .workers import cancelled

#: Entry of the column ``alarm`` if a stated fact differs from all training.
NOT_VALID = "not valid here"


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
    remarks : list of str
        Sentences for the reader of the verdict.
    error : str or None
        Reason of a failure.
    file : tuple of int or None
        Size and time of modification of the file that was read.
    """

    verdict: dict[str, Any]
    windows: pd.DataFrame | None
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


def diagnose_file(
    recording: Any,
    load: Any,
    resample: bool = False,
    n_threads: int = 1,
    unit: str | None = None,
) -> Diagnosis:
    """Diagnose a recording with the model that `load` returns, in a worker.

    Errors are stored in the result, not raised.
    """
    try:
        if not recording.path.is_file():
            return Diagnosis.failed(recording, "no such file")
        before = file_state(recording)
        with parallel_config("threading", n_jobs=n_threads):
            diagnosis = diagnose_recording(load(), recording, resample, unit)
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


def diagnose_recording(
    model: RecordingModel,
    recording: ListedRecording,
    resample: bool = False,
    unit: str | None = None,
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
    unit : str or None, default=None
        Unit of the signal if the file states none.

    Raises
    ------
    FileNotFoundError, ImportError, ValueError, CommandError
        If the recording cannot be read, or does not fit the model.
    """
    opened = model.open(recording, resample)
    rate = opened.sampling_rate
    unit = plain_unit(opened.channels[0][1] or unit or "")
    judge = model.judge
    tables = []
    evidence = []
    velocities = []
    for start, X, rpm in model.row_blocks(opened):
        if cancelled.is_set():
            raise KeyboardInterrupt
        output = output_of_windows(X)
        if judge is None:
            judge = model.judge_of(X[0], rpm, rate)
        results = judge.window_results(X, rpm)
        evidence.append(results.evidence)
        table = results.table().assign(**signal_levels(output)._asdict())
        table.insert(0, "start", start)
        if opened.entry.profile is not None:
            table.insert(1, "rpm", rpm.mean(axis=1))
        tables.append(table)
        velocities.append(velocity_rms(output.ravel(), rate, unit))
    windows = pd.concat(tables, ignore_index=True)
    reason = why_no_limits(model.facts, recording, opened.channels, model.other_bearing)
    if reason:
        windows = windows.assign(limits=reason, alarm=np.nan)
        if len(model.conditions) == 1:
            # A detector without limits has no verdict.
            is_judged = windows["quality"] == "good"
            windows.loc[is_judged, "verdict"] = no_verdict(reason)
    verdict = judge.recording(windows, np.concatenate(evidence))
    if reason and judge.limits.exist:
        verdict["alarm"] = NOT_VALID
    verdict |= _levels_of_recording(windows, velocities, unit)
    combs = windows.filter(like="dB of ").mean()
    verdict |= {f"{name} comb": level for name, level in combs.items()}
    remarks = [*recording_remarks(model, opened, recording, windows, verdict)]
    return Diagnosis(verdict, windows, remarks)


def _levels_of_recording(windows, velocities, unit):
    """Return the levels of a recording, in the unit of the signal and in those of standards."""
    levels = joined_levels(windows["rms"].to_numpy(), windows["peak"].to_numpy())
    entries = dict(levels._asdict()) | {"unit": unit or None}
    # Blocks are of equal length, except for the last, which may be too short.
    stated = [velocity for velocity in velocities if velocity is not None]
    if stated:
        entries["velocity_rms_mm_s"] = float(np.sqrt(np.mean(np.square(stated))))
    return entries
