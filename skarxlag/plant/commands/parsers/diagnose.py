"""Diagnose recordings with a model that `fit` or `save_diagnoser` saved.

Each recording gets one verdict from the evidence of all its windows. With --bearing and
without a model, the orders of the bearing (BPFO, BPFI, BSF, FTF) name the location of a
fault. A model that was fitted with another bearing takes these orders instead of its
own, and raises no alarm. A .csv among RECORDING holds samples; a table of recordings,
with the columns that `fit` takes, is given with --table. With -o, results are written
as .csv or .parquet (rows of windows in a second file, FILE_windows), .json, or .html, a
report to read and print. An interrupted run goes on where it stopped if it is started
again with the same file. Exit status: 0 if all recordings were diagnosed, 1 if some
could not be, 2 if an argument is wrong, 3 with --fail-on alarm if a verdict is not the
healthy condition.
"""

import argparse
from pathlib import Path

from ...readers.listing import list_recordings
from .. import arguments
from ..arguments import flag, option, refuse
from ..files import (
    SUFFIXES,
    check_input,
    check_output,
    is_model_file,
    is_report,
    is_result_file,
    result_paths,
)
from ..messages import UsageError, as_command_error, require


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "model", nargs="?", type=Path, metavar="MODEL.skops", help="or --bearing"
    )
    text = "a file, a folder, or a glob such as 'runs/*/acc_*.tdms'"
    parser.add_argument("recordings", nargs="*", metavar="RECORDING", help=text)
    option(parser, "--table", "csv table of further recordings", Path, "FILE.csv")
    option(parser, "-o --output", "write .csv, .parquet, .json or .html", Path, "FILE")
    parser.add_argument(
        "--fail-on", choices=["alarm"], help="exit status 3 if one is not healthy"
    )
    flag(parser, "--resample", "bring recordings to the model's sampling rate")
    option(parser, "--bearing", arguments.BEARING, arguments.bearing, "BEARING")
    text = "of signals whose files state none: m/s2, g, mm/s"
    option(parser, "--unit", text, str, "UNIT")
    flag(parser, "-q --quiet", "print no progress")
    arguments.add_source_arguments(
        parser, "each RECORDING, or of lines of the table without them"
    )
    group = parser.add_argument_group("workers")
    option(
        group, "--n-jobs", "number of workers; default: all cores", arguments.job_count
    )
    where = group.add_mutually_exclusive_group()
    flag(where, "--processes", "not threads; for text files, which take long to read")
    text = "workers of a dask.distributed scheduler, such as tcp://host:8786"
    option(where, "--dask", text, metavar="ADDRESS")
    parser.set_defaults(n_jobs=-1)
    flag(parser, "--force", "let -o replace a file that is no result of diagnose")


def check(args: argparse.Namespace) -> None:
    """List the recordings, and check what needs no model."""
    path = args.model
    is_recording = (
        path is not None and path.suffix != ".skops" and not is_model_file(path)
    )
    if args.bearing is not None and is_recording:
        args.recordings.insert(0, str(path))
        args.model = None
    if args.model is None and args.bearing is None:
        raise UsageError(
            "argument MODEL.skops: none given, expected a model or --bearing"
        )
    if not args.recordings and args.table is None:
        raise UsageError("argument RECORDING: none given, expected files or --table")
    if args.model is None:
        refuse(args, ["resample"], "belongs to a model")
    else:
        check_input(args.model)
    args.listed = _listed(args)


def _listed(args):
    outputs = [] if args.output is None else result_paths(args.output)
    with as_command_error():
        # Results of an earlier run may lie in the folder of the recordings.
        results = {path.absolute() for path in outputs}
        results -= {Path(path).absolute() for path in args.recordings}
        recordings = [
            recording
            for recording in arguments.named_recordings(args, args.recordings)
            if recording.path.absolute() not in results
        ]
        if args.table is not None and args.recordings:
            # The facts in the arguments are those of the recordings.
            recordings += list_recordings(args.table)
        elif args.table is not None:
            recordings += arguments.table_recordings(args)
    inputs = [args.model, args.table, *(recording.path for recording in recordings)]
    if args.output is not None:
        kind = is_result_file, args.force, SUFFIXES
        args.output = check_output(args.output, inputs, *kind)
        for path in result_paths(args.output)[1:]:
            check_output(path, inputs, *kind)
    if is_report(args.output):
        require(("jinja2", "matplotlib"), "a report", "io")
    return recordings
