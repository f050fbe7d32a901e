"""One sensor of ``skarxlag watch``: its source, its monitor, its state and its lines."""

import argparse
import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path

from ..monitoring import ConditionMonitor
from ..persistence import load_monitor_state, save_monitor_state
from ..recordings.formats._contents import ContentError
from ..recordings.listing import ListedRecording
from ..recordings.live import Block, from_folder, from_growing_file, from_stream
from ..recordings.live_samples import RawSamples, TextSamples
from ..recordings.live_times import StreamTimes
from ..recordings.rates import rates_agree
from ..recordings.speeds import TACHO, TachoStream
from ..verdicts import HOLD
from .arguments import refuse
from .messages import CommandError, UsageError, as_command_error, say
from .models import SavedModel
from .watch_output import VerdictLines, sentence, summary

#: Seconds between two savings of the state.
_SAVE_EVERY = 60.0
#: Arguments on which the meaning of a state depends.
_READING = ("channel", "dtype", "time_column", "rpm_column", "pulses_per_turn")
#: Arguments of the monitor.
_SETTINGS = ("hop", "half_life", "false_alarm_interval", "gap_tolerance")


class SensorStream:
    """A sensor that is watched.

    Parameters
    ----------
    args : argparse.Namespace
        Arguments of the command.
    model : SavedModel
        The model.

    Attributes
    ----------
    blocks : iterator of Block or None
        The source.
    is_at_place : bool
        Whether a later run can continue after the last block.
    """

    blocks: Iterator[Block | None]
    is_at_place: bool

    def __init__(self, args: argparse.Namespace, model: SavedModel) -> None:
        self._args, self._model = args, model
        self._rate = args.sampling_rate or model.sampling_rate
        if self._rate is None:
            raise UsageError(f"argument --sampling-rate: needed, {args.model} states none")
        if not rates_agree(self._rate, model.sampling_rate):
            raise UsageError(
                f"argument --sampling-rate: {self._rate:g}, but {args.model} was fitted at "
                f"{model.sampling_rate:g} Hz"
            )
        path = Path(args.source)
        self._is_folder = args.source != "-" and path.is_dir()
        is_stated = args.rpm is not None or args.rpm_column is not None or self._is_folder
        if model.can.needs_rpm and not is_stated:
            listed = ", ".join(f"{speed:g}" for speed in model.train_rpm or model.can.speeds)
            raise UsageError(f"argument --rpm: needed, {args.model} was fitted at {listed} rpm")
        self._tacho, self._speed_column = None, args.rpm_column
        if isinstance(args.rpm, str):
            self._tacho = TachoStream(self._rate, args.pulses_per_turn or 1)
            self._speed_column = args.rpm.removeprefix(TACHO)
        self._facts = {name: vars(args)[name] for name in _READING} | {
            "source": args.source if args.source == "-" else str(path.resolve()),
            "model": model.identity,
            "sampling_rate": self._rate,
        }
        sensor = args.sensor or (args.model if args.source == "-" else path).stem
        self._lines = VerdictLines(sensor, model.healthy, args.every, args.heartbeat)
        self._said, self._limits, self.is_at_place = time.monotonic(), None, True
        self._unread: Counter[str] = Counter()
        with as_command_error():
            self._monitor = ConditionMonitor(
                model.diagnoser,
                self._rate,
                conditions=None if model.healthy is None else model.conditions,
                detector=model.detector,
                window_length=model.window_length,
                train_rpm=model.train_rpm or (),
                **{name: vars(args)[name] for name in _SETTINGS},
            )
            self._place = self._restored()
            # A file that cannot be written is reported now, not in a minute.
            self.save()
            self.blocks = self._source(path)

    def say(self, text: str) -> None:
        """Print a line to standard error, after the name of the sensor if the user stated one."""
        say(text if self._args.sensor is None else f"{self._args.sensor}: {text}")

    def _restored(self):
        """Place from which the source continues; None for its beginning."""
        path = self._args.state
        if path is None or not path.exists():
            return None
        state, facts = load_monitor_state(path)
        for name, own in self._facts.items():
            if facts.get(name, own) != own:
                found = f"{name.replace('_', ' ')} {facts[name]!r}, expected {own!r}"
                found = "another model" if name == "model" else found
                raise CommandError(f"{path}: a state of {found}; name another --state or delete it")
        place = facts.get("place")
        is_pair = isinstance(place, list) and len(place) == 2 and type(place[0]) is int
        if place is not None and not is_pair:
            raise CommandError(f"{path}: place {place!r}, expected two values")
        self._monitor.restore(state)
        return place

    def save(self) -> None:
        """Save the state, if a later run can continue after the last block."""
        self._saved = time.monotonic()
        if self._args.state is not None and self.is_at_place:
            save_monitor_state(self._monitor, self._args.state, place=self._place, **self._facts)

    def _source(self, path):
        args, length = self._args, self._model.window_length
        self._model.check_order(args.source, args.channel)
        if self._is_folder or args.dtype:
            source = "a folder" if self._is_folder else "raw samples"
            refuse(args, ["time_column", "rpm_column"], f"belongs to csv lines, not to {source}")
        if self._is_folder:
            options = {
                "recording": self._recording(),
                "n_channels": self._model.n_channels,
                "window_length": length,
                "settle": args.settle,
                "has_times": args.timed_files,
                "takes_rpm": self._model.takes_rpm,
                "needs_rpm": self._model.can.needs_rpm,
            }
            return from_folder(path, options, self.say, self._place)
        if args.dtype is None:
            tolerance = args.gap_tolerance or 0.5 * length / self._rate
            times = StreamTimes(args.time_column, self._rate, tolerance, length)
            parser = TextSamples(args.channel, times, self._speed_column)
        else:
            parser = RawSamples(args.dtype, args.channel, self._speed_column)
        self._unread = parser.unread
        if args.source == "-":
            if sys.stdin is None:
                raise CommandError("-: there is no standard input")
            return from_stream(lambda: nullcontext(sys.stdin.buffer.raw), parser)
        if path.is_fifo() or path.is_char_device():
            return from_stream(lambda: path.open("rb", buffering=0), parser)
        if not path.is_file():
            raise FileNotFoundError(f"{path}: no such file or folder")
        return from_growing_file(path, parser, self.say, self._place)

    def _recording(self):
        """Facts of the files of a folder."""
        args, speed = self._args, {"rpm": self._args.rpm}
        if self._tacho is not None:
            speed = {"speed_source": args.rpm, "pulses_per_turn": args.pulses_per_turn or 1}
        facts = {"channel": args.channel, "dtype": args.dtype, "sampling_rate": self._rate}
        return ListedRecording(None, "", Path(), **facts, **speed)

    def step(self) -> bool | None:
        """Process the next block, if there is one.

        Returns
        -------
        bool or None
            Whether there was one; None if the source has ended.
        """
        try:
            block = next(self.blocks)
            if block is not None:
                self._take(block)
        except StopIteration:
            return None
        except ContentError as error:
            raise CommandError(f"{self._args.source}: {error}") from error
        self._lines.beat()
        return block is not None

    def _take(self, block):
        # A later run would read twice what was read behind the place.
        self.is_at_place = False
        samples, rpm = block.samples, block.rpm if self._is_folder else self._args.rpm
        if self._speed_column is not None and not self._is_folder and samples.size:
            samples, rpm = samples[:-1], samples[-1]
            rpm = rpm if self._tacho is None else self._tacho.speeds(rpm)
        if samples.size:
            if len(samples) != self._model.n_channels:
                raise ContentError(
                    f"{len(samples)} channels, but {self._args.model} was fitted on "
                    f"{self._model.n_channels}; --channel chooses"
                )
            self._report(self._monitor.update(samples, time=block.time, rpm=rpm), block.source)
        if block.place is not None:
            self._place, self.is_at_place = block.place, True
            if time.monotonic() - self._saved >= _SAVE_EVERY:
                self.save()

    def _report(self, verdicts, source):
        self._lines.write(verdicts, source)
        for verdict in verdicts:
            if verdict.limits not in (HOLD, self._limits):
                self._limits = verdict.limits
                self.say(f"No alarm: {self._limits}.")
        if verdicts and self._args.verbose and time.monotonic() - self._said >= 1.0:
            self._said = time.monotonic()
            self.say(sentence(verdicts[-1]))

    def summary(self) -> str:
        """Return the counts of the run and its last verdict."""
        return summary(self._monitor, self._unread, self._lines.last)
