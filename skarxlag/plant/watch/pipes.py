"""Follow a pipe, a device or standard input with a monitor."""

import argparse
import queue
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ...monitoring import ConditionMonitor
from ...monitoring.monitor import CutBlock
from ..commands.arguments import refuse
from ..commands.channels import channel_remarks
from ..commands.messages import CommandError, UsageError, counted, listed
from ..commands.models import SavedModel
from ..commands.remarks import why_no_orders
from ..readers.rates import rates_agree
from ..readers.speeds import TACHO
from ..readers.tacho import TachoStream
from .parsing import Part, RawParser, TextParser, chosen_names
from .stream_times import StreamTimes

_BYTES_AT_A_TIME = 2**18
_READ_AHEAD = 4
#: Arguments of the monitor.
_SETTINGS = ("half_life", "alarm_delay", "latch", "gap_tolerance")
#: Hours of signal between false alarms, at least.
_INTERVAL = 1000.0


class Pipe:
    """Reader of a pipe in a thread of its own, because opening and reading may block.

    Parameters
    ----------
    open_stream : callable
        Opens the pipe without a buffer.
    news : Event
        Set if no more can be read ahead, or the pipe has ended.
    """

    def __init__(self, open_stream: Callable[[], Any], news: threading.Event) -> None:
        self._open = open_stream
        self._news = news
        self._arrived: queue.Queue[bytes | Exception] = queue.Queue(_READ_AHEAD)
        self._is_closed = False
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        end: bytes | Exception = b""
        try:
            with self._open() as stream:
                while not self._is_closed and (data := stream.read(_BYTES_AT_A_TIME)):
                    self._arrived.put(data)
                    if self._arrived.full():
                        self._news.set()
        except (OSError, ValueError) as error:
            end = error
        self._arrived.put(end)
        self._news.set()

    def arrived(self) -> Iterator[bytes]:
        """Yield what has arrived; at the end of the pipe nothing, or its error is raised."""
        while not self._arrived.empty():
            data = self._arrived.get()
            if isinstance(data, Exception):
                raise data
            yield data

    def close(self) -> None:
        """Let the thread end."""
        self._is_closed = True
        # It may wait for room.
        while not self._arrived.empty():
            self._arrived.get()


