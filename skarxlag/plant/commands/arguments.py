"""Arguments that commands share: their types, and facts of recordings without a table."""

import inspect
import math
import os
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..readers import listing
from ..readers.entries import ListedRecording
from ..readers.formats.facts import check_unambiguous
from ..readers.recording_tables import channel_names
from ..readers.speeds import TACHO, check_stated_speed, is_speed_source
from .messages import UsageError

#: Ways to state a bearing.
BEARING = (
    "a name such as 6205, dimensions 9,7.94,39.04, or orders outer=3.585,inner=5.415 "
    "(BPFO, BPFI)"
)
#: Facts of recordings that no table lists.
FACTS = ("pattern", "channel", "sampling_rate", "rpm", "pulses_per_revolution", "dtype")


def option(
    group: Any, names: str, text: str, kind: Any = None, metavar: str = "N"
) -> None:
    """Add an option with a value of some kind; names are separated by a blank."""
    group.add_argument(*names.split(), help=text, type=kind, metavar=metavar)


def flag(group: Any, names: str, text: str) -> None:
    """Add an option without a value; names are separated by a blank."""
    group.add_argument(*names.split(), help=text, action="store_true")


def number(
    kind: Any, expected: str, is_valid: Callable[[Any], bool]
) -> Callable[[str], Any]:
    """Return a type for argparse that parses a finite number and checks it."""

    def parse(text: str) -> Any:
        with suppress(ValueError, OverflowError):
            if math.isfinite(value := kind(text)) and is_valid(value):
                return value
        raise ArgumentTypeError(f"{text!r}, expected {expected}")

    return parse


positive_int = number(int, "an integer of at least 1", lambda value: value >= 1)
window_length = number(int, "an integer of at least 100", lambda value: value >= 100)
job_count = number(
    int, "a number of threads, or -1 for all cores", lambda value: value != 0
)
positive_number = number(float, "a number above 0", lambda value: value > 0)
rate = number(float, "a number between 0 and 1", lambda value: 0 < value < 1)
speed = number(float, "a speed in rpm, or all", lambda value: value > 0)


def sampling_rate(text: str) -> float:
    """Parse a sampling rate, whose sign must not be one of thousands."""
    try:
        check_unambiguous("sampling_rate", text)
    except ValueError as error:
        raise ArgumentTypeError(str(error)) from error
    return positive_number(text)


def speed_or_all(text: str) -> float | str:
    """Parse a shaft speed, or the word all."""
    return text if text == "all" else speed(text)


def speed_or_source(text: str) -> dict[str, Any]:
    """Parse a shaft speed, or a source of speeds, to facts of recordings."""
    if is_speed_source(text):
        return {"speed_source": text}
    try:
        check_stated_speed(text)
    except ValueError as error:
        raise ArgumentTypeError(str(error)) from error
    return {"rpm": positive_number(text)}


def bearing(text: str) -> str:
    """Check a name, dimensions or orders of a bearing, as `bearing_orders` takes them."""
    from ...bearings import bearing_orders

    try:
        bearing_orders(text)
    except ValueError as error:
        raise ArgumentTypeError(f"{text!r}: {error}") from error
    return text


def add_source_arguments(parser: ArgumentParser, of: str) -> None:
    """Declare facts of recordings that a table, a file or its name does not state."""
    group = parser.add_argument_group(f"facts of {of}")
    text = "for a folder or a glob; its named groups state facts in a file's name"
    option(group, "--pattern", text, str, "REGEX")
    text = "name, position, or pattern such as *DE_time; several separated by ;, the output first"
    option(group, "--channel", text, channel_names, "NAME")
    option(
        group, "--sampling-rate", "if the files do not state it", sampling_rate, "HZ"
    )
    text = "shaft speed of all, a channel of pulses as tacho:CHANNEL, or a csv log of speeds"
    option(group, "--rpm", text, speed_or_source, "RPM")
    option(
        group, "--pulses-per-revolution", "of the tachometer; default: 1", positive_int
    )
    option(group, "--dtype", "samples of raw binary files, such as <i2", metavar="TYPE")
    parser.set_defaults(rpm={})


def keywords(function: Callable[..., Any], args: Namespace) -> dict[str, Any]:
    """Return the arguments of a command that a function takes by the same names."""
    names = inspect.signature(function).parameters
    return {name: value for name, value in vars(args).items() if name in names}


def refuse(args: Any, names: Iterable[str], why: str) -> None:
    """Raise an error if one of some options is given."""
    for name in names:
        if getattr(args, name):
            raise UsageError(f"argument --{name.replace('_', '-')}: {why}")


def stated(args: Namespace) -> dict[str, Any]:
    """Return the facts in the arguments, as `list_files` and `list_recordings` take them."""
    if not args.rpm.get("speed_source", "").startswith(TACHO):
        refuse(args, ["pulses_per_revolution"], f"belongs to --rpm {TACHO}CHANNEL")
    facts = {name: getattr(args, name) for name in FACTS if name != "rpm"} | args.rpm
    return {name: value for name, value in facts.items() if value is not None}


def named_recordings(args: Namespace, paths: Iterable[str]) -> list[ListedRecording]:
    """List the recordings of some arguments, also files that do not exist."""
    facts = stated(args)
    recordings = []
    for path in paths:
        if os.path.exists(path) or listing.is_file_source(path):
            # Two folders may hold files of the same name.
            recordings += [
                replace(recording, name=str(recording.path))
                for recording in listing.list_files(path, **facts)
            ]
        else:
            recordings.append(ListedRecording(None, path, Path(path)))
    return recordings


def table_recordings(args: Namespace) -> list[ListedRecording]:
    """List the recordings of a table, a folder or a glob."""
    if not listing.is_file_source(args.table):
        refuse(args, ["pattern"], f"for a folder or a glob; {args.table} is a table")
    try:
        return listing.list_recordings(args.table, **stated(args))
    except listing.UnusedFactError as error:
        refuse(
            args,
            [error.name],
            f"no effect, because each line of {error.source} states it",
        )
        raise
