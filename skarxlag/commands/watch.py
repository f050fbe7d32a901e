"""``skarxlag watch``: verdicts on a running sensor."""

import argparse
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pandas as pd

from .arguments import option_of, positive_number
from .messages import CommandError, UsageError, as_command_error
from .models import SavedModel, is_model_file
from .watch_stream import SensorStream, say

_NEEDED, _FURTHER = ["name", "source", "model"], ["channel", "rpm"]

_DESCRIPTION = """\
Diagnose a running sensor with a diagnoser that `fit` saved. SOURCE is - for standard input, a file
that grows, a named pipe or serial device, or a folder into which a logger drops files. Streams and
growing files hold csv lines, or raw samples with --dtype; files in a folder are of any format that
diagnose reads. Writes one line of JSON for each window to standard output, or fewer with --every,
and a summary to standard error. The alarm takes the healthy limits that `fit` saved in the model.
Ends with the input, or on Ctrl-C. Instead of MODEL.skops and SOURCE, a csv table names several
sensors in the columns name, source and model, and optionally channel and rpm.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.description = _DESCRIPTION
    add, seconds = parser.add_argument, {"type": positive_number, "metavar": "SECONDS"}
    add("model", type=Path, metavar="MODEL.skops", help="file that fit has saved, or a csv table")
    add("source", nargs="?", metavar="SOURCE", help="file or folder; default: standard input")
    add("--dtype", help="of raw samples: <i2, or '(4,)<f4' for four interleaved channels")
    add(
        "--channel",
        metavar="NAME",
        help="name, position or pattern such as *DE_time of the column or channel; several are "
        "separated by ; with the output first; default: all but a column of times",
    )
    add("--sampling-rate", type=positive_number, metavar="HZ", help="default: the model's")
    speed = parser.add_mutually_exclusive_group()
    speed.add_argument("--rpm", type=positive_number, help="shaft speed, if the model uses it")
    speed.add_argument("--rpm-column", metavar="NAME", help="csv column of shaft speeds")
    add("--time-column", metavar="NAME", help="csv column of times; none: ignore times")
    add("--hop", type=int, metavar="SAMPLES", help="between windows; default: their length")
    add("--half-life", default=10.0, help="of evidence; default: %(default)g", **seconds)
    add(
        "--false-alarm-interval",
        type=positive_number,
        default=1000.0,
        metavar="HOURS",
        help="mean signal between false alarms; default: %(default)g",
    )
    add(
        "--timed-files",
        action="store_true",
        help="there may be gaps between the files of a folder: a file begins at the date that it "
        "states, or else its time of modification is that of its last sample",
    )
    add("--gap-tolerance", help="lateness that is no gap; default: half a window", **seconds)
    state = "continue from here, and save every minute; with a table, a folder"
    add("--state", type=Path, metavar="FILE.json", help=state)
    add("--idle", help="end after so long without anything new; default: never", **seconds)
    add("--poll", default=0.2, help="pause between looks; default: %(default)g", **seconds)
    finished = "pause after which a file in a folder is finished; default: %(default)g"
    add("--settle", default=2.0, help=finished, **seconds)
    every = "between lines of JSON, unless the verdict changes; default: every window"
    add("--every", help=every, **seconds)
    add("--heartbeat", help="without a line, then write a heartbeat; default: never", **seconds)
    add("--sensor", metavar="NAME", help="stated in each line; default: name of SOURCE")
    add("-v", "--verbose", action="store_true", help="print one status line a second")
    parser.set_defaults(run=run, fail=parser.error)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    if args.source is None and is_model_file(args.model):
        args.source = "-"
    sensors = [args] if args.source is not None else _listed_sensors(args)
    models = {path: SavedModel(path) for path in dict.fromkeys(each.model for each in sensors)}
    streams = [SensorStream(each, models[each.model]) for each in sensors]
    for model in models.values():
        say(model.heading)
    with as_command_error(), _stop_signals() as signals:
        try:
            failed = _follow(streams, args, signals)
        finally:
            for stream in streams:
                stream.save()
    for stream in streams:
        stream.say(stream.summary())
    return int(failed)


def _listed_sensors(args):
    """Arguments of each sensor in a table."""
    path = args.model
    with as_command_error():
        table = pd.read_csv(path, dtype=str, keep_default_na=False)
    columns, sensors = list(table.columns), []
    if not set(_NEEDED) <= set(columns) <= {*_NEEDED, *_FURTHER} or table.empty:
        raise CommandError(
            f"{path}: {len(table)} sensors with the columns {', '.join(columns)}; expected "
            f"{', '.join(_NEEDED)}, and if needed {', '.join(_FURTHER)}"
        )
    for option, column in (("sensor", "name"), ("rpm_column", "rpm")):
        if vars(args)[option] is not None and column in columns:
            raise UsageError(f"argument {option_of(option)}: {path} has a column {column}")
    if args.state is not None:
        with as_command_error():
            args.state.mkdir(parents=True, exist_ok=True)
    for line, row in enumerate(table.to_dict("records"), start=2):
        name, where = row["name"], f"{path}, line {line}"
        if not name or Path(name).name != name or (table["name"] == name).sum() > 1:
            raise CommandError(f"{where}: name {name!r}, expected a unique name without slashes")
        if row["source"] in ("", "-"):
            raise CommandError(f"{where}: source {row['source']!r}, expected a file or a folder")
        own = {"sensor": name, "channel": row.get("channel") or args.channel}
        own |= {"source": str(path.parent / row["source"]), "model": path.parent / row["model"]}
        if row.get("rpm"):
            try:
                own["rpm"] = positive_number(row["rpm"])
            except argparse.ArgumentTypeError as error:
                raise CommandError(f"{where}: rpm {error}") from error
        if args.state is not None:
            own["state"] = args.state / f"{name}.json"
        sensors.append(argparse.Namespace(**vars(args) | own))
    return sensors


@contextmanager
def _stop_signals() -> Iterator[list[Any]]:
    """Collect SIGINT and SIGTERM, so that they end the command where it does no harm."""
    received: list[Any] = []
    handlers = {}
    # Python lets only the main thread handle signals.
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):
            handlers[number] = signal.signal(number, lambda *caught: received.append(caught))
    try:
        yield received
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)


def _follow(streams, args, signals):
    """Process blocks until all sources have ended, or nothing comes, or a signal requests it.

    Return whether one of several sources could not be read to its end.
    """
    since, has_failed, is_alone = time.monotonic(), False, len(streams) == 1
    while streams:
        found = []
        for stream in streams:
            try:
                with as_command_error():
                    found.append(stream.step())
            except CommandError as error:
                if is_alone:
                    raise
                stream.say(f"error: {error}; the other sensors are watched on")
                has_failed = True
                found.append(None)
        if any(found):
            since = time.monotonic()
        elif args.idle is not None and time.monotonic() - since >= args.idle:
            break
        elif None not in found and not signals:
            time.sleep(args.poll)
        streams = [
            stream
            for stream, new in zip(streams, found, strict=True)
            if new is not None and not (signals and stream.is_at_place)
        ]
    return has_failed
