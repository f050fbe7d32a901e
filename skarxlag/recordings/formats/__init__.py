"""File formats of data acquisition: one module for each, and one list of them.

A format is a module with these names:

- ``FORMAT``: its name, file names and library, see :class:`Format`.
- ``contents(path)``: opens a file, yields its :class:`Contents` once, and closes the file. It may
  raise anything on a damaged file, and raises `ContentError` if an intact file does not hold what
  is asked for.

This package imports nothing from the rest of skarxlag, so that the process that reads isolated
formats starts fast.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

from . import arrow, audio, hdf5, matlab, npy, npz, raw, tdms, text, uff, vallen, wav
from ._contents import ContentError, Contents
from ._signals import describe_channels, signal_blocks

#: All formats, in the order in which the documentation lists them.
FORMATS = (matlab, npy, npz, text, wav, audio, arrow, hdf5, tdms, uff, vallen, raw)


def find_format(
    path: Path, dtype: str | None = None
) -> tuple[ModuleType, Callable[[Path], Iterator[Contents]]]:
    """Return the module of a file's format, and the function that opens the file.

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
        return raw, partial(raw.contents, dtype=dtype)
    name = path.name.lower()
    for module in FORMATS:
        if name.endswith(module.FORMAT.suffixes):
            return module, module.contents
    known = ", ".join(suffix for module in FORMATS for suffix in module.FORMAT.suffixes)
    raise ValueError(f"{path}: unknown suffix {path.suffix!r}; expected one of {known}")


def read_blocks(
    path: Path, dtype: str | None, channel: Any, n_samples: int | None
) -> Iterator[Any]:
    """Yield blocks of the chosen channels and their sampling rate, see `signal_blocks`.

    Raises
    ------
    FileNotFoundError, ValueError, ImportError
        The message begins with the path.
    """
    with _opened(path, dtype) as contents:
        yield from signal_blocks(contents, channel, n_samples)


def describe(path: Path, dtype: str | None) -> Iterator[list[dict[str, Any]]]:
    """Yield what `describe_channels` returns; errors as in `read_blocks`."""
    with _opened(path, dtype) as contents:
        yield describe_channels(contents)


@contextmanager
def _opened(path, dtype):
    module, contents = find_format(path, dtype)
    try:
        with contextmanager(contents)(path) as opened:
            yield opened
    except Exception as error:
        raise _error_of(path, error, module) from error


def _error_of(path, error, module):
    """Return the exception that reports a failure to read a file.

    Parsers raise all kinds of exceptions on damaged input, and few of them name the file.
    """
    if isinstance(error, ContentError):
        return ValueError(f"{path}: {error}")
    if isinstance(error, FileNotFoundError) and not path.is_file():
        return FileNotFoundError(f"{path}: no such file")
    if isinstance(error, PermissionError | IsADirectoryError):
        return ValueError(f"{path}: cannot be read ({error})")
    if isinstance(error, ImportError):
        return ImportError(
            f"{path}: reading this format needs {module.FORMAT.library or error.name}: "
            f"pip install 'skarxlag[{module.FORMAT.extra}]'"
        )
    if isinstance(error, MemoryError):
        return ValueError(f"{path}: needs more memory than a file of its size may, damaged?")
    if "pickle" in str(error) or "Python objects" in str(error):
        return ValueError(
            f"{path}: holds pickled objects, which are refused because they can run code, or "
            "is damaged; expected plain numeric arrays"
        )
    kind = "".join(path.suffixes[-2:] if path.suffix == ".gz" else path.suffixes[-1:]).lower()
    return ValueError(f"{path}: cannot be read as {kind}, damaged? ({error})")
