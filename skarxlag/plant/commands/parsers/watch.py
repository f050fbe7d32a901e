"""Diagnose a running sensor with a diagnoser that `fit` saved.

SOURCE is - for standard input, a file that grows, a named pipe or serial device, or a
folder into which a logger drops files. Streams and growing files hold csv lines, or raw
samples with --dtype; files in a folder are of any format that diagnose reads. Writes
one line of JSON for each window to standard output, or fewer with --every, and a
summary to standard error. The alarm takes the healthy limits that `fit` saved in the
model. Ends with the input, or on Ctrl-C. Instead of MODEL.skops and SOURCE, a csv table
names several sensors in the columns name, source and model, and optionally channel and
rpm. A sensor of a table that cannot be watched is reported and tried again. A model
whose file changes is exchanged. Several channels are separated by ; with the output
first. With --timed-files, a file begins at the date that it states, or else its time of
modification is that of its last sample. With --state, a later run continues from there.
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
from ..messages import UsageError


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
    option(
        parser,
        "--time-column",
        "csv column of times; none: ignore times",
        metavar="NAME",
    )
    option(parser, "--hop", "between windows; default: their length", int, "SAMPLES")
    alarm = parser.add_mutually_exclusive_group()
    text = "least mean of signal between false alarms; default: 1000"
    option(alarm, "--false-alarm-interval", text, positive_number, "HOURS")
    text = "that exceed the limits in a row and raise the alarm; default: by the interval above"
    option(alarm, "--alarm-delay", text, positive_int, "WINDOWS")
    flag(
        parser, "--latch", "keep an alarm on until skarxlag acknowledge; needs --state"
    )
    flag(parser, "--timed-files", "there may be gaps between the files of a folder")
    option(
        parser,
        "--state",
        "save every minute; with a table, a folder",
        Path,
        "FILE.json",
    )
    texts = {
        "--half-life": "of evidence; default: 10",
        "--gap-tolerance": "lateness that is no gap; default: half a window",
        "--idle": "end after so long without anything new; default: never",
        "--poll": "pause between looks; default: 0.2",
        "--retry": "between attempts to watch a sensor, and looks for changed models; default: 60",
        "--settle": "pause after which a file in a folder is finished; default: 2",
        "--every": "between lines of JSON, unless the verdict changes; default: every window",
        "--heartbeat": "without a line, then write a heartbeat; default: never",
    }
    for name, text in texts.items():
        option(parser, name, text, positive_number, "SECONDS")
    option(
        parser,
        "--sensor",
        "stated in each line; default: name of SOURCE",
        metavar="NAME",
    )
    flag(parser, "-v --verbose", "print one status line a second")
    parser.set_defaults(half_life=10.0, false_alarm_interval=1000.0, rpm={})
    parser.set_defaults(poll=0.2, retry=60.0, settle=2.0)


def check(args: argparse.Namespace) -> None:
    """Check what needs no model."""
    if args.source is None and is_model_file(args.model):
        args.source = "-"
    if args.latch and args.state is None:
        raise UsageError(
            "argument --latch: needs --state, next to which alarms are acknowledged"
        )
    check_input(args.model)
