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
from ...measures.levels import joined_levels, signal_levels
from ...measures.velocity import velocity_rms
from ...verdicts.names import no_verdict
from ..readers.entries import ListedRecording, OpenRecording
from ..readers.formats.rates import NO_RATE
from .channels import channel_difference, plain_unit
from .messages import CommandError
from .models import RecordingModel
from .remarks import recording_remarks
from .stated_speeds import speed_remark
from .training_facts import why_no_limits
from .workers import cancelled

#: Entry of the column ``alarm`` if a stated fact differs from all training.
NOT_VALID = "not valid here"
#: Units of acceleration, in m/s2.
ACCELERATIONS = {"m/s2": 1.0, "mm/s2": 1e-3, "g": 9.80665}
#: Samples of a row without a model, at most: longer recordings are several rows.
_LONGEST_ROW = 2**21
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
    unit = plain_unit(opened.channels[0][1] or unit or "")
    judge = model.judge
    tables = []
    evidence = []
    velocities = []
    for block in row_blocks(model, opened):
        if cancelled.is_set():
            raise KeyboardInterrupt
        output = output_of_windows(block.X)
        if judge is None:
            judge = model.judge_of(block.X[0], block.rpm, opened.sampling_rate)
        if not tables:
            remark = speed_remark(
                output.ravel(), opened.sampling_rate, opened.entry.rpm
            )
        # Results hold contrasts over orders, which would fill the memory.
        results = judge.window_results(block.X, block.rpm)
        evidence.append(results.evidence)
        table = results.table().assign(**signal_levels(output)._asdict())
        table.insert(0, "start", block.start)
        if opened.entry.profile is not None:
            table.insert(1, "rpm", block.rpm.mean(axis=1))
        tables.append(table)
        velocities.append(velocity_rms(output.ravel(), opened.sampling_rate, unit))
    windows = pd.concat(tables, ignore_index=True)
    reason = why_no_limits(
        model.facts, recording, model.other_bearing
    ) or channel_difference(opened.channels, model.facts, recording.channel)
    if reason:
        _remove_alarms(windows, reason, model)
    verdict = judge.recording(windows, np.concatenate(evidence))
    if reason and judge.limits.exist:
        verdict["alarm"] = NOT_VALID
    verdict |= _levels_of_recording(windows, velocities, unit)
    combs = windows.filter(like="dB of ").mean()
    verdict |= {f"{name} comb": level for name, level in combs.items()}
    remarks = [remark] if remark else []
    remarks += recording_remarks(model, opened, recording, windows, verdict)
    return Diagnosis(verdict, windows, opened.sampling_rate, remarks)


def _remove_alarms(windows, reason, model):
    """Remove alarms that do not hold; a detector without limits has no verdict."""
    windows["limits"] = reason
    windows["alarm"] = np.nan
    if model.has_detector_alone:
        is_judged = windows["quality"] == "good"
        windows.loc[is_judged, "verdict"] = no_verdict(reason)


def _levels_of_recording(windows, velocities, unit):
    """Return the levels of a recording, in the unit of the signal and in those of standards."""
    levels = joined_levels(windows["rms"].to_numpy(), windows["peak"].to_numpy())
    entries = dict(levels._asdict()) | {"unit": unit or None}
    if unit in ACCELERATIONS:
        entries["acceleration_rms_m_s2"] = levels.rms * ACCELERATIONS[unit]
    # Blocks are of equal length, except for the last, which may be too short.
    stated = [velocity for velocity in velocities if velocity is not None]
    if stated:
        entries["velocity_rms_mm_s"] = float(np.sqrt(np.mean(np.square(stated))))
    return entries


def row_blocks(model: RecordingModel, opened: OpenRecording) -> Iterator[RowBlock]:
    """Yield the rows of an open recording with their speeds, block by block."""
    if model.window_length is None:
        yield from _long_rows(opened)
        return
    rate = opened.sampling_rate or model.sampling_rate
    n_before = 0
    for X in model.windows(opened):
        start = np.arange(n_before, n_before + len(X)) * model.window_length
        yield RowBlock(start, X, opened.entry.speeds(start, X.shape[-1], rate))
        n_before += len(X)


def _long_rows(opened):
    """Yield rows of a recording for a model without a length: all of it, as far as it is one row.

    A longer recording is cut, and its last part that does not fill a row is left out.
    The part of a run-up that is slow is left out, too.
    """
    entry = opened.entry
    if opened.sampling_rate is None:
        raise ValueError(f"{entry.name}: {NO_RATE}")
    if entry.rpm is None:
        raise ValueError(f"{entry.name}: {_NO_SPEED}")
    start = 0
    for signal in _parts(opened.blocks):
        X = signal[np.newaxis]
        rpm = entry.speeds([start], X.shape[-1], opened.sampling_rate)
        first, end = 0, X.shape[-1]
        if entry.profile is not None:
            # A run-up may begin at rest, and a run-down end there.
            fast = np.flatnonzero(SPEED_FACTOR * rpm[0] >= rpm.max())
            first, end = fast[0], fast[-1] + 1
            rpm = rpm[:, first:end]
        yield RowBlock(np.array([start + first]), X[..., first:end], rpm)
        start += X.shape[-1]


def _parts(blocks):
    """Yield parts of the largest length of a row, or everything if it is shorter."""
    rest: list[NDArray[Any]] = []
    n_samples = 0
    is_long = False
    for block in blocks:
        rest.append(block)
        n_samples += block.shape[-1]
        while n_samples >= _LONGEST_ROW:
            signal = np.concatenate(rest, axis=-1)
            yield signal[..., :_LONGEST_ROW]
            # Without the copy, a few samples would keep the whole part in memory.
            rest = [signal[..., _LONGEST_ROW:].copy()]
            n_samples -= _LONGEST_ROW
            is_long = True
    if not is_long:
        yield np.concatenate(rest, axis=-1)
