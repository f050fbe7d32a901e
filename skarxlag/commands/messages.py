"""Messages of the commands: errors in one line, names and numbers, and progress."""

import argparse
import os
import re
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from time import perf_counter
from typing import Self


class UsageError(Exception):
    """Wrong argument; the message names it and what was expected. Exit status 2."""


class CommandError(Exception):
    """Data that cannot be read, used or written; the message names the file. Exit status 1."""


@contextmanager
def as_command_error(*kinds: type[Exception]) -> Iterator[None]:
    """Turn errors of readers, writers and estimators on bad input into a `CommandError`."""
    kinds = kinds or (OSError, ValueError, ImportError)
    try:
        yield
    except BrokenPipeError:
        # The reader of the output has closed it, which is no mistake.
        raise
    except kinds as error:
        raise CommandError(" ".join(str(error).split())) from error


def require(package: str, purpose: str, extra: str) -> None:
    """Raise an error if a package of an extra is not installed."""
    if find_spec(package) is None:
        raise CommandError(f"{purpose} needs {package}: pip install 'skarxlag[{extra}]'")


def printable(text: object) -> str:
    r"""Return a text in one line, with escapes for control characters and bytes that are no UTF-8.

    >>> printable("caf\udce9\n.wav")
    'caf\\udce9\\n.wav'
    """
    text = str(text).encode("utf-8", "backslashreplace").decode()
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def below_common_folder(names: Iterable[str]) -> tuple[str, list[str]]:
    """Remove the common parent folder from all names; return the folder and the shorter names.

    >>> below_common_folder(["/data/rig/day 1/a.npy", "/data/rig/day 2/b.npy"])
    ('/data/rig/', ['day 1/a.npy', 'day 2/b.npy'])
    >>> below_common_folder(["/a.npy", "/b.npy"])
    ('', ['/a.npy', '/b.npy'])
    """
    names = list(names)
    # Names in a table have slashes on every system, so commonpath does not fit.
    folder = re.sub(r"[^/\\]*\Z", "", os.path.commonprefix(names))  # noqa: RUF071
    if len(names) < 2 or not folder.strip("./\\"):
        return "", names
    return folder, [name.removeprefix(folder) for name in names]


def percent(probability: float) -> str:
    """Return the probability of a verdict in percent. No verdict is certain: at most 99.9 %.

    >>> percent(0.5), percent(0.99999)
    ('50.0%', '99.9%')
    """
    return f"{min(probability, 0.999):.1%}"


def counted(number: int, things: str) -> str:
    """Return a number and the noun that it counts, in the singular for one.

    >>> counted(1, "recordings"), counted(1, "stretches"), counted(2, "windows")
    ('1 recording', '1 stretch', '2 windows')
    """
    if number == 1:
        things = things.removesuffix("es") if things.endswith("ches") else things.removesuffix("s")
    return f"{number} {things}"


def add_progress_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare how much the command prints while it works."""
    how_much = parser.add_mutually_exclusive_group()
    how_much.add_argument("-q", "--quiet", action="store_true", help="print no progress")
    how_much.add_argument(
        "-v", "--verbose", action="store_true", help="print details of each step, and the time"
    )


def say(text: object) -> None:
    """Print a line to standard error, without the control characters of names."""
    print(printable(text), file=sys.stderr, flush=True)


def report_progress(args: argparse.Namespace, line: str) -> None:
    """Print a line to standard error, unless --quiet is given."""
    if not args.quiet:
        say(line)


class Progress:
    """Lines on standard error that count the steps of a command."""

    def __init__(self, total: int, unit: str, args: argparse.Namespace) -> None:
        self._total, self._unit, self._args = total, unit, args
        self._done, self._started = 0, perf_counter()

    def step(self, line: str, details: str = "") -> None:
        """Count a step; show its line, with details if they are asked for."""
        self._done += 1
        shown = f" ({details})" if self._args.verbose and details else ""
        report_progress(self._args, f"[{self._done}/{self._total}] {line}{shown}")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, *exception: object) -> None:
        if self._args.verbose and kind is None:
            seconds = perf_counter() - self._started
            report_progress(self._args, f"{counted(self._done, self._unit)} in {seconds:.1f} s")
