"""The command line: ``python -m skarxlag evaluate | fit | diagnose``."""

import argparse
import sys

from . import diagnose, evaluate, fit
from .errors import CommandError, UsageError


def main(argv=None):
    """Run a command.

    Parameters
    ----------
    argv : list of str or None, default=None
        Arguments. None: those of the process.

    Returns
    -------
    int
        Exit code: 0, or 1 if data cannot be read, used or written, with one line on stderr.

    Raises
    ------
    SystemExit
        With code 2 if an argument is wrong, with 0 after ``--help`` and ``--version``.
    """
    args = _parser().parse_args(argv)
    try:
        return args.run(args)
    except UsageError as error:
        args.fail(str(error))
    except CommandError as error:
        print(f"\npython -m skarxlag {args.command}: error: {error}", file=sys.stderr)
        return 1


def _parser():
    from .. import __version__

    parser = argparse.ArgumentParser(
        prog="python -m skarxlag",
        description="Model-based fault diagnosis of bearings across shaft speeds.",
    )
    parser.add_argument("--version", action="version", version=f"skarxlag {__version__}")
    subparsers = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for command in (evaluate, fit, diagnose):
        command.add_parser(subparsers)
    return parser
