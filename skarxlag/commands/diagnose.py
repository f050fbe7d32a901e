"""Run ``skarxlag diagnose``: diagnose the recordings, print and write the verdicts."""

import argparse
import sys
from contextlib import nullcontext

import pandas as pd

from .._version import __version__
from ..core.files import write_atomically
from . import results
from .arguments import refuse
from .bearing_orders import BearingOrders
from .diagnosis import diagnose_all
from .files import is_report, result_paths
from .journal import Journal
from .messages import as_command_error, counted
from .models import SavedModel

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
            from .report import html_report

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


def _model(args):
    """Load the model and check that the other arguments fit it."""
    if args.model is None:
        return BearingOrders(args.bearing)
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
