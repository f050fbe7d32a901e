"""Errors of saved files, which name the file."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def errors_named(path: str | os.PathLike[str], expected: str) -> Iterator[None]:
    """Name the file in the errors of those who read it."""
    if not Path(path).is_file():
        raise FileNotFoundError(f"{path}: no such file")
    try:
        yield
    except ImportError:
        raise
    except MemoryError as error:
        raise MemoryError(f"{path}: not enough memory to load it") from error
    # What a parser raises on damaged input is as varied as the damage, such as
    # RecursionError.
    except Exception as error:
        raise ValueError(f"{path}: no {expected} ({error})") from error
