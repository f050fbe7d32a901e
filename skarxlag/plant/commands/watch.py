"""Run ``skarxlag watch``: follow the sources of sensors until they end or a signal comes."""

import argparse
import signal
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

from ..watch.lines import OutputError
from ..watch.table import Plant
from .messages import CommandError, as_command_error


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    plant = Plant(args)
    plant.start()
    with as_command_error(), _stop_signals() as signals:
        try:
            plant.follow(signals)
        except OutputError as error:
            raise CommandError(f"standard output: {error}") from error
        finally:
            plant.save()
    return int(plant.finish())


@contextmanager
def _stop_signals() -> Iterator[list[Any]]:
    """Collect SIGINT and SIGTERM, so that they end the command where it does no harm."""
    received: list[Any] = []
    with ExitStack() as at_end:
        for number in (signal.SIGINT, signal.SIGTERM):
            before = signal.signal(number, lambda *caught: received.append(caught))
            at_end.callback(signal.signal, number, before)
        yield received
