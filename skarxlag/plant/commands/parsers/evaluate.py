"""Compare diagnosers: train at some speeds, and test at others.

Without a table, the diagnosers are those of the paper and the recommended one, on the
simulated rig or on a public one: ALPIO, the baseline of Piltan and Kim (2019); their
proposal, as repaired; and make_diagnoser. Each is trained on the first half of every
recording of a speed, and tested on the second halves at other speeds. With a table of
your own recordings (columns path, condition and rpm), a folder or a glob, make_diagnoser is
trained as skarxlag fit would train it, next to a plain classifier of spectra. If the
table states specimens or loads, another bearing and another load are tested, too. The
recordings of one value of the column campaign are not split between training and test
across speeds. All verdicts are written to the output folder.
"""

import argparse
from pathlib import Path

from .. import arguments
from ..arguments import BEARING, bearing, flag, option, positive_int, refuse
from ..messages import UsageError, as_command_error


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    text = "your own recordings; default: the simulated rig"
    parser.add_argument("table", nargs="?", type=Path, help=text)
    rig = parser.add_argument_group("public rig")
    text = "a data set that bearing-datasets has built, such as paderborn"
    option(rig, "--dataset", text, str, "NAME")
    text = "of the built data sets; default: as bearing-datasets is set"
    option(rig, "--data-home", text, Path, "FOLDER")
    text = "metadata that the recordings must have, such as 'fs == 12000'"
    option(rig, "--where", text, str, "CONDITION")
    text = "training speed on a rig, or all; default: all, on the simulated rig 500"
    option(parser, "--train-rpm", text, arguments.speed_or_all, "RPM")
    text = "default: 1200 on a rig, and as skarxlag fit has it on a table"
    option(parser, "--window-length", text, arguments.window_length)
    text = "of simulated recordings; default: 120000"
    option(parser, "--n-samples", text, positive_int)
    text = f"of the machine in the table: {BEARING}"
    option(parser, "--bearing", text, bearing, "BEARING")
    text = "channels of a table that are sensors, see fit"
    option(parser, "--outputs", text, positive_int)
    option(parser, "--n-jobs", "threads; default: all cores", arguments.job_count)
    option(parser, "-o --output", "default: skarxlag-results", Path, "FOLDER")
    flag(parser, "-q --quiet", "print no progress")
    text = "recordings whose line in the table lacks them"
    arguments.add_source_arguments(parser, text)
    parser.set_defaults(n_jobs=-1, output=Path("skarxlag-results"))


def check(args: argparse.Namespace) -> None:
    """List the recordings of a table, and check what needs no computation."""
    if args.table is not None:
        unfit = ["dataset", "data_home", "where", "n_samples", "train_rpm"]
        refuse(args, unfit, "not allowed with a table")
    else:
        of_tables = [name for name in arguments.FACTS if name != "channel"]
        refuse(args, [*of_tables, "outputs", "bearing"], "needs a table")
        if args.dataset is None:
            refuse(args, ["data_home", "where", "channel"], "needs --dataset")
        else:
            refuse(args, ["n_samples"], "belongs to the simulated rig")
    if args.output.exists() and not args.output.is_dir():
        raise UsageError(
            f"argument --output: {args.output} is a file, expected a folder"
        )
    if args.table is not None:
        with as_command_error():
            args.listed = arguments.table_recordings(args)
