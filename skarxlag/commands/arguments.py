"""Arguments that commands share: their types, and facts of recordings without a table."""

import argparse
import math
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..bearings import bearing_orders
from ..recordings.listing import ListedRecording, is_file_source, list_files, list_recordings
from ..recordings.speeds import SpeedRange
from .messages import UsageError


def add_execution_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what many recordings are worked on with."""
    group = parser.add_argument_group("workers")
    group.add_argument(
        "--n-jobs", type=job_count, default=-1, metavar="N", help="at a time; default: all cores"
    )
    where = group.add_mutually_exclusive_group()
    where.add_argument(
        "--processes",
        action="store_true",
        help="use processes instead of threads: for many small or compressed files, and where a "
        "damaged one could end the process that reads it",
    )
    where.add_argument(
        "--dask",
        metavar="ADDRESS",
        help="use the workers of a dask.distributed scheduler, such as tcp://host:8786; they read "
        "the files and the model themselves, from the same paths",
    )


def positive_int(text: str) -> int:
    """An integer of at least 1."""
    return _integer(text, "an integer of at least 1", lambda value: value >= 1)


def window_length(text: str) -> int:
    """A number of samples; in fewer there is no model to identify."""
    return _integer(text, "an integer of at least 100", lambda value: value >= 100)


def seed(text: str) -> int:
    """An integer that seeds a random number generator."""
    return _integer(text, "an integer from 0 to 4294967295", lambda value: 0 <= value < 2**32)


def job_count(text: str) -> int:
    """A number of threads, or a negative one as in joblib."""
    return _integer(text, "a number of threads, or -1 for all cores", lambda value: value != 0)


def positive_number(text: str) -> float:
    """A finite number above 0."""
    return _number(text, "a number above 0", lambda value: value > 0)


def rate(text: str) -> float:
    """A number strictly between 0 and 1."""
    return _number(text, "a number between 0 and 1", lambda value: 0 < value < 1)


def speed_range(text: str) -> SpeedRange:
    """A shaft speed, alone, with a tolerance, or as a range."""
    try:
        return SpeedRange.parse(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def speed_or_all(text: str) -> float | str:
    """A shaft speed, or the word all."""
    return text if text == "all" else _number(text, "a speed in rpm, or all", lambda v: v > 0)


def bearing(text: str) -> str:
    """Check a name, dimensions or orders of a bearing, as `bearing_orders` takes them."""
    try:
        bearing_orders(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"{text!r}: {error}") from error
    return text


def _integer(text, expected, is_valid):
    try:
        value = int(text)
    except ValueError:
        value = None
    if value is None or not is_valid(value):
        raise argparse.ArgumentTypeError(f"{text!r}, expected {expected}")
    return value


def _number(text, expected, is_valid):
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or not is_valid(value):
        raise argparse.ArgumentTypeError(f"{text!r}, expected {expected}")
    return value


#: Arguments that say what no table says, by the names that the readers give them.
_STATED = ("pattern", "channel", "sampling_rate", "dtype")


def add_source_arguments(parser: argparse.ArgumentParser, of: str) -> None:
    """Declare the arguments that tell about recordings without a table.

    Parameters
    ----------
    parser : argparse.ArgumentParser
        Of the command.
    of : str
        What they belong to.
    """
    group = parser.add_argument_group(f"facts of {of}")
    group.add_argument(
        "--pattern",
        metavar="REGEX",
        help="tells condition, rpm and other facts from the names of files, such as "
        r"'(?P<condition>[A-Z]+)_(?P<rpm>\d+)'",
    )
    group.add_argument(
        "--channel",
        metavar="NAME",
        help="channel, its position, or a pattern such as *DE_time; several are "
        "separated by ; with the output first",
    )
    group.add_argument(
        "--sampling-rate",
        type=positive_number,
        metavar="HZ",
        help="if the files do not state it",
    )
    group.add_argument("--rpm", type=positive_number, help="shaft speed, the same for all")
    group.add_argument("--dtype", metavar="TYPE", help="samples of raw binary files, such as <i2")


def stated(args: argparse.Namespace) -> dict[str, Any]:
    """What the arguments tell about recordings without a table.

    Parameters
    ----------
    args : argparse.Namespace
        With the arguments of `add_source_arguments`.

    Returns
    -------
    dict
        Keyword arguments of `list_files` and `load_recordings`.
    """
    options = {name: getattr(args, name) for name in _STATED}
    if args.channel is not None and ";" in args.channel:
        options["channel"] = [name.strip() for name in args.channel.split(";")]
    return options


def named_recordings(args: argparse.Namespace) -> list[ListedRecording]:
    """The recordings that RECORDING arguments name: files, folders, globs.

    Parameters
    ----------
    args : argparse.Namespace
        With ``recordings`` and the arguments of `add_source_arguments`.

    Returns
    -------
    list of ListedRecording
        A file that does not exist is among them; nothing has been looked at.
    """
    options = stated(args)
    recordings = []
    for path in args.recordings:
        if os.path.exists(path) or is_file_source(path):
            found = list_files(path, **options)
            # Names within a folder may be those of another folder, too.
            recordings += [replace(each, name=str(each.path)) for each in found]
        else:
            recordings.append(ListedRecording(None, str(path), Path(path)))
    return recordings


def table_recordings(args: argparse.Namespace) -> list[ListedRecording]:
    """Recordings of a table, a folder or a glob.

    Parameters
    ----------
    args : argparse.Namespace
        With ``table`` and the arguments of `add_source_arguments`.

    Raises
    ------
    UsageError
        If a speed is stated for all recordings of a table, which has a column for it.
    """
    listed = list_recordings(args.table, **stated(args))
    if args.rpm is None:
        return listed
    if not is_file_source(args.table):
        raise UsageError(f"argument --rpm: for a folder; {args.table} has a column for it")
    return [replace(recording, rpm=args.rpm) for recording in listed]
