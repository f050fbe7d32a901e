"""Run ``skarxlag watch``: follow the sources of sensors until they end or a signal comes."""

import argparse
import signal
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

from .messages import CommandError, as_command_error, say
from .models import SavedModel
from .watch_stream import SensorStream


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    sensors = args.sensors
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


@contextmanager
def _stop_signals() -> Iterator[list[Any]]:
    """Collect SIGINT and SIGTERM, so that they end the command where it does no harm."""
    received: list[Any] = []
    with ExitStack() as at_end:
        for number in (signal.SIGINT, signal.SIGTERM):
            before = signal.signal(number, lambda *caught: received.append(caught))
            at_end.callback(signal.signal, number, before)
        yield received


def _follow(streams, args, signals):
    """Process blocks until all sources have ended, or nothing comes, or a signal requests it.

    Return whether one of several sources could not be read to its end.
    """
    since, has_failed, is_alone = time.monotonic(), False, len(streams) == 1
    while streams:
        found = {}
        for stream in streams:
            try:
                with as_command_error():
                    found[stream] = stream.step()
            except CommandError as error:
                if is_alone:
                    raise
                stream.say(f"error: {error}; the other sensors are watched on")
                has_failed, found[stream] = True, None
        if any(found.values()):
            since = time.monotonic()
        elif args.idle is not None and time.monotonic() - since >= args.idle:
            break
        elif None not in found.values() and not signals:
            time.sleep(args.poll)
        streams = [each for each in streams if found[each] is not None]
        streams = [each for each in streams if not (signals and each.is_at_place)]
    return has_failed
