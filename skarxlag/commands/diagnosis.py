"""Diagnoses of recordings, each of which is a task for a worker."""

import argparse
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Self

import pandas as pd
from joblib import parallel_config

from ..recordings.listing import ListedRecording
from ..verdicts import no_verdict
from .messages import CommandError, Progress, percent
from .workers import TaskFailed, executors, run_tasks

#: Entries of the verdict on a recording that the commands need.
_ENTRIES = {"verdict", "probability", "alarm", "windows"}


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

    @property
    def is_whole(self) -> bool:
        """Return whether it holds an error, or a verdict and its windows."""
        if self.error is not None:
            return isinstance(self.error, str)
        is_table = isinstance(self.windows, pd.DataFrame) and not self.windows.empty
        return is_table and isinstance(self.verdict, dict) and self.verdict.keys() >= _ENTRIES

    def details(self) -> str:
        """Return details for --verbose."""
        if self.error is not None:
            return ""
        verdict = self.verdict
        chance = verdict["probability"]
        shown = "" if math.isnan(chance) else f", probability {percent(chance)}"
        own = [
            f", {key.removeprefix('verdict of ')}: {text}"
            for key, text in verdict.items()
            if key.startswith("verdict of ")
        ]
        return f"{verdict['windows']} windows{shown}, alarm {verdict['alarm']}{''.join(own)}"


@dataclass(frozen=True)
class Task:
    """A recording and a function that loads its model, small enough to be sent to a worker."""

    recording: ListedRecording
    load: Callable[[], Any]
    resample: bool = False
    n_threads: int = 1

    def __call__(self) -> Diagnosis:
        """Diagnose the recording. Errors are stored in the result, not raised."""
        try:
            before = file_state(self.recording)
            with parallel_config("threading", n_jobs=self.n_threads):
                found = self.load().diagnose(self.recording, self.resample)
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


def diagnose_all(
    args: argparse.Namespace, recordings: list[ListedRecording], model: Any, journal: Any = None
) -> list[Diagnosis]:
    """Diagnose recordings. Errors in one recording do not affect the others."""
    diagnoses = [None] * len(recordings)
    with Progress(len(recordings), "recordings", args) as progress:

        def finish(place, diagnosis, line):
            diagnoses[place] = diagnosis
            progress.step(f"{recordings[place].name}: {line}", diagnosis.details())

        # Missing files are reported before the first file is read.
        for place, recording in enumerate(recordings):
            if not recording.path.is_file():
                finish(place, Diagnosis.failed(f"{recording.path}: no such file"), "no such file")
            elif journal is not None and (known := journal.result(recording)) is not None:
                finish(place, known, f"{known.verdict['verdict']} (from an earlier run)")
        places = [place for place, known in enumerate(diagnoses) if known is None]
        with executors(args) as workers:
            tasks = _tasks(args, [recordings[place] for place in places], model, workers.count())
            for number, outcome in run_tasks(tasks, workers):
                place = places[number]
                if not isinstance(outcome, TaskFailed):
                    is_whole = isinstance(outcome, Diagnosis) and outcome.is_whole
                    reason = f"a worker returned a {type(outcome).__name__} that is no result"
                    outcome = outcome if is_whole else TaskFailed(reason)
                if isinstance(outcome, TaskFailed):
                    outcome = Diagnosis.failed(f"{recordings[place].path}: {outcome.reason}")
                if journal is not None:
                    journal.add(recordings[place], outcome)
                finish(place, outcome, outcome.error or outcome.verdict["verdict"])
    return diagnoses


def _tasks(args, recordings, model, n_workers):
    load, n_threads = model.loader(), 1
    if args.dask is not None:
        # A worker may run in another folder.
        recordings = [replace(each, path=each.path.absolute()) for each in recordings]
    elif not args.processes:
        # Each of a few recordings gets several threads.
        n_threads = max(n_workers // max(len(recordings), 1), 1)
    return [Task(recording, load, args.resample, n_threads) for recording in recordings]
