"""The command line: ``skarxlag evaluate | fit | diagnose | watch | info``."""

import argparse
import os
import sys
import warnings
from contextlib import suppress
from importlib import import_module
from io import TextIOWrapper, UnsupportedOperation

from .._version import __version__
from .messages import CommandError, UsageError

#: What each command does, in the order in which they are listed. The command NAME is the module
#: ``skarxlag.commands.NAME``. Its ``add_arguments(parser)`` declares the arguments, and two
#: defaults: ``run``, which takes the parsed arguments and returns the exit status, and
#: ``fail=parser.error``.
_COMMANDS = {
    "evaluate": "compare the diagnosers across speeds",
    "fit": "calibrate a diagnoser on your recordings",
    "diagnose": "diagnose recordings with a saved diagnoser",
    "watch": "diagnose a running sensor with a saved diagnoser",
    "info": "say what a saved diagnoser is and where its limits are",
}


def main(argv: list[str] | None = None) -> int:
    """Run a command.

    Parameters
    ----------
    argv : list of str or None, default=None
        Arguments. None: those of the process.

    Returns
    -------
    int
        Exit status: 0, or 1 if data cannot be read, used or written, with one line on stderr.
        130 after Ctrl-C and 141 if nobody reads the output any more, as shells have it.

    Raises
    ------
    SystemExit
        With status 2 if an argument is wrong, with 0 after ``--help`` and ``--version``.
    """
    argv = sys.argv[1:] if argv is None else argv
    for stream in (sys.stdout, sys.stderr):
        # The name of a file may hold bytes, and that of a condition letters, that a terminal lacks.
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    args = _parser(argv).parse_args(argv)
    try:
        with warnings.catch_warnings():
            # A person at a shell reads messages of the command, not warnings of Python.
            warnings.simplefilter("ignore")
            status = args.run(args)
        sys.stdout.flush()
        return status
    except UsageError as error:
        args.fail(str(error))
    except CommandError as error:
        return _stop(args, f"error: {error}", 1)
    except KeyboardInterrupt:
        return _stop(args, "interrupted", 130)
    except BrokenPipeError:
        _drop_output()
        return 141
    except OSError as error:
        _drop_output()
        return _stop(args, f"error: {error}", 1)


def _stop(args, message, status):
    print(f"\nskarxlag {args.command}: {message}", file=sys.stderr)
    return status


def _drop_output():
    """Keep the interpreter from writing what is left in the buffer once more when it ends."""
    with suppress(UnsupportedOperation), open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), sys.stdout.fileno())


def _parser(argv):
    parser = argparse.ArgumentParser(
        prog="skarxlag",
        description="Model-based fault diagnosis of bearings across shaft speeds.",
    )
    parser.add_argument("--version", action="version", version=f"skarxlag {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, summary in _COMMANDS.items():
        command = commands.add_parser(name, help=summary)
        # Importing a command imports all that it computes with, which takes seconds.
        if name in argv:
            import_module(f".{name}", __name__).add_arguments(command)
    return parser
