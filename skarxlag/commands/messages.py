"""Messages of the commands: errors in one line, names and numbers, and progress."""

import argparse
import re
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from itertools import takewhile
from time import perf_counter
from typing import Any, Self


class UsageError(Exception):
    """An argument that does not fit; the message names it and what was expected. Exit code 2."""


class CommandError(Exception):
    """Data that cannot be read, used or written; the message names the file. Exit code 1."""


@contextmanager
def as_command_error(*kinds: Any) -> Iterator[Any]:
    """Turn what readers, writers and estimators raise on bad input into a `CommandError`.

    Parameters
    ----------
    *kinds : exception classes
        What to turn; none stands for OSError, ValueError and ImportError.
    """
    kinds = kinds or (OSError, ValueError, ImportError)
    try:
        yield
    except BrokenPipeError:
        # Nobody reads the output any more, which is no mistake.
        raise
    except kinds as error:
        raise CommandError(" ".join(str(error).split())) from error


def printable(text: Any) -> str:
    r"""A text as it can be written to any file, in one line.

    Bytes that are no UTF-8, and control characters, become escapes.

    Examples
    --------
    >>> printable("caf\udce9\n.wav")
    'caf\\udce9\\n.wav'
    """
    text = str(text).encode("utf-8", "backslashreplace").decode()
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def below_common_folder(names: Iterable[str]) -> tuple[str, list[str]]:
    """Leave out the longest folder that all names begin with.

    Parameters
    ----------
    names : iterable of str
        Paths, or what else recordings are called.

    Returns
    -------
    str, list of str
        The folder with the separator at its end, and the names below it. The folder is empty, and
        the names are as they were, where there is only one name or no common folder with a name.

    Examples
    --------
    >>> below_common_folder(["/data/rig/day 1/a.npy", "/data/rig/day 2/b.npy"])
    ('/data/rig/', ['day 1/a.npy', 'day 2/b.npy'])
    >>> below_common_folder(["/a.npy", "/b.npy"])
    ('', ['/a.npy', '/b.npy'])
    """
    names = list(names)
    if len(names) < 2:
        return "", names
    # Names that come from a table have slashes on every system.
    folders = [re.split(r"(?<=[/\\])", name)[:-1] for name in names]
    common = takewhile(lambda level: len(set(level)) == 1, zip(*folders, strict=False))
    folder = "".join(level[0] for level in common)
    if not folder.strip("./\\"):
        return "", names
    return folder, [name.removeprefix(folder) for name in names]


def counted(number: int, things: str) -> str:
    """A number and what is counted.

    Parameters
    ----------
    number : int
        How many.
    things : str
        What, in the plural.

    Returns
    -------
    str
        In the singular for one.

    Examples
    --------
    >>> counted(1, "recordings"), counted(1, "stretches"), counted(2, "windows")
    ('1 recording', '1 stretch', '2 windows')
    """
    if number == 1:
        things = things.removesuffix("es") if things.endswith("ches") else things.removesuffix("s")
    return f"{number} {things}"


def add_progress_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare how much is said meanwhile."""
    how_much = parser.add_mutually_exclusive_group()
    how_much.add_argument("-q", "--quiet", action="store_true", help="tell no progress")
    how_much.add_argument(
        "-v",
        "--verbose",
        action="store_true",
        help="tell more of each step, on a terminal too, and how long all took",
    )


class Progress:
    """Tells on stderr how much of the work is done.

    Parameters
    ----------
    total : int
        Number of steps.
    unit : str
        What a step is.
    args : argparse.Namespace
        With the arguments of `add_progress_arguments`.
    """

    def __init__(self, total: int, unit: str, args: Any) -> None:
        self._total, self._unit, self._done, self._bar = total, unit, 0, None
        self._quiet, self._verbose, self._started = args.quiet, args.verbose, perf_counter()
        if sys.stderr.isatty() and not self._quiet:
            try:
                from tqdm import tqdm
            except ImportError:
                return
            self._bar = tqdm(total=total, unit=f" {unit}", file=sys.stderr, dynamic_ncols=True)

    def step(self, line: str, more: str = "") -> None:
        """One step is done.

        Parameters
        ----------
        line : str
            Which, and what came of it.
        more : str, default=""
            What those want to know who ask for more.
        """
        self._done += 1
        if self._quiet:
            return
        text = f"[{self._done}/{self._total}] {line}"
        if self._verbose and more:
            text += f" ({more})"
        if self._bar is None:
            print(text, file=sys.stderr, flush=True)
            return
        if self._verbose:
            self._bar.write(text, file=sys.stderr)
        self._bar.update()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, *exception: Any) -> None:
        if self._bar is not None:
            self._bar.close()
        if self._verbose and kind is None:
            seconds = perf_counter() - self._started
            print(
                f"{counted(self._done, self._unit)} in {seconds:.1f} s", file=sys.stderr, flush=True
            )
