"""Diagnose running sensors with a diagnoser that `fit` saved.

SOURCE is - for standard input, a named pipe or a serial device, or a folder into which a
logger drops recordings. Pipes hold csv lines, or raw samples with --dtype. A pipe has a
verdict for each window, and a folder one for each recording, as diagnose has. Writes one
line of JSON for each verdict to standard output, or fewer with --every, and a summary to
standard error. The alarm takes the healthy limits that `fit` saved in the model. Ends
with the input, or on Ctrl-C. Instead of MODEL.skops and SOURCE, a csv table names
several sensors in the columns name, source and model, and optionally channel and rpm. A
sensor of a table that cannot be watched is reported and tried again. Several channels
are separated by ; with the output first. With --state, a later run continues from
there.
"""

import argparse
from pathlib import Path

from ...readers.recording_tables import channel_names
from ..arguments import (
    flag,
    option,
    positive_int,
    positive_number,
    sampling_rate,
    speed_or_source,
)
from ..files import check_input, is_model_file
from ..messages import CommandError, UsageError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "model", type=Path, metavar="MODEL.skops", help="or a csv table"
    )
    parser.add_argument(
        "source", nargs="?", metavar="SOURCE", help="default: standard input"
    )
    option(
        parser,
        "--dtype",
        "of raw samples: <i2, or '(4,)<f4' for 4 channels",
        metavar="TYPE",
    )
    text = (
        "name, position or pattern such as *DE_time; default: all but a column of times"
    )
    option(parser, "--channel", text, channel_names, "NAME")
    option(parser, "--sampling-rate", "default: the model's", sampling_rate, "HZ")
    speed = parser.add_mutually_exclusive_group()
    option(
        speed,
        "--rpm",
        "or pulses as tacho:CHANNEL, or a csv log",
        speed_or_source,
        "RPM",
    )
    option(speed, "--rpm-column", "csv column of shaft speeds", metavar="NAME")
    option(
        parser, "--pulses-per-revolution", "of the tachometer; default: 1", positive_int
    )
    alarm = parser.add_mutually_exclusive_group()
    text = "least mean of signal between false alarms of a pipe; default: 1000"
    option(alarm, "--false-alarm-interval", text, positive_number, "HOURS")
    text = (
        "windows of a pipe, or snapshots of a folder, that exceed the limits in a row \
and raise the alarm; default: by the interval above, or 1 snapshot"
    )
    option(alarm, "--alarm-delay", text, positive_int)
    flag(
        parser, "--latch", "keep an alarm on until skarxlag acknowledge; needs --state"
    )
    option(
        parser,
        "--state",
        "save every minute; with a table, a folder",
        Path,
        "FILE.json",
    )
    texts = {
        "--half-life": "of the evidence in a pipe; default: 10",
        "--idle": "end after so long without anything new; default: never",
        "--retry": "between attempts to watch a sensor; default: 60",
        "--settle": "pause after which a file in a folder is finished; default: 2",
        "--every": "between lines of JSON, unless the verdict changes; heartbeats while there is \
no verdict; default: a line for each verdict",
    }
    for name, text in texts.items():
        option(parser, name, text, positive_number, "SECONDS")
    parser.set_defaults(half_life=10.0, rpm={}, retry=60.0, settle=2.0)


def check(args: argparse.Namespace) -> None:
    """Check what needs no model."""
    if args.source is None and is_model_file(args.model):
        args.source = "-"
    if args.latch and args.state is None:
        raise UsageError(
            "argument --latch: needs --state, next to which alarms are acknowledged"
        )
    check_input(args.model)
    if args.state is not None:
        if args.source is None:
            args.state.mkdir(parents=True, exist_ok=True)
        elif not args.state.parent.is_dir():
            raise CommandError(f"{args.state.parent}: no such folder")
