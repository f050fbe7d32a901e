"""Run ``skarxlag diagnose``: diagnose the recordings, print and write the verdicts."""

import argparse
import sys
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from typing import Any

import pandas as pd

from ..._version import __version__
from ...core.files import write_atomically
from ..readers.entries import ListedRecording
from . import results
from .arguments import refuse
from .diagnosis import Diagnosis, diagnose_file
from .files import is_report, result_paths
from .journal import Journal
from .messages import Progress, as_command_error, counted
from .models import RecordingModel, SavedModel, bearing_model
from .workers import executors, run_tasks

_ALARM = 3
#: Recordings that are listed before a remark.
_MOST_NAMES = 5


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    model = _model(args)
    recordings = args.listed
    settings = [model.identity, __version__, args.resample]
    kept = nullcontext() if args.output is None else Journal(args.output, settings)
    with as_command_error(), kept as journal:
        diagnoses = diagnose_all(args, recordings, model, journal)
        rows = results.recording_rows(recordings, diagnoses, model.healthy)
        if is_report(args.output):
            # Other outputs do not need what draws.
            from ..pages.report import html_report

            page = html_report(
                model, recordings, diagnoses, rows, args.resample, args.bearing
            )
            write_atomically(args.output, page.encode())
        elif args.output is not None:
            windows = results.window_rows(recordings, diagnoses)
            results.write_tables(args.output, rows, windows, model.summary)
    print(*_lines(args, model, diagnoses, rows), sep="\n")
    failed = rows[rows["error"] != ""]
    if len(failed):
        counts = f"{len(failed)} of {counted(len(rows), 'recording')} failed:"
        reasons = failed["recording"] + ": " + failed["error"]
        print(counts, *reasons, sep="\n  ", file=sys.stderr)
    is_healthy = rows["verdict"].astype(str) == str(model.healthy)
    if args.fail_on == "alarm" and not is_healthy.all():
        return _ALARM
    return 1 if len(failed) else 0


def diagnose_all(
    args: argparse.Namespace,
    recordings: list[ListedRecording],
    model: RecordingModel,
    journal: Journal | None,
) -> list[Diagnosis]:
    """Return diagnoses of recordings. Errors in one recording do not affect the others."""
    diagnoses: list[Any] = [None] * len(recordings)
    waiting = []
    progress = Progress(len(recordings), args)

    def finish(place, diagnosis, note=""):
        diagnoses[place] = diagnosis
        verdict = diagnosis.error or diagnosis.verdict["verdict"]
        progress.step(f"{recordings[place].name}: {verdict}{note}", diagnosis.details())

    # Missing files are reported before the first file is read.
    for place, recording in enumerate(recordings):
        if not recording.path.is_file():
            finish(place, Diagnosis.failed(recording, "no such file"))
            continue
        earlier = None if journal is None else journal.result(recording)
        if earlier is None:
            waiting.append(place)
        else:
            finish(place, earlier, " (from an earlier run)")
    with executors(args) as workers:
        # Each of a few recordings gets several threads.
        n_threads = max(workers.count() // max(len(waiting), 1), 1)
        n_threads = 1 if args.dask or args.processes else n_threads
        tasks = []
        for place in waiting:
            # A worker of a cluster may run in another folder.
            path = recordings[place].path.absolute()
            recording = replace(recordings[place], path=path)
            tasks.append(
                partial(diagnose_file, recording, model.load, args.resample, n_threads)
            )
        for number, outcome in run_tasks(tasks, workers):
            place = waiting[number]
            diagnosis = _checked(recordings[place], outcome)
            if journal is not None:
                journal.add(recordings[place], diagnosis)
            finish(place, diagnosis)
    return diagnoses


def _checked(recording, outcome):
    """Return the result of a worker, or that the recording failed if it is none."""
    if isinstance(outcome, Diagnosis) and outcome.is_whole:
        return outcome
    if not isinstance(outcome, Exception):
        outcome = f"a worker returned a {type(outcome).__name__} that is no result"
    return Diagnosis.failed(recording, outcome)


def _model(args):
    """Load the model and check that the other arguments fit it."""
    if args.model is None:
        return bearing_model(args.bearing)
    model = SavedModel(args.model)
    if model.healthy is None:
        refuse(
            args, ["fail_on"], f"{args.model} does not state which condition is healthy"
        )
    if model.sampling_rate is None:
        refuse(args, ["resample"], f"{args.model} does not state a sampling rate")
    return model


def _lines(args, model, diagnoses, rows):
    """Return lines for a person: the model, the verdicts, and each remark once."""
    table = results.verdict_table(rows)
    if args.quiet:
        return [table]
    lines = [model.heading, table]
    remarks = [diagnosis.remarks for diagnosis in diagnoses]
    remarks = pd.Series(remarks, rows["recording"]).explode().dropna()
    for remark, about in remarks.groupby(remarks, sort=False):
        recordings = ", ".join(about.index)
        if 1 < len(rows) == len(about):
            recordings = "All recordings"
        elif len(about) > _MOST_NAMES:
            recordings = f"{len(about)} recordings"
        lines.append(f"{recordings}: {remark}")
    n_right, n_known = results.agreement(rows, model)
    if n_known:
        lines.append(
            f"{n_right} of {counted(n_known, 'verdict')} "
            f"{'agrees' if n_known == 1 else 'agree'} with the stated condition."
        )
    if args.output is not None:
        lines.append("Written: " + ", ".join(map(str, result_paths(args.output))))
    return lines
