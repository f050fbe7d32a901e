"""Arguments that commands share: their types, and facts of recordings without a table."""

import math
import os
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..bearings import bearing_orders
from ..recordings import speeds
from ..recordings.listing import ListedRecording, is_file_source, list_files, list_recordings
from ..recordings.speeds import TACHO, is_speed_source
from .messages import UsageError

#: Ways to state a bearing.
BEARING = "a name such as 6205, dimensions 9,7.94,39.04, or orders outer=3.585,inner=5.415"
#: Facts of recordings that no table lists.
FACTS = ("pattern", "channel", "sampling_rate", "rpm", "pulses_per_turn", "dtype")


def option(group: Any, names: str, text: str, kind: Any = None, metavar: str = "N") -> None:
    """Add an option with a value of some kind; names are separated by a blank."""
    group.add_argument(*names.split(), help=text, type=kind, metavar=metavar)


def flag(group: Any, names: str, text: str) -> None:
    """Add an option without a value; names are separated by a blank."""
    group.add_argument(*names.split(), help=text, action="store_true")


def number(kind: Any, expected: str, is_valid: Callable[[Any], bool]) -> Callable[[str], Any]:
    """Return a type for argparse that parses a finite number and checks it."""

    def parse(text: str) -> Any:
        with suppress(ValueError, OverflowError):
            if math.isfinite(value := kind(text)) and is_valid(value):
                return value
        raise ArgumentTypeError(f"{text!r}, expected {expected}")

    return parse


positive_int = number(int, "an integer of at least 1", lambda value: value >= 1)
window_length = number(int, "an integer of at least 100", lambda value: value >= 100)
job_count = number(int, "a number of threads, or -1 for all cores", lambda value: value != 0)
positive_number = number(float, "a number above 0", lambda value: value > 0)
rate = number(float, "a number between 0 and 1", lambda value: 0 < value < 1)
speed = number(float, "a speed in rpm, or all", lambda value: value > 0)


def channel_names(text: str) -> str | list[str]:
    """Parse the name of a channel, or several, separated by semicolons."""
    return [name.strip() for name in text.split(";")] if ";" in text else text


def speed_or_all(text: str) -> float | str:
    """Parse a shaft speed, or the word all."""
    return text if text == "all" else speed(text)


def speed_or_source(text: str) -> dict[str, Any]:
    """Parse a shaft speed, or a source of speeds, to facts of recordings."""
    return {"speed_source": text} if is_speed_source(text) else {"rpm": positive_number(text)}


def speed_range(text: str) -> tuple[float, float]:
    """Parse a range of shaft speeds."""
    try:
        return speeds.speed_range(text)
    except ValueError as error:
        raise ArgumentTypeError(str(error)) from error


def bearing(text: str) -> str:
    """Check a name, dimensions or orders of a bearing, as `bearing_orders` takes them."""
    try:
        bearing_orders(text)
    except ValueError as error:
        raise ArgumentTypeError(f"{text!r}: {error}") from error
    return text


def add_source_arguments(parser: ArgumentParser, of: str) -> None:
    """Declare facts of recordings that no table lists."""
    group = parser.add_argument_group(f"facts of {of}")
    option(group, "--pattern", "with named groups that state facts in a file's name", str, "REGEX")
    text = "name, position, or pattern such as *DE_time; several separated by ;, the output first"
    option(group, "--channel", text, channel_names, "NAME")
    option(group, "--sampling-rate", "if the files do not state it", positive_number, "HZ")
    text = "shaft speed of all, a channel of pulses as tacho:CHANNEL, or a csv log of speeds"
    option(group, "--rpm", text, speed_or_source, "RPM")
    option(group, "--pulses-per-turn", "of the tachometer; default: 1", positive_int)
    option(group, "--dtype", "samples of raw binary files, such as <i2", metavar="TYPE")


def refuse(args: Namespace, names: Iterable[str], why: str) -> None:
    """Raise an error if one of some options is given."""
    for name in names:
        if vars(args)[name] not in (None, False):
            raise UsageError(f"argument --{name.replace('_', '-')}: {why}")


def stated(args: Namespace) -> dict[str, Any]:
    """Return the keyword arguments of `list_files` and `list_recordings`."""
    return {name: vars(args)[name] for name in FACTS if name not in ("rpm", "pulses_per_turn")}


def named_recordings(args: Namespace) -> list[ListedRecording]:
    """List the recordings of RECORDING arguments, also files that do not exist."""
    options, recordings = stated(args), []
    for path in args.recordings:
        if os.path.exists(path) or is_file_source(path):
            # Two folders may hold files of the same name.
            found = list_files(path, **options)
            recordings += [replace(each, name=str(each.path)) for each in found]
        else:
            recordings.append(ListedRecording(None, str(path), Path(path)))
    return with_speed(recordings, args)


def table_recordings(args: Namespace) -> list[ListedRecording]:
    """List the recordings of a table, a folder or a glob."""
    listed = list_recordings(args.table, **stated(args))
    if not is_file_source(args.table):
        refuse(args, ["rpm"], f"for a folder; {args.table} has a column for it")
    return with_speed(listed, args)


def with_speed(recordings: list[ListedRecording], args: Namespace) -> list[ListedRecording]:
    """Return recordings with the speed, or the source of speeds, of the arguments."""
    stated = args.rpm or {}
    if not stated.get("speed_source", "").startswith(TACHO):
        refuse(args, ["pulses_per_turn"], f"belongs to --rpm {TACHO}CHANNEL")
    facts = {"rpm": None, "speed_source": None, "pulses_per_turn": args.pulses_per_turn or 1}
    return [replace(each, **facts | stated) if stated else each for each in recordings]
