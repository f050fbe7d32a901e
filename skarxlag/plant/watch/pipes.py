"""Follow a pipe, a device or standard input with a monitor."""

import queue
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Any

from ...monitoring import ConditionMonitor
from ...monitoring.together import CutBlock
from ..commands.messages import (
    CommandError,
    UsageError,
    counted,
    refuse,
    speeds_as_text,
)
from ..commands.models import SavedModel
from ..commands.remarks import why_no_orders
from ..commands.training_facts import channel_difference
from ..readers.formats.rates import rates_agree
from .options import SensorOptions
from .parsing import RawParser, TextParser, chosen_names

_BYTES_AT_A_TIME = 2**18
_READ_AHEAD = 4
#: Hours of signal between false alarms, at least.
_INTERVAL = 1000.0


class Pipe:
    """Reader of a pipe in a thread of its own, because opening and reading may block.

    Parameters
    ----------
    open_stream : callable
        Opens the pipe without a buffer.
    """

    def __init__(self, open_stream: Callable[[], Any]) -> None:
        self._open = open_stream
        self._arrived: queue.Queue[bytes | Exception] = queue.Queue(_READ_AHEAD)
        self._is_closed = False
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        end: bytes | Exception = b""
        try:
            with self._open() as stream:
                while not self._is_closed and (data := stream.read(_BYTES_AT_A_TIME)):
                    self._arrived.put(data)
        except (OSError, ValueError) as error:
            end = error
        self._arrived.put(end)

    def arrived(self) -> Iterator[bytes]:
        """Yield what has arrived; at the end of the pipe nothing, or its error is raised."""
        while not self._arrived.empty():
            data = self._arrived.get()
            if isinstance(data, Exception):
                raise data
            yield data

    def close(self) -> None:
        """Let the thread end, which may wait for room."""
        self._is_closed = True
        while not self._arrived.empty():
            self._arrived.get()


class PipeFollower:
    """Monitor of the samples of a pipe, a device or standard input.

    Parameters
    ----------
    options : SensorOptions
        Options of the sensor.
    model : SavedModel
        The model.
    remark : callable
        Prints a line about the sensor, once.

    Attributes
    ----------
    monitor : ConditionMonitor
        The monitor.
    cut : CutBlock or None
        Windows of what was new, which are not diagnosed yet.
    has_ended, is_readable : bool
        Whether the pipe has ended, and whether it holds what the model expects.
    is_waiting : bool
        False, since samples are taken as they come.
    """

    is_waiting = False
    has_ended = False
    is_readable = False

    def __init__(
        self,
        options: SensorOptions,
        model: SavedModel,
        remark: Callable[[str], None],
    ) -> None:
        rate = options.sampling_rate or model.sampling_rate
        if rate is None or not rates_agree(rate, model.sampling_rate):
            raise UsageError(
                f"argument --sampling-rate: {rate} Hz, but {options.model} states "
                f"{model.sampling_rate}"
            )
        if model.capabilities.needs_rpm and not (options.rpm or options.rpm_column):
            raise UsageError(
                f"argument --rpm: needed, {options.model} was fitted at "
                f"{speeds_as_text(model.train_rpm)} rpm"
            )
        if options.dtype is not None:
            refuse(options, ["rpm_column"], "belongs to csv lines")
        if speeds := options.rpm.get("speed_source"):
            refuse(options, ["rpm"], f"{speeds} is for a folder; use --rpm-column")
        self._options = options
        self._model = model
        self._remark = remark
        self._rpm = options.rpm.get("rpm")
        self.monitor = ConditionMonitor(
            model.diagnoser,
            rate,
            detector=model.detector,
            conditions=None if model.healthy is None else model.conditions,
            train_rpm=model.train_rpm,
            window_length=model.window_length,
            false_alarm_interval=options.false_alarm_interval or _INTERVAL,
            alarm_delay=options.alarm_delay,
            half_life=options.half_life,
            latch=options.latch,
        )
        self._window_seconds = model.window_length / rate
        if model.capabilities.compares_orders:
            remark(why_no_orders(model.window_length, rate, self._rpm))
        choose = partial(
            chosen_names,
            channel=options.channel,
            speed=options.rpm_column,
            usual=model.usual_channels,
        )
        if options.dtype is None:
            self._parser = TextParser(choose)
        else:
            self._parser = RawParser(options.dtype, choose)
        self._pipe: Pipe | None = None
        self.cut: CutBlock | None = None

    @property
    def alarm_state(self) -> str:
        """State of the alarm, see `MonitorVerdict`."""
        return self.monitor.alarm_state

    @property
    def heading(self) -> str:
        """Delay of the alarm and rate of false alarms."""
        n = self.monitor.alarm_delay
        if n is None:
            return "No alarm: the model has no healthy limits."
        return (
            f"Alarm: after {counted(n, 'consecutive window')} beyond the healthy limits "
            f"({n * self._window_seconds:.3g} s of signal). Expected false alarms: at "
            f"most one in {self.monitor.false_alarm_interval:.3g} h of signal."
        )

    def step(self) -> list[dict[str, Any]] | None:
        """Cut what has arrived into windows: no verdict yet, or None if nothing has."""
        self.cut = None
        if self._pipe is None:
            self._pipe = Pipe(self._opener())
        data = [*self._pipe.arrived()]
        self.has_ended = b"" in data
        try:
            samples = self._parser.samples(b"".join(data), self.has_ended)
            if samples.size:
                self.cut = self._cut(samples)
                self.is_readable = True
        except (ValueError, CommandError) as error:
            raise CommandError(f"{self._options.source}: {error}") from error
        return [] if data else None

    def _opener(self):
        if self._options.source != "-":
            return partial(Path(self._options.source).open, "rb", buffering=0)
        if sys.stdin is None:
            raise CommandError("-: there is no standard input")
        return partial(nullcontext, sys.stdin.buffer.raw)

    def _cut(self, samples):
        rpm = self._rpm
        if self._options.rpm_column is not None:
            *samples, rpm = samples
        n_channels = self._model.n_channels
        if len(samples) != n_channels:
            advice = self._parser.advice or "--channel chooses"
            raise CommandError(
                f"{counted(len(samples), 'channel')}, expected {n_channels}; {advice}"
            )
        channels = self._parser.channels[:n_channels]
        difference = channel_difference(
            channels, self._model.facts, self._options.channel
        )
        if difference:
            self._remark(f"Limits may not hold: {difference}.")
        return self.monitor.cut(samples, rpm=rpm)

    def restore(self, state: dict[str, Any], facts: dict[str, Any]) -> None:
        """Continue from a state, after the pause since it was saved."""
        pause = max(time.time() - facts["saved"], 0.0)
        self.monitor.restore(state, pause=pause)

    def facts(self) -> dict[str, Any]:
        """Return what is saved with the state."""
        return {}

    def close(self) -> None:
        """Close the pipe."""
        if self._pipe is not None:
            self._pipe.close()
