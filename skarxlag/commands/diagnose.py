"""``skarxlag diagnose``: verdicts of a saved diagnoser on recordings."""

import argparse
import sys
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np

from .._answers import answers
from .._files import write_atomically
from .._version import __version__
from ..bearings import fault_orders
from ..recordings.table import list_recordings
from ..stretches import order_comparison
from ..verdicts import NO_SIGNAL
from .arguments import add_execution_arguments, bearing
from .batch import diagnose_all
from .errors import UsageError, as_command_error
from .journal import Journal
from .models import load_model, model_heading, stated_facts
from .names import below_common_folder
from .progress import add_progress_arguments
from .report import html_report, template
from .results import (
    SUFFIXES,
    check_output,
    is_result_file,
    recording_rows,
    result_paths,
    window_rows,
    write_tables,
)
from .sources import add_source_arguments, named_recordings
from .terminal import verdict_table

_DESCRIPTION = """\
Diagnose recordings with a diagnoser that `fit` or `save_diagnoser` saved: one verdict for each
recording, from the evidence of all its windows. A .csv among RECORDING holds samples; a table of
recordings, with the columns that `fit` takes, is given with --table. Exit status: 0 if all
recordings were diagnosed, 1 if some could not be, 2 if an argument is wrong, 3 with --fail-on alarm
if there is a verdict other than the healthy condition, or a recording is none of the conditions.
"""
_ALARM = 3
#: Speeds that differ by less than this share are one.
_SAME_SPEED = 0.02
#: Recordings that a remark names.
_MOST_NAMES = 5


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.description = _DESCRIPTION
    parser.add_argument("model", type=Path, metavar="MODEL.skops", help="what fit has saved")
    parser.add_argument(
        "recordings",
        nargs="*",
        metavar="RECORDING",
        help="a file, a folder, or a glob such as 'runs/*/acc_*.tdms'",
    )
    parser.add_argument("--table", type=Path, help="csv table of further recordings")
    add_source_arguments(parser, "each RECORDING")
    parser.add_argument(
        "--resample",
        action="store_true",
        help="bring recordings of another sampling rate to that of the model; without it they fail",
    )
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
        "--bearing",
        type=bearing,
        metavar="N,D,P[,A]",
        help="mark the orders of the faults in the report's order spectra: elements, diameter of "
        "an element, pitch diameter in the same unit, and contact angle in degrees",
    )
    parser.add_argument(
        "--force", action="store_true", help="let -o replace a file that is no result of diagnose"
    )
    parser.add_argument(
        "--fail-on",
        choices=["alarm"],
        help="exit status 3 if a verdict is not the healthy condition, or a recording is none of "
        "the conditions",
    )
    add_execution_arguments(parser)
    add_progress_arguments(parser)
    parser.set_defaults(run=run, fail=parser.error)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
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
        _check_orders(args.model, model)
    with as_command_error():
        recordings = named_recordings(args)
        if args.rpm is not None:
            recordings = [replace(each, rpm=args.rpm) for each in recordings]
        if args.table is not None:
            recordings += list_recordings(args.table)
    if args.output is not None:
        _check_output(args, recordings)
    with as_command_error(), _journal(args) as journal:
        diagnoses = diagnose_all(args, recordings, journal)
        rows = recording_rows(recordings, diagnoses)
        if args.output is not None:
            _write(args, model, recordings, diagnoses, rows)
    print(_report(args, model, diagnoses, rows))
    failed = rows.loc[rows["error"] != "", "error"]
    if len(failed):
        heading = f"{len(failed)} of {len(rows)} recordings failed:"
        print(heading, *failed, sep="\n  ", file=sys.stderr)
    if args.fail_on == "alarm" and _has_alarm(rows, model):
        return _ALARM
    return 1 if len(failed) else 0


