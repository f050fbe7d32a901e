"""Print what a saved model is, what it was calibrated on, and what it cannot do.

Of a recording, print its channels with their sampling rates, units and shaft speeds.
"""

import argparse
from pathlib import Path

from ..arguments import flag
from ..files import check_input


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "model", type=Path, metavar="FILE", help="a saved model, or a recording"
    )
    flag(parser, "--json", "print JSON, for programs")


def check(args: argparse.Namespace) -> None:
    """Check that the file exists."""
    check_input(args.model)
