"""Compare diagnosers: train at some speeds, with some bearings, and test at others.

The printed table summarizes the tests: another speed of the same bearings; another
bearing, if the recordings show several bearings with a fault at the same location (column
specimen); another load, if the column load states several. For each it gives the share
of right locations (healthy, or the part with the fault), and how many of the locations stated
with a probability of 0.9 are right. A report with all tables is written to the output
folder.

On a rig, the diagnosers are ALPIO, the baseline of Piltan and Kim (2019); the
extended-state observer, their proposal as repaired; and the recommended one. Each is
calibrated on the first half of every recording of one speed and tested on the second
half of every recording of every speed. The paper's own protocol is python -m
benchmarks.paper. On a csv table of your own recordings with the columns path, condition
and rpm, or a folder or glob, make_diagnoser and two other methods are compared with one
speed in training and with one left out. Across speeds, recordings of one value of the
column campaign are not split between training and test. Without that column, if the
test was measured without remounting after the training, the accuracy may be too high.
"""

import argparse
from pathlib import Path

from ....datasets import FETCHERS
from .. import arguments, messages
from ..arguments import option, positive_int, refuse
from ..messages import UsageError, as_command_error

TITLES = {"simulated": "Simulated rig"} | {
    name: f"{name.upper()} rig" for name in FETCHERS
}
#: Samples of a recording of the simulated rig.
N_SAMPLES = 120_000


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "table", nargs="?", type=Path, help="your own recordings; default: a rig"
    )
    parser.add_argument(
        "--rig", choices=TITLES, default="simulated", help="default: simulated"
    )
    option(
        parser,
        "--data-home",
        "of a real rig's files; default: scikit-learn's",
        Path,
        "FOLDER",
    )
    text = "speed of the calibration on a rig, or all; default: all, on the simulated rig 500"
    option(parser, "--train-rpm", text, arguments.speed_or_all, "RPM")
    text = "default: 1200; of a table 4800, if the recordings are long enough"
    option(parser, "--window-length", text, arguments.window_length)
    option(
        parser,
        "--n-samples",
        f"of simulated recordings; default: {N_SAMPLES}",
        positive_int,
    )
    option(
        parser,
        "--outputs",
        "channels of a table that are sensors, see fit",
        positive_int,
    )
    option(parser, "--n-jobs", "threads; default: all cores", arguments.job_count)
    option(parser, "-o --output", "default: skarxlag-results", Path, "FOLDER")
    messages.add_progress_arguments(parser)
    arguments.add_source_arguments(
        parser, "recordings whose line in the table lacks them"
    )
    parser.set_defaults(n_jobs=-1, output=Path("skarxlag-results"))


def check(args: argparse.Namespace) -> None:
    """List the recordings of a table, and check what needs no computation."""
    if args.table is None:
        unfit = "n_samples" if args.rig in FETCHERS else "data_home"
        refuse(
            args,
            [*arguments.FACTS, "outputs", unfit],
            f"not allowed with --rig {args.rig}",
        )
    else:
        refuse(
            args, ["data_home", "n_samples", "train_rpm"], "not allowed with a table"
        )
    if args.output.exists() and not args.output.is_dir():
        raise UsageError(
            f"argument --output: {args.output} is a file, expected a folder"
        )
    if args.table is not None:
        with as_command_error():
            args.listed = arguments.table_recordings(args)
