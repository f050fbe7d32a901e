"""Run ``skarxlag watch``: follow the sources of sensors until they end or a signal comes."""

import argparse
import signal
from contextlib import ExitStack
from typing import Any

from ..watch.options import SensorOptions
from ..watch.sensors import follow
from .messages import keywords


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    signals: list[Any] = []

    def note(*caught: Any) -> None:
        signals.append(caught)

    with ExitStack() as at_end:
        # These signals end the command where it does no harm.
        for number in (signal.SIGINT, signal.SIGTERM):
            at_end.callback(signal.signal, number, signal.signal(number, note))
        return int(follow(SensorOptions(**keywords(SensorOptions, args)), signals))
