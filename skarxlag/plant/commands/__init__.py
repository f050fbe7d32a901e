"""The command line: ``skarxlag COMMAND``, with the commands that `_COMMANDS` lists."""

import argparse
import inspect
import os
import re
import sys
import warnings
from contextlib import suppress
from importlib import import_module
from io import TextIOWrapper, UnsupportedOperation

from ..._version import __version__
from .messages import CommandError, Reporter, UsageError, say

#: Summaries of the commands. Functions of these names in `parsers` and `checks` declare
#: and check the arguments. ``run(args)`` of the module ``skarxlag.plant.commands.NAME``
#: returns the exit status.
_COMMANDS = {
    "evaluate": "compare the diagnosers across speeds",
    "fit": "calibrate a diagnoser on your recordings",
    "diagnose": "diagnose recordings with a saved diagnoser",
    "show": "draw recordings without a diagnosis",
    "bearings": "list known bearings, or those that fit a recording",
    "watch": "diagnose a running sensor with a saved diagnoser",
    "acknowledge": "acknowledge a latched alarm of a running sensor",
    "info": "print what a saved diagnoser is, or the channels of a recording",
}


def main(argv: list[str] | None = None) -> int:
    """Run a command and return the exit status.

    The status is 0; 1 if data cannot be read, used or written, with one line on
    standard error; 3 after ``diagnose --fail-on alarm``; 130 after Ctrl-C and 141 if
    the reader of the output has closed it, as shells have it. A wrong argument raises
    SystemExit with status 2, ``--help`` and ``--version`` with 0. `argv` are the
    arguments; None: those of the process.
    """
    argv = sys.argv[1:] if argv is None else argv
    # A stream that the caller has closed is None.
    sys.stdout = sys.stdout or open(os.devnull, "w")  # noqa: SIM115
    sys.stderr = sys.stderr or open(os.devnull, "w")  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        # A terminal may lack characters of the names of files and conditions.
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    args = argparse.Namespace(command="")
    try:
        args = _parser(argv).parse_args(argv)
        with warnings.catch_warnings():
            # Users of a shell read the messages of the command, not warnings of Python.
            warnings.simplefilter("ignore")
            getattr(import_module(".checks", __name__), args.command)(args)
            args.reporter = Reporter(vars(args).get("quiet", True))
            # This import takes most of the time of a short command.
            status = import_module(f".{args.command}", __name__).run(args)
        sys.stdout.flush()
        return status
    except UsageError as error:
        args.fail(str(error))
    except CommandError as error:
        return _stop(args, f"error: {error}", 1)
    except MemoryError as error:
        text = str(error) or "not enough memory"
        return _stop(args, f"error: {text}", 1)
    except KeyboardInterrupt:
        return _stop(args, "interrupted", 130)
    except BrokenPipeError:
        _drop_output()
        return 141
    except OSError as error:
        _drop_output()
        # What fails without a file is the output.
        where = "" if error.filename else "standard output: "
        return _stop(args, f"error: {where}{error}", 1)


def _stop(args, message, status):
    print(file=sys.stderr)
    say(f"{' '.join(['skarxlag', args.command]).rstrip()}: {message}")
    return status


def _drop_output():
    """Keep the interpreter from writing what is left in the buffer once more when it ends."""
    with suppress(UnsupportedOperation), open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), sys.stdout.fileno())


class _Parser(argparse.ArgumentParser):
    """Parser whose errors take one line, with the help of the arguments that they name."""

    def error(self, message):
        about, _, rest = message.partition(": ")
        is_of_one = about.startswith("argument ")
        named = {
            *re.split(r", |/", about.removeprefix("argument ") if is_of_one else rest)
        }
        text = argparse.HelpFormatter(self.prog)
        text.add_arguments(
            action
            for action in self._actions
            if named & {*action.option_strings, action.metavar, action.dest}
        )
        shown = text.format_help() or f"  {self.prog} --help lists all arguments.\n"
        self.exit(2, f"{self.prog}: error: {message}\n{shown}")


class _CommandParser(_Parser):
    """Parser of a command, whose options may stand between its other arguments."""

    def parse_known_args(self, args=None, namespace=None):
        # The method below calls this one again.
        self.parse_known_args = super().parse_known_args
        # Without an error here, the program and not the command would report it.
        return self.parse_intermixed_args(args, namespace), []


def _parser(argv):
    text = "Model-based fault diagnosis of bearings across shaft speeds."
    parser = _Parser("skarxlag", description=text)
    parser.add_argument(
        "--version", action="version", version=f"skarxlag {__version__}"
    )
    options = {"dest": "command", "required": True, "metavar": "COMMAND"}
    commands = parser.add_subparsers(parser_class=_CommandParser, **options)
    for name, summary in _COMMANDS.items():
        command = commands.add_parser(name, help=summary)
        if name in argv:
            declare = getattr(import_module(".parsers", __name__), name)
            command.description = inspect.getdoc(declare)
            command.set_defaults(fail=command.error)
            declare(command)
    return parser
