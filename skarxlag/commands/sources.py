"""Where recordings come from: arguments that `fit` and `diagnose` share."""

import argparse
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..recordings.listing import ListedRecording, is_file_source, list_files, list_recordings
from .arguments import positive_number
from .errors import UsageError

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
