"""Calibrate a diagnoser on the recordings that a table lists, and save it.

The table is a csv file with the columns path, condition, specimen, load, rpm,
sampling_rate and channel. Only path is always needed, see
skarxlag.read_recording_table. Without --healthy, the only condition is taken that is
called healthy, normal, good, ok, intact, nominal, baseline, n or h. The detector needs
healthy recordings only, best of several speeds, and names no fault; it is the default
if the only condition is healthy. Otherwise the rows are stretches of a second, or of
ten revolutions if they take longer, or windows of 1200 samples if the recordings are too
short or an option cuts windows (of 4800 for the detector). With --bearing and
recordings of faults, orders and spectra make one verdict; without faults, healthy
recordings set the limits.
"""

import argparse
from pathlib import Path

from .. import arguments, messages
from ..arguments import BEARING, bearing, flag, option, positive_int
from ..files import check_output, is_model_file
from ..messages import as_command_error

#: Kinds of diagnosers.
KINDS = ("diagnoser", "stretches", "detector")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "table", type=Path, help="csv table of the recordings, a folder, or a glob"
    )
    text = "the saved model"
    parser.add_argument(
        "-o", "--output", type=Path, required=True, metavar="FILE.skops", help=text
    )
    option(
        parser,
        "--healthy",
        "healthy condition, or none if no recording is",
        metavar="LABEL",
    )
    option(
        parser,
        "--false-alarm-rate",
        "of healthy rows; default: 0.01",
        arguments.rate,
        "SHARE",
    )
    option(
        parser, "--n-jobs", "number of threads; default: all cores", arguments.job_count
    )
    parser.set_defaults(false_alarm_rate=0.01, n_jobs=-1)
    flag(parser, "-q --quiet", "print no progress")
    arguments.add_source_arguments(
        parser, "recordings whose line in the table lacks them"
    )
    model = parser.add_argument_group("model")
    model.add_argument(
        "--diagnoser", choices=KINDS, help="default: as the recordings allow"
    )
    option(
        model,
        "--bearing",
        f"name fault locations by orders: {BEARING}",
        bearing,
        "BEARING",
    )
    option(
        model, "--outputs", "the first N channels are sensors; default: 1", positive_int
    )
    flag(
        model,
        "--fixed-gain",
        "healthy limits use the level; it needs the same sensor and gain",
    )
    cut = parser.add_argument_group("windows")
    option(cut, "--window-length", "samples in a window", arguments.window_length)
    option(cut, "--resample-to", "sampling rate of all", arguments.sampling_rate, "HZ")
    flag(parser, "--force", "let -o replace a file that is no saved diagnoser")


def check(args: argparse.Namespace) -> None:
    """List the recordings, and check what needs no computation."""
    with as_command_error():
        args.listed = arguments.table_recordings(args)
        inputs = [args.table, *(recording.path for recording in args.listed)]
        args.output = check_output(args.output, inputs, is_model_file, args.force)
        messages.require(("skops",), "saving a diagnoser", "io")
