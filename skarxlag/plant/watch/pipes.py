"""Follow a pipe, a device or standard input with a monitor."""

import math
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
#: Seconds in which samples are counted, and the share by which they may be wrong.
_COUNTED_FOR = 600.0
_CLOCK_TOLERANCE = 0.02


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
        self._rate = rate
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
        if model.capabilities.compares_orders:
            remark(why_no_orders(model.window_length, rate, self._rpm))
        self._closed_at: float | None = None

    @property
    def alarm_state(self) -> str:
        """State of the alarm, see `MonitorVerdict`."""
        return self.monitor.alarm_state

    def open(self) -> None:
        """Open the pipe, also after it has ended: windows start again."""
        options = self._options
        self.cut: CutBlock | None = None
        self.has_ended = self.is_readable = False
        # Time and samples from which arrivals are counted.
        self._counted_from = -math.inf, 0
        choose = partial(
            chosen_names,
            channel=options.channel,
            speed=options.rpm_column,
            usual=self._model.usual_channels,
        )
        if options.dtype is None:
            self._parser = TextParser(choose)
        else:
            self._parser = RawParser(options.dtype, choose)
        if self._closed_at is not None:
            pause = time.monotonic() - self._closed_at
            self.monitor.restore(self.monitor.state(), pause=pause)
        opener = partial(Path(options.source).open, "rb", buffering=0)
        if options.source == "-":
            if sys.stdin is None:
                raise CommandError("-: there is no standard input")
            opener = partial(nullcontext, sys.stdin.buffer.raw)
        self._pipe = Pipe(opener)

    def step(self) -> list[dict[str, Any]] | None:
        """Cut what has arrived into windows: no verdict yet, or None if nothing has."""
        self.cut = None
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
        cut = self.monitor.cut(samples, rpm=rpm)
        self._compare_with_clock()
        return cut

    def _compare_with_clock(self):
        """Compare the samples of some minutes with the clock of the computer."""
        now = time.monotonic()
        n_samples = self.monitor.counts["samples"]
        seconds = now - self._counted_from[0]
        if seconds < _COUNTED_FOR:
            return
        share = (n_samples - self._counted_from[1]) / (seconds * self._rate)
        # Other shares are those of a file that is replayed, or of a pause.
        if _CLOCK_TOLERANCE < abs(share - 1) < 0.5:
            self._remark(
                f"The pipe delivers {share:.0%} of the samples that {self._rate:g} Hz "
                "would give: its sampling rate is another, or samples are lost."
            )
        self._counted_from = now, n_samples

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
        windows = [f"{n} {quality}" for quality, n in sorted(counts["windows"].items())]
        return (
            f"{counted(counts['samples'], 'sample')}; windows: "
            f"{', '.join(windows) or 'none'}; {counted(counts['gaps'], 'gap')}; "
            f"{counted(counts['alarms'], 'alarm')}"
        )

    def close(self) -> None:
        """Close the pipe."""
        self._closed_at = time.monotonic()
        self._pipe.close()
