"""Diagnose recordings with a model that `fit` or `save_diagnoser` saved.

Each recording gets one verdict from the evidence of all its windows. With --bearing and without a
model, the orders of the bearing name the place of a fault; with a model, they are marked in the
report. A .csv among RECORDING holds samples; a table of recordings, with the columns that `fit`
takes, is given with --table. With -o, results are written as .csv or .parquet (rows of windows in a
second file, FILE_windows), .json, or .html, a report to read and print. An interrupted run goes on
where it stopped if it is started again with the same file. Exit status: 0 if all recordings were
diagnosed, 1 if some could not be, 2 if an argument is wrong, 3 with --fail-on alarm if a verdict is
not the healthy condition.
"""

import argparse
import sys
from contextlib import nullcontext
from pathlib import Path

import pandas as pd

from .._files import write_atomically
from .._version import __version__
from ..bearings import bearing_orders
from ..recordings.listing import list_recordings
from ..stretches import order_comparison
from . import arguments, results
from .arguments import flag, option, refuse
from .diagnosis import diagnose_all
from .journal import Journal
from .messages import UsageError, add_progress_arguments, as_command_error
from .models import BearingModel, SavedModel, is_model_file

_ALARM = 3
#: Recordings that are listed before a remark.
_MOST_NAMES = 5


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("model", nargs="?", type=Path, metavar="MODEL.skops", help="or --bearing")
    text = "a file, a folder, or a glob such as 'runs/*/acc_*.tdms'"
    parser.add_argument("recordings", nargs="*", metavar="RECORDING", help=text)
    option(parser, "--table", "csv table of further recordings", Path, "FILE.csv")
    option(parser, "-o --output", "write .csv, .parquet, .json or .html", Path, "FILE")
    parser.add_argument("--fail-on", choices=["alarm"], help="exit status 3 if one is not healthy")
    flag(parser, "--resample", "bring recordings to the model's sampling rate")
    option(parser, "--bearing", arguments.BEARING, arguments.bearing, "BEARING")
    add_progress_arguments(parser)
    arguments.add_source_arguments(parser, "each RECORDING, or of lines of the table without them")
    group = parser.add_argument_group("workers")
    option(group, "--n-jobs", "number of workers; default: all cores", arguments.job_count)
    where = group.add_mutually_exclusive_group()
    flag(where, "--processes", "not threads; for small files, and files that crash their reader")
    text = "workers of a dask.distributed scheduler, such as tcp://host:8786, read the files"
    option(where, "--dask", text, metavar="ADDRESS")
    parser.set_defaults(n_jobs=-1)
    flag(parser, "--force", "let -o replace a file that is no result of diagnose")


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    model = _model(args)
    recordings = _listed(args)
    settings = [model.identity, __version__, args.resample]
    kept = nullcontext() if args.output is None else Journal(args.output, settings)
    with as_command_error(), kept as journal:
        diagnoses = diagnose_all(args, recordings, model, journal)
        rows = results.recording_rows(recordings, diagnoses, model.healthy)
        if _is_report(args):
            faults = None if args.bearing is None else bearing_orders(args.bearing)
            page = results.html_report(model, recordings, diagnoses, rows, args.resample, faults)
            write_atomically(args.output, page.encode())
        elif args.output is not None:
            windows = results.window_rows(recordings, diagnoses)
            results.write_tables(args.output, rows, windows, model.summary)
    print(*_lines(args, model, diagnoses, rows), sep="\n")
    failed = rows[rows["error"] != ""]
    if len(failed):
        counts = f"{len(failed)} of {len(rows)} recordings failed:"
        reasons = failed["recording"] + ": " + failed["error"]
        print(counts, *reasons, sep="\n  ", file=sys.stderr)
    if args.fail_on == "alarm" and (rows["verdict"].astype(str) != str(model.healthy)).any():
        return _ALARM
    return 1 if len(failed) else 0


def _model(args):
    """Load the model and check that the other arguments fit it."""
    path = args.model
    is_recording = path is not None and path.suffix != ".skops" and not is_model_file(path)
    if args.bearing is not None and is_recording:
        args.recordings.insert(0, str(path))
        path = None
    if path is None and args.bearing is None:
        raise UsageError("argument MODEL.skops: none given, expected a model or --bearing")
    if not args.recordings and args.table is None:
        raise UsageError("argument RECORDING: none given, expected files or --table")
    if path is None:
        refuse(args, ["resample"], "belongs to a model")
        return BearingModel(args.bearing)
    model = SavedModel(path)
    if model.healthy is None:
        refuse(args, ["fail_on"], f"{path} does not state which condition is healthy")
    if model.sampling_rate is None:
        refuse(args, ["resample"], f"{path} does not state a sampling rate")
    if not _is_report(args):
        refuse(args, ["bearing"], "belongs to a report, -o FILE.html")
    if args.bearing is not None:
        with as_command_error():
            order_comparison(model.diagnoser)
    return model


def _is_report(args):
    return args.output is not None and args.output.suffix.lower() == ".html"


def _listed(args):
    own = [] if args.output is None else results.result_paths(args.output)
    with as_command_error():
        recordings = arguments.named_recordings(args)
        # Results of an earlier run may lie in the folder of the recordings.
        found = {path.absolute() for path in own}
        found -= {Path(each).absolute() for each in args.recordings}
        recordings = [each for each in recordings if each.path.absolute() not in found]
        if args.table is not None:
            # With recordings, the facts in the arguments are theirs.
            is_alone = not args.recordings
            of_table = arguments.table_recordings(args) if is_alone else list_recordings(args.table)
            recordings += of_table
    inputs = [args.model, args.table, *(recording.path for recording in recordings)]
    for path in own:
        results.check_output(path, inputs, results.is_result_file, args.force, results.SUFFIXES)
    if _is_report(args):
        # Without jinja2 this fails, before the recordings are read.
        results.template()
    return recordings


def _lines(args, model, diagnoses, rows):
    """Return lines for a person: the model, the verdicts, and each remark once."""
    table = results.verdict_table(rows)
    if args.quiet:
        return [table]
    lines, remarks = [model.heading, table], [each.remarks for each in diagnoses]
    remarks = pd.Series(remarks, rows["recording"]).explode().dropna()
    for remark, about in remarks.groupby(remarks, sort=False):
        of = ", ".join(about.index) if len(about) <= _MOST_NAMES else f"{len(about)} recordings"
        lines.append(f"{'All recordings' if 1 < len(rows) == len(about) else of}: {remark}")
    n_right, n_known = results.agreement(rows, model)
    if n_known:
        lines.append(f"{n_right} of {n_known} verdicts agree with the stated condition.")
    if args.output is not None:
        lines.append("Written: " + ", ".join(map(str, results.result_paths(args.output))))
    return lines
