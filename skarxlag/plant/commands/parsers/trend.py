"""Draw alarms, verdicts and levels over weeks, from results of diagnose or logs of watch.

FILE is a .csv, .json or .parquet of diagnose, or the lines of JSON that watch writes.
Several files are joined. The page is one file of HTML that needs no network. Results
have the time in a column of the table of recordings (time, date or start), or else the
time at which the file of a recording was changed.
"""

import argparse
from pathlib import Path

from ..arguments import flag, option
from ..files import check_input, check_output, is_result_file
from ..messages import require


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    text = "results of diagnose, or a log of watch"
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help=text)
    option(parser, "-o --output", "default: trend.html", Path, "FILE.html")
    text = "column of results with dates such as 2026-11-26T14:00"
    option(parser, "--time", text, metavar="COLUMN")
    text = (
        "column of results by whose values rows are separated; default: stated_sensor"
    )
    option(parser, "--sensor", text, metavar="COLUMN")
    flag(parser, "--force", "let -o replace a file that was not written by skarxlag")
    parser.set_defaults(output=Path("trend.html"))


def check(args: argparse.Namespace) -> None:
    """Check the files."""
    require("jinja2", "a page", "io")
    for path in args.files:
        check_input(path)
    check_output(args.output, args.files, is_result_file, args.force, (".html",))
