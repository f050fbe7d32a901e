"""``skarxlag diagnose``: verdicts of a saved diagnoser on recordings."""

import argparse
import sys
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

from .._files import write_atomically
from .._version import __version__
from ..bearings import bearing_orders
from ..fault_places import HEALTHY
from ..recordings.listing import list_recordings
from ..stretches import order_comparison
from .arguments import add_execution_arguments, add_source_arguments, bearing, named_recordings
from .batch import diagnose_all
from .by_orders import diagnose_by_orders, heading, is_model
from .journal import Journal
from .messages import UsageError, add_progress_arguments, as_command_error, below_common_folder
from .models import load_model, model_heading, stated_facts
from .report import html_report, template
from .results import (
    SUFFIXES,
    check_output,
    is_result_file,
    recording_rows,
    result_paths,
    verdict_table,
    window_rows,
    write_tables,
)

_DESCRIPTION = """\
Diagnose recordings with a diagnoser that `fit` or `save_diagnoser` saved: one verdict for each
recording, from the evidence of all its windows. With --bearing and without a model, name the place
of a fault from the orders of the bearing. A .csv among RECORDING holds samples; a table of
recordings, with the columns that `fit` takes, is given with --table. Exit status: 0 if all
recordings were diagnosed, 1 if some could not be, 2 if an argument is wrong, 3 with --fail-on alarm
if a verdict is not the healthy condition.
"""
_ALARM = 3
#: Recordings that a remark names.
_MOST_NAMES = 5


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.description = _DESCRIPTION
    parser.add_argument(
        "model",
        nargs="?",
        type=Path,
        metavar="MODEL.skops",
        help="what fit has saved; not needed with --bearing",
    )
    parser.add_argument(
        "recordings",
        nargs="*",
        metavar="RECORDING",
        help="a file, a folder, or a glob such as 'runs/*/acc_*.tdms'",
    )
    parser.add_argument("--table", type=Path, help="csv table of further recordings")
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FILE",
        help="write a row for each recording and a row for each window: .csv or .parquet (the "
        "windows into a second file, FILE_windows), .json, or .html, a report to read and print. A "
        "run that is interrupted goes on where it stopped when it is started again with this file",
    )
    parser.add_argument(
        "--fail-on",
        choices=["alarm"],
        help="exit status 3 if a verdict is not the healthy condition",
    )
    parser.add_argument(
        "--resample",
        action="store_true",
        help="bring recordings of another sampling rate to that of the model; without it they fail",
    )
    parser.add_argument(
        "--bearing",
        type=bearing,
        metavar="BEARING",
        help="without a model: name the place of a fault from the orders of this bearing. With a "
        "model: mark them in the report. A name such as 6205; or elements, diameter of an element, "
        "pitch diameter and contact angle, 9,7.94,39.04; or orders, outer=3.585,inner=5.415",
    )
    add_progress_arguments(parser)
    add_source_arguments(parser, "each RECORDING")
    add_execution_arguments(parser)
    parser.add_argument_group("files").add_argument(
        "--force", action="store_true", help="let -o replace a file that is no result of diagnose"
    )
    parser.set_defaults(run=run, fail=parser.error)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    if args.bearing is not None and (args.model is None or not is_model(args.model)):
        return _run_by_orders(args)
    if args.model is None:
        raise UsageError("argument MODEL.skops: none given, expected a model or --bearing")
    _check_arguments(args)
    model = load_model(args.model)
    if args.fail_on is not None and model.healthy is None:
        raise UsageError(
            f"argument --fail-on: {args.model} does not state which condition is healthy; save it "
            "with save_diagnoser(..., conditions=[...]), the healthy one first"
        )
    if args.resample and model.sampling_rate is None:
        raise UsageError(f"argument --resample: {args.model} does not state a sampling rate")
    if args.bearing is not None:
        if not _is_report(args.output):
            raise UsageError("argument --bearing: belongs to a report, -o FILE.html")
        _check_orders(args.model, model)
    recordings = _listed(args)
    with as_command_error(), _journal(args) as journal:
        diagnoses = diagnose_all(args, recordings, journal)
        rows = recording_rows(recordings, diagnoses, model.healthy)
        if args.output is not None:
            _write(args, model, recordings, diagnoses, rows)
    return _told(args, model, diagnoses, rows, model.healthy)


def _run_by_orders(args):
    if args.model is not None:
        args.recordings = [str(args.model), *args.recordings]
    _check_arguments(args)
    if args.resample:
        raise UsageError("argument --resample: belongs to a model")
    if _is_report(args.output):
        raise UsageError(f"argument -o/--output: {args.output}, a report needs a model; expected a "
                         "name that ends in .csv, .json or .parquet")  # fmt: skip
    recordings = _listed(args)
    diagnoses = diagnose_by_orders(args, recordings)
    rows = recording_rows(recordings, diagnoses, HEALTHY)
    if args.output is not None:
        windows = window_rows(recordings, diagnoses)
        with as_command_error():
            write_tables(args.output, rows, windows, {"bearing": args.bearing})
    return _told(args, None, diagnoses, rows, HEALTHY)


