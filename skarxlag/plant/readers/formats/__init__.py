"""File formats of data acquisition: one module for each, and one list of them.

A format is a module with these names:

- ``FORMAT``: its name, file names and library, see :class:`Format`.
- ``contents(path)``: opens a file, yields its :class:`Contents` once, and closes the
  file. It may raise anything on a damaged file, and raises `ContentError` if an intact
  file does not hold what is asked for.

Another package adds a format by an entry point of the group ``skarxlag.formats`` that
names such a module.

This package imports nothing from the rest of skarxlag, so that the process that reads
isolated formats starts fast.
"""

from collections.abc import Callable, Iterable, Iterator
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path
from types import ModuleType
from typing import Any

from . import arrow, audio, hdf5, matlab, npy, npz, raw, tdms, text, uff, vallen
from .contents import ContentError, DamagedError, printable

#: Formats of this package, in the order in which the documentation lists them.
FORMATS = (matlab, npy, npz, text, audio, arrow, hdf5, tdms, uff, vallen, raw)
#: Group of entry points by which other packages add formats.
_GROUP = "skarxlag.formats"


@cache
def all_formats() -> tuple[ModuleType, ...]:
    """Return the formats of this package, and those that others register."""
    return (*FORMATS, *(point.load() for point in entry_points(group=_GROUP)))


def suffixes() -> tuple[str, ...]:
    """Return the ends of the names of files that can be read, in lower case."""
    return tuple(end for module in all_formats() for end in module.FORMAT.suffixes)


def find_format(path: Path, dtype: str | None = None) -> ModuleType:
    """Return the module of a file's format.

    Parameters
    ----------
    path : Path
        The file. The end of its name, in any case, determines the format.
    dtype : str or None
        Type of raw binary samples. If it is given, the file is raw whatever its name.

    Raises
    ------
    ValueError
        If no format has the ending.
    """
    if dtype is not None:
        return raw
    for module in all_formats():
        if path.name.lower().endswith(module.FORMAT.suffixes):
            return module
    expected = ", ".join(suffixes())
    raise ValueError(
        f"{path}: unknown suffix {path.suffix!r}; expected one of {expected}"
    )


def read_file(
    path: Path,
    dtype: str | None,
    function: Callable[..., Iterable[Any]],
    *arguments: Any,
) -> Iterator[Any]:
    """Yield what ``function(contents, *arguments)`` yields for the contents of a file.

    Parsers raise all kinds of exceptions on damaged input, and few of them name the
    file.

    Raises
    ------
    ValueError, ImportError
        The message begins with the path.
    """
    module = find_format(path, dtype)
    options = [] if dtype is None else [dtype]
    try:
        for contents in module.contents(path, *options):
            yield from function(contents.printable(), *arguments)
    except ImportError as error:
        library = module.FORMAT.library or error.name
        extra = module.FORMAT.extra
        source = f"'skarxlag[{extra}]'" if extra else library
        raise ImportError(
            f"{path}: this format needs {library}: pip install {source}"
        ) from error
    except Exception as error:
        if isinstance(error, OSError) and error.errno is not None:
            raise OSError(error.errno, error.strerror, str(path)) from error
        reason = _reason(error, path.suffix.lower())
        raise ValueError(printable(f"{path}: {reason}")) from error


def _reason(error, suffix):
    """Return why a file cannot be read."""
    if isinstance(error, MemoryError):
        return "needs more memory than a file of its size may, damaged?"
    if isinstance(error, DamagedError):
        return f"cannot be read as {suffix}, damaged? {error}"
    if isinstance(error, ContentError):
        return str(error)
    if "pickle" in str(error) or "Python objects" in str(error):
        return (
            "holds pickled objects, which are refused, or is damaged; expected numbers"
        )
    # What libraries say of a damaged file is meant for their programmers.
    return f"cannot be read as {suffix}, damaged? Or is it of another format?"
