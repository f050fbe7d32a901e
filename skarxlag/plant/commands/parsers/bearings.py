"""List the bearings of the catalogue with their orders, or those that fit a recording.

With RECORDING and its speed, the envelope spectrum is searched for the lines of every
bearing in the catalogue, and the best are printed first. Bearings of nearly equal
orders cannot be told apart. A bearing that is not listed is given by dimensions or by
orders wherever a command takes --bearing.
"""

import argparse

from .. import arguments
from ..messages import UsageError, as_command_error


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    text = "a file of which the bearings that fit are printed"
    parser.add_argument("recording", nargs="?", metavar="RECORDING", help=text)
    arguments.add_source_arguments(parser, "RECORDING")


def check(args: argparse.Namespace) -> None:
    """List the recording."""
    args.listed = []
    if args.recording is not None:
        with as_command_error():
            args.listed = arguments.named_recordings(args, [args.recording])
    if len(args.listed) > 1:
        raise UsageError(
            f"argument RECORDING: {len(args.listed)} recordings, expected one"
        )
