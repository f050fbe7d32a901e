"""Monitor of the samples of one sensor of ``skarxlag watch``, with its state."""

import argparse
import time
from pathlib import Path
from typing import Any, Self

import numpy as np

from ...monitoring import ConditionMonitor
from ...persistence.monitor_states import load_monitor_state, save_monitor_state
from ...verdicts.windows import HOLD
from ..commands.messages import (
    CommandError,
    UsageError,
    as_command_error,
    counted,
    listed,
    printable,
    say,
)
from ..commands.models import SavedModel
from ..commands.refused_rows import why_no_orders
from ..readers.rates import rates_agree
from .lines import SensorLines, sentence
from .source import SensorSource

#: Seconds between two savings of the state.
_SAVE_EVERY = 60.0
#: Arguments of the monitor.
_SETTINGS = (
    *("hop", "half_life", "false_alarm_interval", "alarm_delay", "latch"),
    "gap_tolerance",
)
#: State and facts of a monitor, as `load_monitor_state` returns them.
Memory = tuple[dict[str, Any], dict[str, Any]]


class SensorStream:
    """Monitor that reads a source, and keeps its state.

    Parameters
    ----------
    args : argparse.Namespace
        Arguments of the command.
    model : SavedModel
        The model.
    lines : SensorLines
        Lines for the verdicts.
    memory : tuple or None, default=None
        Result of `memory` of the stream before. None: the file of ``--state``, if there
        is one.
    source : SensorSource or None, default=None
        Source that stays open, since a pipe or a device cannot be opened again.

    Attributes
    ----------
    model : SavedModel
        The model.
    source : SensorSource
        The source.
    is_at_position : bool
        Whether a later run can continue after the last block.
    """

    def __init__(
        self,
        args: argparse.Namespace,
        model: SavedModel,
        lines: SensorLines,
        memory: Memory | None = None,
        source: SensorSource | None = None,
    ) -> None:
        self._args = args
        self.model = model
        self._lines = lines
        self._rate = args.sampling_rate or model.sampling_rate
        if self._rate is None:
            raise UsageError(
                f"argument --sampling-rate: needed, because {args.model} states none"
            )
        if not rates_agree(self._rate, model.sampling_rate):
            raise UsageError(
                f"argument --sampling-rate: {self._rate:g}, but {args.model} states "
                f"{model.sampling_rate:g}"
            )
        self.source = source or SensorSource(args, model, self._rate, self.say)
        states_speed = args.rpm or args.rpm_column or self.source.is_folder
        if model.capabilities.needs_rpm and not states_speed:
            raise UsageError(
                f"argument --rpm: needed, {args.model} was fitted at "
                f"{listed(model.train_rpm)} rpm"
            )
        model.check_order(args.source, args.channel)
        self.is_at_position = True
        self._limits = None
        self._is_saved_latched = False
        self._are_orders_missing = False
        self._status_at = time.monotonic()
        self._saved_at = time.monotonic()
        with as_command_error():
            self._monitor = ConditionMonitor(
                model.diagnoser,
                self._rate,
                detector=model.detector,
                conditions=None if model.healthy is None else model.conditions,
                train_rpm=model.train_rpm,
                window_length=model.window_length,
                **{name: getattr(args, name) for name in _SETTINGS},
            )
            self._position = self._restored(memory)
            if source is None:
                self.source.open(self._position)
            # A file that cannot be written is reported now, not in a minute.
            self.save()
        self.source.model = model
        lines.begin(model, self._monitor)

    def say(self, text: str) -> None:
        """Print a line to standard error, after the name of the sensor if the user stated one."""
        say(text if self._args.sensor is None else f"{self._args.sensor}: {text}")

    def _restored(self, memory):
        """Continue from a state, and return the position in the source; None for its beginning."""
        path = self._args.state
        if memory is None and (path is None or not path.exists()):
            return None
        state, facts = memory or load_monitor_state(path)
        for name, value in self.source.facts.items():
            if facts.get(name, value) != value:
                raise CommandError(
                    f"{path}: a state of {name.replace('_', ' ')} {facts[name]!r}, "
                    f"expected {value!r}; name another --state or delete it"
                )
        position = facts.get("position")
        is_pair = isinstance(position, list) and len(position) == 2
        if position is not None and not (is_pair and type(position[0]) is int):
            raise CommandError(
                f"{path}: the position in the source is {position!r}, expected two values"
            )
        if difference := self._difference(state, facts):
            # Somebody has to acknowledge the alarm, whatever the model is.
            self._monitor.latched = self._args.latch and is_latched(state)
            self.say(
                f"{difference}. Verdicts and the alarm start afresh from this position."
            )
        else:
            self._monitor.restore(state)
        return position

    def _difference(self, state, facts):
        """Describe why the monitor cannot continue from a state of its source; None if it can."""
        model = self.model
        identity = facts.get("model", model.identity)
        if identity is None:
            return "The source was interrupted where it cannot be continued"
        if identity != model.identity:
            return (
                f"The state is of model {identity[:12]} ({facts.get('model_file')}), "
                f"not of {model.short_identity} ({model.path})"
            )
        saved = state.get("settings")
        settings = self._monitor.state()["settings"]
        if not isinstance(saved, dict) or saved == settings:
            return None
        name = next(name for name in settings if saved.get(name) != settings[name])
        return f"The state has {name} {saved.get(name)}, and now it is {settings[name]}"

    def memory(self) -> Memory:
        """Return the state of the monitor, and the facts that say to what it belongs."""
        return self._monitor.state(), self.source.facts | {
            "position": self._position,
            "model": self.model.identity if self.is_at_position else None,
            "model_file": str(self._args.model),
        }

    def save(self) -> None:
        """Save the state, if a later run can continue after the last block."""
        path = self._args.state
        self._saved_at = time.monotonic()
        if path is not None and self.is_at_position:
            save_monitor_state(self._monitor, path, **self.memory()[1])
            self._is_saved_latched = self._monitor.latched

    def close(self) -> None:
        """Close the source."""
        self.source.blocks.close()

    def with_model(self, model: SavedModel) -> Self:
        """Return a stream with another model, which continues from the same position."""
        n_channels = self.model.n_channels
        if model.n_channels != n_channels:
            raise CommandError(
                f"{model.path}: {counted(model.n_channels, 'channel')}, expected "
                f"{n_channels}"
            )
        can_reopen = self.source.can_reopen
        if not can_reopen and not rates_agree(self._rate, model.sampling_rate):
            raise CommandError(
                f"{model.path}: sampled at {model.sampling_rate:g} Hz, expected "
                f"{self._rate:g} Hz"
            )
        source = None if can_reopen else self.source
        summary = self.summary()
        stream = type(self)(self._args, model, self._lines, self.memory(), source)
        self.say(f"Before the exchange of the model: {summary}")
        if can_reopen:
            self.close()
        return stream

    def step(self) -> bool | None:
        """Process the next block, if there is one.

        Returns
        -------
        bool or None
            Whether there was one; None if the source has ended.
        """
        try:
            block = next(self.source.blocks)
            if block is not None:
                self._take(block)
        except StopIteration:
            return None
        except ValueError as error:
            raise CommandError(f"{self._args.source}: {error}") from error
        return block is not None

    def _take(self, block):
        # A later run would read twice what was read behind the position.
        self.is_at_position = False
        if block.samples.size:
            samples, rpm = self.source.signals_of(block)
            self._say_of_orders(rpm)
            verdicts = self._monitor.update(samples, time=block.time, rpm=rpm)
            self._report(verdicts, block.source)
        if block.position is not None:
            self._position = block.position
            self.is_at_position = True
            is_news = self._monitor.latched != self._is_saved_latched
            if is_news or time.monotonic() - self._saved_at >= _SAVE_EVERY:
                self.save()

    def _say_of_orders(self, rpm):
        """Print once that shaft orders do not count, because the shaft is too slow."""
        if self._are_orders_missing or not self.model.capabilities.compares_orders:
            return
        speeds = np.ravel(np.nan if rpm is None else rpm)
        speeds = speeds[np.isfinite(speeds)]
        slowest = speeds.min() if speeds.size else None
        reason = why_no_orders(self.model.window_length, self._rate, slowest)
        if reason:
            self._are_orders_missing = True
            self.say(reason)

    def _report(self, verdicts, source):
        for verdict in verdicts:
            self._lines.add(verdict, source)
            if verdict.limits not in (HOLD, self._limits):
                self._limits = verdict.limits
                self.say(f"No alarm: {self._limits}.")
        now = time.monotonic()
        if verdicts and self._args.verbose and now - self._status_at >= 1.0:
            self._status_at = now
            self.say(sentence(verdicts[-1]))

    def acknowledge(self) -> None:
        """Acknowledge a latched alarm if the file next to the state asks for it."""
        path = self._args.state
        if (
            path is None
            or not self.is_at_position
            or not acknowledgement(path).exists()
        ):
            return
        if self._monitor.latched:
            self._monitor.acknowledge()
            self._lines.acknowledged()
            self.say(f"The alarm was acknowledged, and is {self._monitor.alarm_state}.")
            self.save()
        acknowledgement(path).unlink()

    def alarm(self) -> str | None:
        """Describe the delay of the alarm and the rate of false alarms; None without limits."""
        n = self._monitor.alarm_delay
        hours = self._monitor.false_alarm_interval
        if n is None:
            return None
        length = self.model.window_length
        seconds = ((n - 1) * (self._args.hop or length) + length) / self._rate
        return (
            f"Alarm: after {counted(n, 'window')} in a row that "
            f"{'exceeds' if n == 1 else 'exceed'} the healthy limits ({seconds:.3g} s of "
            "signal, plus its pauses). Mean time between false alarms: "
            f"{float(f'{hours:.3g}'):g} h of signal."
        )

    def summary(self) -> str:
        """Return the counts of the run and its last verdict."""
        counts = self._monitor.counts
        last = self._lines.last
        windows = ", ".join(
            f"{n} {name}" for name, n in sorted(counts["windows"].items())
        )
        parts = [counted(counts["samples"], "sample"), f"windows: {windows or 'none'}"]
        gaps = f"{counted(counts['gaps'], 'gap')} of {counts['missing_seconds']:.1f} s"
        parts.append(gaps if counts["gaps"] else "no gaps")
        further = {"clock steps back": counts["clock_steps_back"]}
        further |= self.source.unread
        parts += [f"{reason}: {n}" for reason, n in further.items() if n]
        parts.append(counted(counts["alarms"], "alarm"))
        if last is not None:
            parts.append(f"last: {printable(sentence(last))}")
        return "; ".join(parts)


def is_latched(state: dict[str, Any]) -> bool:
    """Return whether the alarm in the state of a monitor is latched."""
    alarm = state.get("alarm")
    return isinstance(alarm, dict) and alarm.get("latched") is True


def acknowledgement(state: Path) -> Path:
    """Return the file that asks a running `watch` to acknowledge an alarm.

    Parameters
    ----------
    state : Path
        File of the sensor's state.
    """
    return state.with_name(f"{state.name}.acknowledge")
