"""Run ``skarxlag diagnose``: diagnose the recordings, print and write the verdicts."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import pandas as pd
from joblib import Parallel, delayed, effective_n_jobs

from ...core.fault_locations import NO_FINDING
from ...core.files import write_atomically
from ..readers.entries import ListedRecording
from . import results
from .arguments import keywords, refuse
from .diagnosis import Diagnosis, diagnose_file
from .files import is_report, result_paths
from .messages import Reporter, as_command_error, counted, printable, show
from .models import RecordingModel, SavedModel, bearing_model

_ALARM = 3
#: Recordings that are listed before a remark.
_MOST_NAMES = 5


def run(args: argparse.Namespace) -> int:
    """Run the command with parsed arguments."""
    model = _model(args)
    reporter = Reporter(args.quiet)
    options = keywords(diagnose, args) | {"model": model, "reporter": reporter}
    rows, diagnoses = diagnose(**options | {"recordings": args.listed})
    table = results.verdict_table(rows)
    if not args.quiet:
        show(model.heading)
    show(table, *_remarks(rows, diagnoses), *_agreement(rows, model))
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
        Recordings that are diagnosed at a time, as in `joblib.Parallel`: by threads,
        or within ``joblib.parallel_config`` by its workers, such as those of Dask.
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
    with as_command_error():
        diagnoses = _diagnoses(
            recordings, model, resample, unit, n_jobs, reporter or Reporter()
        )
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


def _diagnoses(recordings, model, resample, unit, n_jobs, reporter):
    """Return the results of recordings; their lines are printed as they come."""
    reporter.start(len(recordings))
    # Each of a few recordings gets several threads.
    n_threads = max(effective_n_jobs(n_jobs) // max(len(recordings), 1), 1)
    results = Parallel(n_jobs, prefer="threads", return_as="generator")(
        delayed(diagnose_file)(recording, model.load, resample, n_threads, unit)
        for recording in recordings
    )
    diagnoses = []
    for recording, diagnosis in zip(recordings, results, strict=True):
        diagnoses.append(diagnosis)
        verdict = diagnosis.error or diagnosis.verdict["verdict"]
        reporter.step(f"{recording.name}: {verdict}")
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
    remarks = [diagnosis.remarks for diagnosis in diagnoses]
    remarks = pd.Series(remarks, rows["recording"]).explode().dropna()
    of_recordings: dict[str, list[str]] = {}
    for remark, about in remarks.groupby(remarks, sort=False):
        recordings = ", ".join(about.index)
        if 1 < len(rows) == len(about):
            recordings = "All recordings"
        elif len(about) > _MOST_NAMES:
            recordings = f"{len(about)} recordings"
        of_recordings.setdefault(recordings, []).append(remark)
    for recordings, sentences in of_recordings.items():
        yield f"{recordings}: {' '.join(sentences)}"


def _agreement(rows, model):
    """Yield how many verdicts agree with the stated condition, those of the training apart."""
    is_trained = rows["in_training"]
    for part, of_what in (
        (rows[~is_trained], "verdict"),
        (rows[is_trained], "verdict on recordings of the training"),
    ):
        n_right, n_known = results.agreement(part, model)
        if n_known:
            noun = of_what if n_known == 1 else of_what.replace("verdict", "verdicts")
            agrees = "agrees" if n_known == 1 else "agree"
            yield f"{n_right} of {n_known} {noun} {agrees} with the stated condition."
