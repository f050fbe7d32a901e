"""Files that the commands read and write, by their kind."""

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipFile

from .messages import CommandError, UsageError

#: Part of every file of results, so that a later run may replace it.
MARK = "skarxlag results 1"
SUFFIXES = (".csv", ".json", ".parquet", ".html")
WINDOWS_HEAD = b"recording,start,verdict,alarm,"
_HEADS = (b"recording,verdict,probability,alarm,", WINDOWS_HEAD)


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
    output: Path, inputs: Iterable[Any], is_own: Any, force: bool, suffixes=("",)
):
    """Refuse an output before anything is computed.

    The output is refused if it has another suffix, its folder does not exist, it is an
    input, or it exists, is not of the same kind (`is_own`) and `force` is not given.
    """
    where = f"argument -o/--output: {output}"
    is_named = output.suffix.lower().endswith(suffixes)
    if not is_named or not output.parent.is_dir() or output.is_dir():
        expected = (
            f"expected a file in a folder that exists, named *{', *'.join(suffixes)}"
        )
        raise UsageError(f"{where}, {expected}")
    if output.exists():
        if any(
            output.samefile(each) for each in inputs if each and os.path.exists(each)
        ):
            raise UsageError(f"{where} is an input, which is not replaced")
        if (
            output.is_file()
            and output.stat().st_size
            and not force
            and not is_own(output)
        ):
            expected = "--force replaces it"
            raise UsageError(
                f"{where} exists and was not written by this command; {expected}"
            )


def is_result_file(path: Path) -> bool:
    """Return whether a file holds results, in any format."""
    with path.open("rb") as file:
        start = file.read(4096)
        file.seek(max(path.stat().st_size - 65536, 0))
        return start.startswith(_HEADS) or MARK.encode() in start + file.read()


def is_model_file(path: Path) -> bool:
    """Return whether a file is a saved model, damaged or not."""
    try:
        with ZipFile(path) as file:
            return "schema.json" in file.namelist()
    except (BadZipFile, OSError):
        return False
