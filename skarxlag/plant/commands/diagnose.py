"""Run ``skarxlag diagnose``: diagnose the recordings, print and write the verdicts."""

import argparse
import sys
from collections.abc import Sequence
from contextlib import closing, nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
from joblib import effective_n_jobs

from ..._version import __version__
from ...core.fault_locations import NO_FINDING
from ...persistence.files import write_atomically
from ..readers.entries import ListedRecording
from . import results
from .diagnosis import Diagnosis, diagnose_file
from .files import is_report, result_paths
from .journal import Journal
from .messages import (
    Reporter,
    as_command_error,
    counted,
    keywords,
    printable,
    refuse,
    show,
)
from .models import RecordingModel, SavedModel, bearing_model
from .workers import run_tasks

_ALARM = 3
#: Recordings that are listed before a remark.
_MOST_NAMES = 5


def run(args: argparse.Namespace) -> int:
    """Run the command with parsed arguments."""
    model = _model(args)
    rows, diagnoses = diagnose(**keywords(diagnose, args) | {"model": model})
    table = results.verdict_table(rows)
    if not args.quiet:
        show(model.heading)
    show(table, *_remarks(rows, diagnoses))
    if args.output is not None and not args.quiet:
        show("Written: " + ", ".join(map(str, result_paths(args.output))))
    failed = rows[rows["error"] != ""]
    if len(failed):
        counts = f"{len(failed)} of {counted(len(rows), 'recording')} failed:"
        reasons = failed["recording"] + ": " + failed["error"]
        print(counts, *map(printable, reasons), sep="\n  ", file=sys.stderr)
    is_calm = rows["verdict"].astype(str).isin([str(model.healthy), NO_FINDING])
    if args.fail_on == "alarm" and not is_calm.all():
        return _ALARM
    return 1 if len(failed) else 0


def diagnose(
    recordings: Sequence[ListedRecording],
    model: RecordingModel,
    *,
    output: Path | None = None,
    bearing: str | None = None,
    unit: str | None = None,
    resample: bool = False,
    n_jobs: int | None = None,
    processes: bool = False,
    dask: str | None = None,
    reporter: Reporter | None = None,
) -> tuple[pd.DataFrame, list[Diagnosis]]:
    """Diagnose recordings, and write the results.

    Parameters
    ----------
    recordings : sequence of ListedRecording
        The recordings.
    model : RecordingModel
        The model.
    output : Path or None, default=None
        File of the results: .csv, .parquet, .json or .html. None: nothing is written.
    bearing : str or None, default=None
        Bearing whose lines are marked in a report. None: that of the model.
    unit : str or None, default=None
        Unit of signals whose files state none.
    resample : bool, default=False
        Whether recordings are brought to the sampling rate of the model.
    n_jobs : int or None, default=None
        Recordings that are diagnosed at a time; -1: one for each core.
    processes : bool, default=False
        Whether each thread has a process that diagnoses them.
    dask : str or None, default=None
        Address of a Dask scheduler, whose workers diagnose them instead.
    reporter : Reporter or None, default=None
        Progress reporter that counts the recordings. None prints nothing.

    Returns
    -------
    rows : DataFrame
        A row for each recording.
    diagnoses : list of Diagnosis
        Their results. Errors in one recording do not affect the others.

    Raises
    ------
    CommandError
        If the results cannot be written.
    """
    settings = [model.identity, model.heading, __version__, resample, unit]
    kept = nullcontext() if output is None else Journal(output, settings)
    with as_command_error(), kept as journal:
        # Each of a few recordings gets several threads.
        n_threads = max(effective_n_jobs(n_jobs) // max(len(recordings), 1), 1)
        task = partial(
            diagnose_file,
            load=model.load,
            resample=resample,
            n_threads=1 if dask else n_threads,
            unit=unit,
        )
        run = partial(run_tasks, n_jobs=n_jobs, processes=processes, dask=dask)
        diagnoses = _diagnoses(recordings, task, run, journal, reporter or Reporter())
        rows = results.recording_rows(recordings, diagnoses, model)
        if is_report(output):
            # Other outputs do not need what draws.
            from ..pages.report import html_report

            page = html_report(model, recordings, diagnoses, rows, resample, bearing)
            write_atomically(output, page.encode(), follows_links=False)
        elif output is not None:
            windows = results.window_rows(recordings, diagnoses)
            results.write_tables(output, rows, windows, model.facts)
    return rows, diagnoses


def _diagnoses(recordings, task, run, journal, reporter):
    """Return the results of a task for recordings; a journal keeps them as they come."""
    diagnoses: list[Any] = [None] * len(recordings)
    waiting = []
    reporter.start(len(recordings))

    def finish(place, diagnosis, note=""):
        diagnoses[place] = diagnosis
        verdict = diagnosis.error or diagnosis.verdict["verdict"]
        reporter.step(f"{recordings[place].name}: {verdict}{note}")

    for place, recording in enumerate(recordings):
        earlier = None if journal is None else journal.result(recording)
        if earlier is None:
            waiting.append(place)
        else:
            finish(place, earlier, " (from an earlier run)")
    # A worker of a cluster may run in another folder.
    tasks = [
        partial(
            task, replace(recordings[place], path=recordings[place].path.absolute())
        )
        for place in waiting
    ]
    with closing(run(tasks)) as outcomes:
        for number, outcome in outcomes:
            place = waiting[number]
            if isinstance(outcome, Exception):
                outcome = Diagnosis.failed(recordings[place], outcome)
            if journal is not None:
                journal.add(recordings[place], outcome)
            finish(place, outcome)
    return diagnoses


def _model(args):
    """Load the model and check that the other arguments fit it."""
    if args.model is None:
        return bearing_model(args.bearing)
    model = SavedModel(args.model, args.bearing)
    if not model.takes_bearing and not is_report(args.output):
        refuse(
            args,
            ["bearing"],
            f"{args.model} was fitted without one, so it can only mark lines in a "
            "report, -o FILE.html",
        )
    if model.healthy is None:
        refuse(
            args, ["fail_on"], f"{args.model} does not state which condition is healthy"
        )
    if model.sampling_rate is None:
        refuse(args, ["resample"], f"{args.model} does not state a sampling rate")
    return model


def _remarks(rows, diagnoses):
    """Yield the remarks, each once, behind the recordings that they are about."""
    about: dict[str, list[str]] = {}
    for name, diagnosis in zip(rows["recording"], diagnoses, strict=True):
        for remark in diagnosis.remarks:
            about.setdefault(remark, []).append(name)
    of_recordings: dict[str, list[str]] = {}
    for remark, names in about.items():
        recordings = ", ".join(names)
        if 1 < len(rows) == len(names):
            recordings = "All recordings"
        elif len(names) > _MOST_NAMES:
            recordings = f"{len(names)} recordings"
        of_recordings.setdefault(recordings, []).append(remark)
    for recordings, sentences in of_recordings.items():
        yield f"{recordings}: {' '.join(sentences)}"
