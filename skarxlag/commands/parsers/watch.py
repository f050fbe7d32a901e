"""Diagnose a running sensor with a diagnoser that `fit` saved.

SOURCE is - for standard input, a file that grows, a named pipe or serial device, or a folder into
which a logger drops files. Streams and growing files hold csv lines, or raw samples with --dtype;
files in a folder are of any format that diagnose reads. Writes one line of JSON for each window to
standard output, or fewer with --every, and a summary to standard error. The alarm takes the healthy
limits that `fit` saved in the model. Ends with the input, or on Ctrl-C. Instead of MODEL.skops and
SOURCE, a csv table names several sensors in the columns name, source and model, and optionally
channel and rpm. Several channels are separated by ; with the output first. With --timed-files, a
file begins at the date that it states, or else its time of modification is that of its last sample.
With --state, a later run continues from there.
"""

import argparse
from pathlib import Path

from ...recordings.listing import channel_names, speed_facts
from ...recordings.speeds import TACHO, read_texts
from ..arguments import flag, option, positive_int, positive_number, refuse, speed_or_source
from ..files import check_input, is_model_file
from ..messages import CommandError, as_command_error

_NEEDED, _FURTHER = ["name", "source", "model"], ["channel", "rpm"]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("model", type=Path, metavar="MODEL.skops", help="or a csv table")
    parser.add_argument("source", nargs="?", metavar="SOURCE", help="default: standard input")
    option(parser, "--dtype", "of raw samples: <i2, or '(4,)<f4' for 4 channels", metavar="TYPE")
    text = "name, position or pattern such as *DE_time; default: all but a column of times"
    option(parser, "--channel", text, channel_names, "NAME")
    option(parser, "--sampling-rate", "default: the model's", positive_number, "HZ")
    speed = parser.add_mutually_exclusive_group()
    option(speed, "--rpm", "or pulses as tacho:CHANNEL, or a csv log", speed_or_source, "RPM")
    option(speed, "--rpm-column", "csv column of shaft speeds", metavar="NAME")
    option(parser, "--pulses-per-turn", "of the tachometer; default: 1", positive_int)
    option(parser, "--time-column", "csv column of times; none: ignore times", metavar="NAME")
    option(parser, "--hop", "between windows; default: their length", int, "SAMPLES")
    option(parser, "--false-alarm-interval", "mean; default: 1000", positive_number, "HOURS")
    flag(parser, "--timed-files", "there may be gaps between the files of a folder")
    option(parser, "--state", "save every minute; with a table, a folder", Path, "FILE.json")
    texts = {
        "--half-life": "of evidence; default: 10",
        "--gap-tolerance": "lateness that is no gap; default: half a window",
        "--idle": "end after so long without anything new; default: never",
        "--poll": "pause between looks; default: 0.2",
        "--settle": "pause after which a file in a folder is finished; default: 2",
        "--every": "between lines of JSON, unless the verdict changes; default: every window",
        "--heartbeat": "without a line, then write a heartbeat; default: never",
    }
    for name, text in texts.items():
        option(parser, name, text, positive_number, "SECONDS")
    option(parser, "--sensor", "stated in each line; default: name of SOURCE", metavar="NAME")
    flag(parser, "-v --verbose", "print one status line a second")
    parser.set_defaults(half_life=10.0, false_alarm_interval=1000.0, poll=0.2, settle=2.0, rpm={})


def check(args: argparse.Namespace) -> None:
    """List the sensors, and check what needs no model."""
    if args.source is None and is_model_file(args.model):
        args.source = "-"
    with as_command_error():
        args.sensors = [args] if args.source is not None else _listed_sensors(args)
    if not any("speed_source" in each.rpm for each in args.sensors):
        refuse(args, ["pulses_per_turn"], f"belongs to --rpm {TACHO}CHANNEL")
    for each in args.sensors:
        check_input(each.model)


def _listed_sensors(args):
    """Return the arguments of each sensor in a table."""
    path, sensors, table = args.model, [], read_texts(args.model)
    if args.state is not None:
        args.state.mkdir(parents=True, exist_ok=True)
    if not {*_NEEDED} <= {*table} <= {*_NEEDED, *_FURTHER} or table.empty:
        expected = f"{', '.join(_NEEDED)}, and if needed {', '.join(_FURTHER)}"
        found = f"{len(table)} sensors with the columns {', '.join(table)}"
        raise CommandError(f"{path}: {found}; expected {expected}")
    refuse(args, ["sensor"], f"{path} has a column name")
    if "rpm" in table:
        refuse(args, ["rpm_column"], f"{path} has a column rpm")
    is_repeated = table["name"].duplicated(keep=False)
    for line, row in enumerate(table.to_dict("records")):
        name, source, where = row["name"], row["source"], f"{path}, line {line + 2}"
        if not name or Path(name).name != name or is_repeated[line]:
            raise CommandError(f"{where}: name {name!r}, expected a unique name without slashes")
        if source in ("", "-"):
            raise CommandError(f"{where}: source {source!r}, expected a file or a folder")
        own = {"sensor": name, "model": path.parent / row["model"]}
        own["source"] = str(path.parent / source)
        if row.get("channel"):
            own["channel"] = channel_names(row["channel"])
        if rpm := row.get("rpm"):
            own["rpm"] = speed_facts(where, rpm)
        own["state"] = args.state and args.state / f"{name}.json"
        sensors.append(argparse.Namespace(**vars(args) | own))
    return sensors
