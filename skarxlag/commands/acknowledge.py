"""Acknowledge a latched alarm of a sensor that ``watch --latch`` follows.

The alarm goes off at once, or as soon as the signal is within the healthy limits again. If the
command watch does not run, the alarm is acknowledged when it starts.
"""

import argparse
from pathlib import Path

from ..persistence import load_monitor_state
from .messages import CommandError, as_command_error, say
from .watch_stream import acknowledgement


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    text = "the file of watch --state; with a table, that of the sensor in the folder"
    parser.add_argument("states", nargs="+", type=Path, metavar="STATE.json", help=text)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    with as_command_error():
        states = {path: load_monitor_state(path)[0] for path in args.states}
        for path, state in states.items():
            if state.get("latched") is not True:
                raise CommandError(f"{path}: there is no latched alarm")
        for path in states:
            acknowledgement(path).touch()
            say(f"{path}: the alarm will be acknowledged when watch looks at it next.")
    return 0
