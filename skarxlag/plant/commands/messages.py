"""Messages of the commands: errors in one line, names and numbers, and progress."""

import inspect
import sys
from argparse import Namespace
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any


class UsageError(Exception):
    """Wrong argument; the message names it and what was expected. Exit status 2."""


class CommandError(Exception):
    """Data that cannot be read, used or written; the message names the file. Exit status 1."""


@contextmanager
def as_command_error() -> Iterator[None]:
    """Turn errors of readers, writers and estimators on bad input into a `CommandError`."""
    try:
        yield
    except BrokenPipeError:
        # The reader of the output has closed it, which is no mistake.
        raise
    except (OSError, ValueError, ImportError) as error:
        raise CommandError(" ".join(str(error).split())) from error


def refuse(options: Any, names: Iterable[str], why: str) -> None:
    """Raise an error if one of some options is given."""
    for name in names:
        if getattr(options, name):
            raise UsageError(f"argument --{name.replace('_', '-')}: {why}")


def keywords(function: Callable[..., Any], args: Namespace) -> dict[str, Any]:
    """Return the arguments of a command that a function takes by the same names."""
    names = inspect.signature(function).parameters
    return {name: value for name, value in vars(args).items() if name in names}


def require(packages: Iterable[str], purpose: str, extra: str) -> None:
    """Raise an error if a package of an extra is not installed."""
    for package in packages:
        if find_spec(package) is None:
            raise CommandError(
                f"{purpose} needs {package}: pip install 'skarxlag[{extra}]'"
            )


def printable(text: object) -> str:
    r"""Return a text in one line, with escapes for control characters and bytes that are no UTF-8.

    >>> printable("caf\udce9\n.wav")
    'caf\\udce9\\n.wav'
    """
    text = str(text).encode("utf-8", "backslashreplace").decode()
    return "".join(
        c if c.isprintable() else c.encode("unicode_escape").decode() for c in text
    )


def percent(probability: float) -> str:
    """Return the probability of a verdict in percent. No verdict is certain: at most 99.9 %.

    >>> percent(0.5), percent(0.99999)
    ('50.0%', '99.9%')
    """
    return f"{min(probability, 0.999):.1%}"


def sentence(text: str) -> str:
    """Return a text as a sentence.

    >>> sentence("the speed is missing")
    'The speed is missing.'
    """
    return f"{text[:1].upper()}{text[1:]}."


def counted(number: int, noun: str) -> str:
    """Return a number of things as text.

    >>> counted(1, "alarm"), counted(0, "gap")
    ('1 alarm', '0 gaps')
    """
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def speeds_as_text(speeds: Iterable[float]) -> str:
    """Return speeds as text.

    >>> speeds_as_text([300.0, 1797.5])
    '300, 1797.5'
    """
    return ", ".join(f"{speed:g}" for speed in speeds)


def say(text: object) -> None:
    """Print a line to standard error, without the control characters of names."""
    print(printable(text), file=sys.stderr, flush=True)


@dataclass
class Reporter:
    """Lines on standard error about the progress of a command.

    Parameters
    ----------
    quiet : bool, default=True
        Whether to print nothing.
    total : int, default=0
        Number of steps.
    """

    quiet: bool = True
    total: int = 0
    done: int = 0

    def line(self, text: str) -> None:
        """Print a line."""
        if not self.quiet:
            say(text)

    def start(self, total: int) -> None:
        """Begin to count steps."""
        self.total = total
        self.done = 0

    def step(self, text: str) -> None:
        """Count a step, and print its line."""
        self.done += 1
        self.line(f"[{self.done}/{self.total}] {text}")


def show(*lines: object) -> None:
    """Print lines to standard output, without the control characters of names."""
    for line in lines:
        print(*map(printable, str(line).split("\n")), sep="\n")
