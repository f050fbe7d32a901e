"""Draw recordings without a diagnosis: signal, spectrum, envelope spectrum over orders.

The page is one file of HTML that needs no network. With --bearing and a known speed,
the lines of the bearing (BPFO, BPFI, BSF, FTF) are marked. With --healthy, spectra are
drawn next to those of healthy recordings. At most 50 recordings are drawn. Exit status:
0 if all were drawn, 1 if some could not be read, 2 if an argument is wrong.
"""

import argparse
from pathlib import Path

from ...readers.listing import list_recordings
from .. import arguments
from ..arguments import flag, option
from ..files import check_output, is_result_file
from ..messages import UsageError, as_command_error, require

#: Recordings on a page, at most.
MOST_DRAWN = 50


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    text = "a file, a folder, or a glob such as 'runs/*/acc_*.tdms'"
    parser.add_argument("recordings", nargs="*", metavar="RECORDING", help=text)
    option(parser, "--table", "csv table of further recordings", Path, "FILE.csv")
    text = "the page; default: named like the first recording, in this folder"
    option(parser, "-o --output", text, Path, "FILE.html")
    option(parser, "--bearing", arguments.BEARING, arguments.bearing, "BEARING")
    text = "healthy recording of the same machine; may be given several times"
    parser.add_argument(
        "--healthy", action="append", default=[], metavar="RECORDING", help=text
    )
    text = "of signals whose files state none: m/s2, g, mm/s"
    option(parser, "--unit", text, str, "UNIT")
    arguments.add_source_arguments(parser, "each RECORDING")
    flag(parser, "--force", "let -o replace a file that was not written by skarxlag")


def check(args: argparse.Namespace) -> None:
    """List the recordings, and check the output."""
    require(("jinja2", "matplotlib"), "a page", "io")
    with as_command_error():
        args.listed = arguments.named_recordings(args, args.recordings)
        if args.table is not None:
            args.listed += list_recordings(args.table)
        args.listed_healthy = arguments.named_recordings(args, args.healthy)
    if not args.listed:
        raise UsageError("argument RECORDING: none given, expected files or --table")
    if len(args.listed) > MOST_DRAWN:
        raise UsageError(
            f"argument RECORDING: {len(args.listed)} recordings; expected at most "
            f"{MOST_DRAWN}. A report of diagnose lists all and draws the most severe."
        )
    if args.output is None:
        args.output = Path(f"{args.listed[0].path.stem}.html")
    inputs = [recording.path for recording in args.listed + args.listed_healthy]
    args.output = check_output(
        args.output, inputs, is_result_file, args.force, (".html",)
    )
