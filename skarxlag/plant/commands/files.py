"""Files that the commands read and write, by their kind."""

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipFile

from .messages import CommandError, UsageError

SUFFIXES = (".csv", ".json", ".parquet", ".html")


def check_input(path: Path) -> None:
    """Refuse a file that does not exist before anything is computed."""
    if not path.is_file():
        raise CommandError(f"{path}: no such file")


def result_paths(output: Path) -> list[Path]:
    """Return the files that are written for an output.

    >>> [path.name for path in result_paths(Path("july.csv"))]
    ['july.csv', 'july_windows.csv']
    >>> [path.name for path in result_paths(Path("july.html"))]
    ['july.html']
    """
    if output.suffix.lower() in (".json", ".html"):
        return [output]
    return [output, output.with_name(f"{output.stem}_windows{output.suffix}")]


def is_report(output: Path | None) -> bool:
    """Return whether an output is a report to read."""
    return output is not None and output.suffix.lower() == ".html"


def check_output(
    output: Path,
    inputs: Iterable[Any],
    force: bool,
    suffixes: tuple[str, ...] = ("",),
) -> Path:
    """Resolve the links of an output and check it before anything is computed.

    The output is refused if it has another suffix, its folder does not exist, it is an
    input, or it exists and `force` is not given. What is returned is written without
    following links, so that a link that is made meanwhile leads nowhere.
    """
    where = f"argument -o/--output: {output}"
    is_named = output.suffix.lower().endswith(suffixes)
    if not is_named or not output.parent.is_dir() or output.is_dir():
        raise UsageError(
            f"{where}, expected a file in a folder that exists, named "
            f"*{', *'.join(suffixes)}"
        )
    output = Path(os.path.realpath(output)) if output.is_symlink() else output
    is_device = output.exists() and not output.is_file()
    if not (is_device or os.access(output.parent, os.W_OK)):
        raise CommandError(f"{output}: no permission to write into its folder")
    if not output.exists():
        return output
    files = (path for path in inputs if path and os.path.exists(path))
    if any(map(output.samefile, files)):
        raise UsageError(f"{where} is an input, which is not replaced")
    if not (force or is_device):
        raise UsageError(f"{where} exists; --force replaces it")
    return output


def is_model_file(path: Path) -> bool:
    """Return whether a file is a saved model, damaged or not."""
    try:
        with ZipFile(path) as file:
            return "schema.json" in file.namelist()
    except (BadZipFile, OSError):
        return False