def _check_arguments(args):
    if not args.recordings and args.table is None:
        raise UsageError("argument RECORDING: none given, expected files or --table")
    for name in ("pattern", "channel", "sampling_rate", "dtype", "rpm"):
        if getattr(args, name) is not None and not args.recordings:
            option = "--" + name.replace("_", "-")
            raise UsageError(f"argument {option}: belongs to RECORDING; the table states its own")

    if args.bearing is not None and not _is_report(args.output):
        raise UsageError("argument --bearing: belongs to a report, -o FILE.html")


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
    inputs = [args.model, *(recording.path for recording in recordings)]
    inputs += [] if args.table is None else [args.table]
    for path in result_paths(args.output):
        check_output(path, inputs, suffixes=SUFFIXES, is_own=is_result_file, force=args.force)


def _write(args, model, recordings, diagnoses, rows):
    if _is_report(args.output):
        faults = None if args.bearing is None else fault_orders(args.bearing)
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


def _has_alarm(rows, model):
    quiet = [model.conditions[0], NO_SIGNAL]
    is_loud = rows["verdict"].notna() & ~rows["verdict"].isin(quiet)
    if "none of these" in rows:
        is_loud |= rows["none of these"].fillna(False).astype(bool)
    return bool(is_loud.any())


def _report(args, model, diagnoses, rows):
    """What a person reads: the model, the table of verdicts, and what to make of them."""
    lines = [model_heading(model)]
    folder, names = below_common_folder(rows["recording"])
    lines += [f"Recordings below {folder}"] if folder else []
    rows = rows.assign(recording=names)
    found = rows[rows["error"] == ""]
    if len(found):
        lines.append(verdict_table(found))
    by_remark = {}
    for name, diagnosis in zip(names, diagnoses, strict=True):
        for remark in diagnosis.remarks:
            by_remark.setdefault(remark, []).append(name)
    for remark, about in by_remark.items():
        more = f" and {len(about) - _MOST_NAMES} more" if len(about) > _MOST_NAMES else ""
        lines.append(f"{', '.join(about[:_MOST_NAMES])}{more}: {remark}")
    is_assumed = any(d.error is None and d.sampling_rate is None for d in diagnoses)
    if is_assumed and model.sampling_rate is not None:
        lines.append(
            f"No sampling rate is stated for some files; {model.sampling_rate:g} Hz was assumed."
        )
    if answers(model.diagnoser).takes_rpm:
        lines.append(_speed_line(found))
    if found[["confidence", "alarms"]].notna().all(axis=1).any():
        lines.append("Alarms depend on the speed; for detection across speeds fit a detector.")
    if "p-value" in found and found["p-value"].notna().any():
        lines.append(_known_line(model, found))
    if args.output is not None:
        lines.append("Written: " + ", ".join(str(path) for path in result_paths(args.output)))
    return "\n".join(lines)


def _speed_line(found):
    """On which speeds the verdicts rest."""
    unknown = found["rpm"].isna() if "rpm" in found else np.ones(len(found), dtype=bool)
    if not unknown.any():
        return "Verdicts rest on the orders of the shaft at the speeds above, give or take 10 %."
    return (
        f"{unknown.sum()} of {len(found)} recordings state no speed (column rpm, --rpm): all from "
        "0.4 to 2.5 times the speed of fit were tried."
    )


def _known_line(model, found):
    """What the p-values are, and where they tell little."""
    line = (
        "p-value: how often windows of the nearest condition are as far off; below "
        f"{answers(model.known).stated_rate:g} a recording is none of these."
    )
    speeds = found["rpm"] if "rpm" in found else np.full(len(found), np.nan)
    far = [not _is_near(speed, model.train_rpm) for speed in speeds]
    if not any(far):
        return line
    return (
        f"{line} {sum(far)} of {len(found)} recordings are of another speed than the training's, "
        "or of none that is stated: there most unknown conditions are taken for a known one."
    )


def _is_near(speed, known):
    return known is not None and any(abs(speed / each - 1) < _SAME_SPEED for each in known)