def _listed(args):
    with as_command_error():
        recordings = named_recordings(args)
        if args.output is not None:
            # Results of an earlier run may lie in the folder of the recordings.
            own = {path.absolute() for path in result_paths(args.output)}
            named = {Path(each).absolute() for each in args.recordings}
            recordings = [r for r in recordings if r.path.absolute() not in own - named]
        if args.rpm is not None:
            recordings = [replace(each, rpm=args.rpm) for each in recordings]
        if args.table is not None:
            recordings += list_recordings(args.table)
    if args.output is not None:
        _check_output(args, recordings)
    return recordings


def _told(args, model, diagnoses, rows, healthy):
    """Print the report; return the exit status."""
    for line in _report(args, model, diagnoses, rows):
        print(line)
    failed = rows.loc[rows["error"] != "", "error"]
    if len(failed):
        counts = f"{len(failed)} of {len(rows)} recordings failed:"
        print(counts, *failed, sep="\n  ", file=sys.stderr)
    if args.fail_on == "alarm" and (rows["verdict"].astype(str) != str(healthy)).any():
        return _ALARM
    return 1 if len(failed) else 0


def _check_arguments(args):
    if not args.recordings and args.table is None:
        raise UsageError("argument RECORDING: none given, expected files or --table")
    for name in ("pattern", "channel", "sampling_rate", "dtype", "rpm"):
        if getattr(args, name) is not None and not args.recordings:
            option = "--" + name.replace("_", "-")
            raise UsageError(f"argument {option}: belongs to RECORDING; the table states its own")


def _check_orders(path, model):
    try:
        order_comparison(model.diagnoser)
    except ValueError as error:
        raise UsageError(f"argument --bearing: {path}: {error}") from error


def _is_report(output):
    return output is not None and output.suffix.lower() == ".html"


def _check_output(args, recordings):
    if _is_report(args.output):
        template()
    inputs = [recording.path for recording in recordings]
    inputs += [] if args.model is None else [args.model]
    inputs += [] if args.table is None else [args.table]
    for path in result_paths(args.output):
        check_output(path, inputs, suffixes=SUFFIXES, is_own=is_result_file, force=args.force)


def _write(args, model, recordings, diagnoses, rows):
    if _is_report(args.output):
        faults = None if args.bearing is None else bearing_orders(args.bearing)
        content = html_report(
            model, recordings, diagnoses, rows, resample=args.resample, faults=faults
        )
        write_atomically(args.output, content.encode())
    else:
        windows = window_rows(recordings, diagnoses)
        write_tables(args.output, rows, windows, {"model": stated_facts(model)})


def _journal(args):
    if args.output is None:
        return nullcontext()
    return Journal(
        args.output, args.model, [__version__, args.resample, args.output.suffix.lower()]
    )


def _report(args, model, diagnoses, rows):
    """Lines for a person: the model, the verdicts, and each remark once."""
    folder, names = below_common_folder(rows["recording"])
    table = verdict_table(rows.assign(recording=names))
    if args.quiet:
        return [table]
    lines = [heading(args.bearing) if model is None else model_heading(model)]
    lines += [f"Recordings below {folder}"] if folder else []
    lines.append(table)
    by_remark = {}
    for name, diagnosis in zip(names, diagnoses, strict=True):
        for remark in diagnosis.remarks:
            by_remark.setdefault(remark, []).append(name)
    for remark, about in by_remark.items():
        listed = ", ".join(about[:_MOST_NAMES])
        more = f" and {len(about) - _MOST_NAMES} more" if len(about) > _MOST_NAMES else ""
        of = "All recordings" if 1 < len(rows) == len(about) else f"{listed}{more}"
        lines.append(f"{of}: {remark}")
    if "condition" in rows and rows["condition"].notna().any():
        known = rows[rows["condition"].notna()]
        right = (known["verdict"].astype(str) == known["condition"]).sum()
        lines.append(f"{right} of {len(known)} verdicts are the stated condition.")
    is_assumed = any(d.error is None and d.sampling_rate is None for d in diagnoses)
    if is_assumed and model is not None and model.sampling_rate is not None:
        lines.append(
            f"No sampling rate is stated for some files; {model.sampling_rate:g} Hz was assumed."
        )
    if args.output is not None:
        lines.append("Written: " + ", ".join(str(path) for path in result_paths(args.output)))
    return lines
