"""Acknowledge a latched alarm of a sensor that ``watch --latch`` follows.

The alarm goes off at once, or as soon as the signal is within the healthy limits again.
If the command watch does not run, the alarm is acknowledged when it starts.
"""

import argparse
from pathlib import Path

from ..files import check_input


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    text = "the file of watch --state; with a table, that of the sensor in the folder"
    parser.add_argument("states", nargs="+", type=Path, metavar="STATE.json", help=text)


def check(args: argparse.Namespace) -> None:
    """Check that the states exist."""
    for path in args.states:
        check_input(path)
