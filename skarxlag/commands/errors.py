"""Mistakes of a user, which end a command with one line instead of a traceback."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


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