class PipeFollower:
    """Monitor of the samples of a pipe, a device or standard input.

    Parameters
    ----------
    args : argparse.Namespace
        Arguments of the command for the sensor.
    model : SavedModel
        The model.
    say : callable
        Prints a line about the sensor.
    news : Event
        As `Pipe` sets it.

    Attributes
    ----------
    monitor : ConditionMonitor
        The monitor.
    has_ended, is_readable : bool
        Whether the pipe has ended, and whether it holds what the model expects.
    """

    def __init__(
        self,
        args: argparse.Namespace,
        model: SavedModel,
        say: Callable[[str], None],
        news: threading.Event,
    ) -> None:
        self._args = args
        self._model = model
        self._say = say
        self.has_ended = self.is_readable = False
        self._remarks: set[str] = set()
        rate = args.sampling_rate or model.sampling_rate
        if rate is None:
            raise UsageError(
                f"argument --sampling-rate: needed, because {args.model} states none"
            )
        if not rates_agree(rate, model.sampling_rate):
            raise UsageError(
                f"argument --sampling-rate: {rate:g}, but {args.model} states "
                f"{model.sampling_rate:g}"
            )
        if model.capabilities.needs_rpm and not (args.rpm or args.rpm_column):
            raise UsageError(
                f"argument --rpm: needed, {args.model} was fitted at "
                f"{listed(model.train_rpm)} rpm"
            )
        self._rate = rate
        self.monitor = ConditionMonitor(
            model.diagnoser,
            rate,
            detector=model.detector,
            conditions=None if model.healthy is None else model.conditions,
            train_rpm=model.train_rpm,
            window_length=model.window_length,
            false_alarm_interval=args.false_alarm_interval or _INTERVAL,
            **{name: getattr(args, name) for name in _SETTINGS},
        )
        self._tacho = None
        self._speed_column = args.rpm_column
        speeds = args.rpm.get("speed_source", "")
        if speeds.startswith(TACHO):
            self._tacho = TachoStream(rate, args.pulses_per_revolution or 1)
            self._speed_column = speeds.removeprefix(TACHO)
        elif speeds:
            advice = f"is for a folder; use {TACHO}CHANNEL, --rpm-column"
            refuse(args, ["rpm"], f"{speeds} {advice}")
        self._parser = self._new_parser()
        self._parts: Iterator[Part] = iter(())
        self._pipe = Pipe(self._opener(), news)

    @property
    def alarm_state(self) -> str:
        """State of the alarm, see `MonitorVerdict`."""
        return self.monitor.alarm_state

    def _new_parser(self):
        args = self._args
        choose = partial(
            chosen_names,
            channel=args.channel,
            speed=self._speed_column,
            usual=self._model.usual_channels,
        )
        if args.dtype is not None:
            refuse(args, ["time_column", "rpm_column"], "belongs to csv lines")
            return RawParser(args.dtype, choose)
        length = self._model.window_length
        tolerance = args.gap_tolerance or 0.5 * length / self._rate
        times = StreamTimes(args.time_column, self._rate, tolerance, length)
        return TextParser(choose, times)

    def _opener(self):
        if self._args.source != "-":
            return partial(Path(self._args.source).open, "rb", buffering=0)
        if sys.stdin is None:
            raise CommandError("-: there is no standard input")
        return partial(nullcontext, sys.stdin.buffer.raw)

    def step(self) -> bool:
        """Take what has arrived, and return whether there was something."""
        data = [*self._pipe.arrived()]
        self.has_ended = b"" in data
        if data:
            self._parts = self._parser.parts(b"".join(data), self.has_ended)
        return bool(data)

    def next_cut(self) -> CutBlock | None:
        """Return the next part of what has arrived, cut into windows; None if there is none."""
        part = next(self._parts, None)
        if part is None:
            return None
        samples, time = part
        rpm = self._args.rpm.get("rpm")
        if self._speed_column is not None:
            rpm = samples[-1]
            samples = samples[:-1]
            if self._tacho is not None:
                rpm = self._tacho.speeds(rpm)
        n_channels = self._model.n_channels
        if len(samples) != n_channels:
            advice = getattr(self._parser, "advice", "") or "--channel chooses"
            raise CommandError(
                f"{counted(len(samples), 'channel')}, expected {n_channels}; {advice}"
            )
        channels = self._parser.channels[:n_channels]
        for remark in channel_remarks(channels, self._model.facts, self._args.channel):
            self._remark(remark)
        self._remark_on_orders(rpm)
        cut = self.monitor.cut(samples, time=time, rpm=rpm)
        self.is_readable = True
        return cut

    def _remark_on_orders(self, rpm):
        """Print once that shaft orders do not count, because the shaft is too slow."""
        speeds = np.ravel(np.nan if rpm is None else rpm)
        speeds = speeds[np.isfinite(speeds)]
        if not speeds.size or not self._model.capabilities.compares_orders:
            return
        length = self._model.window_length
        if reason := why_no_orders(length, self._rate, speeds.min()):
            self._remark(reason)

    def _remark(self, text):
        if text not in self._remarks:
            self._remarks.add(text)
            self._say(text)

    def restore(
        self, state: dict[str, Any], facts: dict[str, Any], pause: float
    ) -> None:
        """Continue from a state that was saved some seconds ago."""
        self.monitor.restore(state, pause=pause)

    def facts(self) -> dict[str, Any]:
        """Return what is saved with the state."""
        return {}

    def alarm(self) -> str | None:
        """Describe the delay of the alarm and the rate of false alarms; None without limits."""
        n = self.monitor.alarm_delay
        if n is None:
            return None
        rate = 1 / self.monitor.false_alarm_interval
        seconds = n * self._model.window_length / self._rate
        return (
            f"Alarm: after {counted(n, 'window')} in a row that "
            f"{'exceeds' if n == 1 else 'exceed'} the healthy limits ({seconds:.3g} s of "
            f"signal). Expected false alarms: {rate:.2g} an hour and {rate * 8766:.2g} a "
            "year of signal."
        )

    def summary(self) -> str:
        """Return the counts of the run."""
        counts = self.monitor.counts
        windows = ", ".join(
            f"{n} {name}" for name, n in sorted(counts["windows"].items())
        )
        parts = [counted(counts["samples"], "sample"), f"windows: {windows or 'none'}"]
        gaps = f"{counted(counts['gaps'], 'gap')} of {counts['missing_seconds']:.1f} s"
        parts.append(gaps if counts["gaps"] else "no gaps")
        if counts["clock_steps_back"]:
            parts.append(f"clock steps back: {counts['clock_steps_back']}")
        parts.append(counted(counts["alarms"], "alarm"))
        return "; ".join(parts)

    def close(self) -> None:
        """Close the pipe."""
        self._pipe.close()
