"""``skarxlag watch``: verdicts on a running sensor."""

import argparse
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ..recordings.speeds import TACHO, read_texts
from .arguments import channel_names, flag, option, positive_int, positive_number, refuse
from .messages import CommandError, as_command_error, say
from .models import SavedModel, is_model_file
from .watch_stream import SensorStream

_NEEDED, _FURTHER = ["name", "source", "model"], ["channel", "rpm"]


def _speed_or_tacho(text):
    """Parse a shaft speed, or the channel of a tachometer."""
    return text if text.startswith(TACHO) else positive_number(text)


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
    text = "file that fit has saved, or a csv table"
    parser.add_argument("model", type=Path, metavar="MODEL.skops", help=text)
    text = "file or folder; default: standard input"
    parser.add_argument("source", nargs="?", metavar="SOURCE", help=text)

    def seconds(name, text):
        option(parser, name, text, positive_number, "SECONDS")

    text = "of raw samples: <i2, or '(4,)<f4' for four interleaved channels"
    option(parser, "--dtype", text, metavar="TYPE")
    text = "name, position or pattern such as *DE_time of the column or channel; several are "
    text += "separated by ; with the output first; default: all but a column of times"
    option(parser, "--channel", text, channel_names, "NAME")
    option(parser, "--sampling-rate", "default: the model's", positive_number, "HZ")
    speed = parser.add_mutually_exclusive_group()
    text = "shaft speed, if the model uses it, or a channel of pulses as tacho:CHANNEL"
    option(speed, "--rpm", text, _speed_or_tacho, "RPM")
    option(speed, "--rpm-column", "csv column of shaft speeds", metavar="NAME")
    option(parser, "--pulses-per-turn", "of the tachometer; default: 1", positive_int)
    option(parser, "--time-column", "csv column of times; none: ignore times", metavar="NAME")
    option(parser, "--hop", "between windows; default: their length", int, "SAMPLES")
    seconds("--half-life", "of evidence; default: 10")
    text = "mean signal between false alarms; default: 1000"
    option(parser, "--false-alarm-interval", text, positive_number, "HOURS")
    text = "there may be gaps between the files of a folder: a file begins at the date that it "
    text += "states, or else its time of modification is that of its last sample"
    flag(parser, "--timed-files", text)
    seconds("--gap-tolerance", "lateness that is no gap; default: half a window")
    text = "continue from here, and save every minute; with a table, a folder"
    option(parser, "--state", text, Path, "FILE.json")
    seconds("--idle", "end after so long without anything new; default: never")
    seconds("--poll", "pause between looks; default: 0.2")
    seconds("--settle", "pause after which a file in a folder is finished; default: 2")
    seconds("--every", "between lines of JSON, unless the verdict changes; default: every window")
    seconds("--heartbeat", "without a line, then write a heartbeat; default: never")
    option(parser, "--sensor", "stated in each line; default: name of SOURCE", metavar="NAME")
    flag(parser, "-v --verbose", "print one status line a second")
    parser.set_defaults(half_life=10.0, false_alarm_interval=1000.0, poll=0.2, settle=2.0)
    parser.set_defaults(run=run, fail=parser.error)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    if args.source is None and is_model_file(args.model):
        args.source = "-"
    sensors = [args] if args.source is not None else _listed_sensors(args)
    if not any(isinstance(each.rpm, str) for each in sensors):
        refuse(args, ["pulses_per_turn"], f"belongs to --rpm {TACHO}CHANNEL")
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
        table = read_texts(path)
        if args.state is not None:
            args.state.mkdir(parents=True, exist_ok=True)
    columns = list(table)
    if not set(_NEEDED) <= set(columns) <= {*_NEEDED, *_FURTHER} or table.empty:
        raise CommandError(
            f"{path}: {len(table)} sensors with the columns {', '.join(columns)}; expected "
            f"{', '.join(_NEEDED)}, and if needed {', '.join(_FURTHER)}"
        )
    for name, column in (("sensor", "name"), ("rpm_column", "rpm")):
        if column in columns:
            refuse(args, [name], f"{path} has a column {column}")
    is_repeated, sensors = table["name"].duplicated(keep=False), []
    for line, row in enumerate(table.to_dict("records")):
        name, where = row["name"], f"{path}, line {line + 2}"
        if not name or Path(name).name != name or is_repeated[line]:
            raise CommandError(f"{where}: name {name!r}, expected a unique name without slashes")
        if row["source"] in ("", "-"):
            raise CommandError(f"{where}: source {row['source']!r}, expected a file or a folder")
        own = {"sensor": name, "model": path.parent / row["model"]}
        own["source"] = str(path.parent / row["source"])
        if row.get("channel"):
            own["channel"] = channel_names(row["channel"])
        if row.get("rpm"):
            try:
                own["rpm"] = _speed_or_tacho(row["rpm"])
            except argparse.ArgumentTypeError as error:
                raise CommandError(f"{where}: rpm is {error}") from error
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
