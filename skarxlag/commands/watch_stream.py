"""One sensor of ``skarxlag watch``: its source, its monitor, its state and its lines."""

import argparse
import json
import math
import sys
import time
from collections import Counter
from contextlib import nullcontext
from datetime import UTC, datetime
from operator import attrgetter
from pathlib import Path

from ..monitoring import ConditionMonitor, MonitorVerdict
from ..persistence import load_monitor_state, save_monitor_state
from ..recordings.listing import ListedRecording
from ..recordings.live import from_folder, from_growing_file, from_stream
from ..recordings.live_samples import RawSamples, StreamTimes, TextSamples
from ..recordings.rates import rates_agree
from ..recordings.speeds import TACHO, TachoStream
from ..verdicts import HOLD
from .arguments import refuse
from .channels import channel_remarks
from .messages import CommandError, UsageError, as_command_error, listed, percent, printable, say
from .models import SavedModel

#: Seconds between two savings of the state.
_SAVE_EVERY = 60.0
#: Arguments on which the meaning of a state depends.
_READING = ("channel", "dtype", "time_column", "rpm_column", "pulses_per_turn")
#: Arguments of the monitor.
_SETTINGS = ("hop", "half_life", "false_alarm_interval", "gap_tolerance")
#: What of a verdict is written at once if it differs from the line before.
_news = attrgetter("verdict", "alarm", "quality")
#: Range of the seconds since 1970 that are taken for dates, from 1973 to 2096. A clock that counts
#: from the start of a machine is below it.
_DATES = (1e8, 4e9)


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

    def __init__(self, args: argparse.Namespace, model: SavedModel) -> None:
        self._args, self._model = args, model
        self._rate = args.sampling_rate or model.sampling_rate
        if self._rate is None or not rates_agree(self._rate, model.sampling_rate):
            stated = f"{self._rate or 'needed'}, but {args.model} states {model.sampling_rate}"
            raise UsageError(f"argument --sampling-rate: {stated}")
        path, is_stdin = Path(args.source), args.source == "-"
        self._is_folder = not is_stdin and path.is_dir()
        if model.can.needs_rpm and not (args.rpm or args.rpm_column or self._is_folder):
            fitted = f"{args.model} was fitted at {listed(model.train_rpm)} rpm"
            raise UsageError(f"argument --rpm: needed, {fitted}")
        if self._is_folder or args.dtype is not None:
            refuse(args, ["time_column", "rpm_column"], "belongs to csv lines")
        self._pulses = args.pulses_per_turn or 1
        self._tacho, self._speed_column = None, args.rpm_column
        if (speeds := args.rpm.get("speed_source")) and not self._is_folder:
            if not speeds.startswith(TACHO):
                refuse(args, ["rpm"], f"{speeds} is for a folder; use {TACHO}CHANNEL, --rpm-column")
            self._tacho = TachoStream(self._rate, self._pulses)
            self._speed_column = speeds.removeprefix(TACHO)
        source = args.source if is_stdin else str(path.resolve())
        self._facts = {name: vars(args)[name] for name in _READING}
        self._facts |= {"source": source, "model": model.identity, "sampling_rate": self._rate}
        sensor = args.sensor or (args.model if is_stdin else path).stem
        self._of_line = {"sensor": printable(sensor), "healthy": model.healthy}
        self._last = self._written = self._limits = None
        self._said = self._line_at = self._window_at = time.monotonic()
        self._unread, self.is_at_place = Counter(), True
        self._parser, self._remarks = None, []
        model.check_order(args.source, args.channel)
        with as_command_error():
            settings = {name: vars(args)[name] for name in _SETTINGS}
            settings["conditions"] = None if model.healthy is None else model.conditions
            settings |= {"detector": model.detector, "train_rpm": model.train_rpm}
            settings["window_length"] = model.window_length
            self._monitor = ConditionMonitor(model.diagnoser, self._rate, **settings)
            self._place = self._restored()
            # A file that cannot be written is reported now, not in a minute.
            self.save()
            self.blocks = self._folder(path) if self._is_folder else self._stream(path)

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
        path, self._saved = self._args.state, time.monotonic()
        if path is not None and self.is_at_place:
            save_monitor_state(self._monitor, self._args.state, place=self._place, **self._facts)

    def _folder(self, path):
        args, rows = self._args, self._model.can
        facts = {"channel": args.channel, "dtype": args.dtype, "sampling_rate": self._rate}
        facts |= {"pulses_per_turn": self._pulses} | args.rpm
        files = ListedRecording(None, "", path, **facts)
        how = args.settle, args.timed_files, self.say, self._place
        return from_folder(files, rows, *how, prepare=self._with_channel)

    def _with_channel(self, recording):
        """Return a file of a folder with its channels, and print remarks that are new."""
        own = self._model.with_channel(recording)
        self._say_of_channels(self._model.channel_remarks(own, recording.channel))
        return own

    def _stream(self, path):
        args, length = self._args, self._model.window_length
        usual = self._model.usual_channels
        if args.dtype is None:
            tolerance = args.gap_tolerance or 0.5 * length / self._rate
            times = StreamTimes(args.time_column, self._rate, tolerance, length)
            parser = TextSamples(
                args.channel, times, self._speed_column, self._model.usual_channels
            )
        else:
            usual = self._model.usual_channels
            parser = RawSamples(args.dtype, args.channel, self._speed_column, usual)
        self._unread, self._parser = parser.unread, parser
        if args.source == "-":
            if sys.stdin is None:
                raise CommandError("-: there is no standard input")
            return from_stream(lambda: nullcontext(sys.stdin.buffer.raw), parser)
        if path.is_fifo() or path.is_char_device():
            return from_stream(lambda: path.open("rb", buffering=0), parser)
        if not path.is_file():
            raise FileNotFoundError(f"{path}: no such file or folder")
        return from_growing_file(path, parser, self.say, self._place)

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
        except ValueError as error:
            raise CommandError(f"{self._args.source}: {error}") from error
        self._beat()
        return block is not None

    def _take(self, block):
        # A later run would read twice what was read behind the place.
        self.is_at_place = False
        samples, rpm = block.samples, block.rpm if self._is_folder else self._args.rpm.get("rpm")
        if samples.size:
            if self._speed_column is not None:
                samples, rpm = samples[:-1], samples[-1]
                rpm = rpm if self._tacho is None else self._tacho.speeds(rpm)
            if len(samples) != (n := self._model.n_channels):
                advice = "--channel chooses" if self._parser is None else self._parser.advice
                raise ValueError(f"{len(samples)} channels, expected {n}; {advice}")
            if self._parser is not None:
                found, facts = self._parser.channels[:n], self._model.facts
                self._say_of_channels(channel_remarks(found, facts, self._args.channel))
            verdicts = self._monitor.update(samples, time=block.time, rpm=rpm)
            self._report(verdicts, block.source)
        if block.place is not None:
            self._place, self.is_at_place = block.place, True
            if time.monotonic() - self._saved >= _SAVE_EVERY:
                self.save()

    def _say_of_channels(self, remarks):
        """Print remarks on the channels, unless they are those before."""
        if (remarks := list(remarks)) != self._remarks:
            self._remarks = remarks
            for remark in remarks:
                self.say(remark)

    def _report(self, verdicts, source):
        for verdict in verdicts:
            self._last, self._window_at = verdict, time.monotonic()
            if self._is_due(verdict):
                self._written, fields = verdict, verdict._asdict()
                fields = {"seconds": fields.pop("time")} | fields
                fields |= {} if source is None else {"source": printable(source)}
                self._print("verdict", verdict.time, fields)
            if verdict.limits not in (HOLD, self._limits):
                self._limits = verdict.limits
                self.say(f"No alarm: {self._limits}.")
        if verdicts and self._args.verbose and time.monotonic() - self._said >= 1.0:
            self._said = time.monotonic()
            self.say(sentence(verdicts[-1]))

    def _is_due(self, verdict):
        every = self._args.every
        if every is None or self._written is None or _news(verdict) != _news(self._written):
            return True
        # A clock that was set back would suppress all lines; times are sums of rounded steps.
        return not 0 <= verdict.time - self._written.time < every * (1 - 1e-9)

    def _beat(self):
        """Write a heartbeat if no line was written for so long."""
        now, heartbeat = time.monotonic(), self._args.heartbeat
        if heartbeat is None or now - self._line_at < heartbeat:
            return
        fields = {"seconds_without_window": round(now - self._window_at, 3)}
        fields["verdict"] = self._last and self._last.verdict
        fields["alarm"] = self._last and self._last.alarm
        self._print("heartbeat", None, fields)

    def _print(self, kind, seconds, fields):
        self._line_at = time.monotonic()
        line = {"kind": kind, "time": _iso_date(seconds)} | self._of_line | fields
        unknown = [n for n, v in line.items() if isinstance(v, float) and not math.isfinite(v)]
        print(json.dumps(line | dict.fromkeys(unknown), allow_nan=False), flush=True)

    def summary(self) -> str:
        """Return the counts of the run and its last verdict."""
        counts, last = self._monitor.counts, self._last
        windows = ", ".join(f"{n} {name}" for name, n in sorted(counts["windows"].items()))
        parts = [f"{counts['samples']} samples", f"windows: {windows or 'none'}"]
        parts.append(f"{counts['gaps']} gaps of {counts['missing_seconds']:.1f} s")
        further = {"clock steps back": counts["clock_steps_back"]} | self._unread
        parts += [f"{n} {what}" for what, n in further.items() if n]
        parts.append(f"{counts['alarms']} alarms")
        parts += [] if last is None else [f"last: {printable(sentence(last))}"]
        return "; ".join(parts)


def _iso_date(seconds):
    """Seconds since 1970 as ISO 8601 date in UTC; the present if they are no date."""
    is_date = seconds is not None and _DATES[0] < seconds < _DATES[1]
    moment = datetime.fromtimestamp(seconds, UTC) if is_date else datetime.now(UTC)
    return moment.isoformat(timespec="milliseconds")


def sentence(verdict: MonitorVerdict) -> str:
    """Describe a verdict.

    Examples
    --------
    >>> first = MonitorVerdict(
    ...     0, 0.5, 900.0, "good", 0.0, "worn", "worn", 0.93, True, False, 0.25, 0.003, "hold"
    ... )
    >>> sentence(first)
    '0.5 s, worn, probability 93.0%, alarm off at 25%, p-value 0.003'
    """
    probability, p_value, alarm = verdict.probability, verdict.p_value, verdict.alarm
    parts = {
        f"{verdict.time:.1f} s, {verdict.verdict or 'no verdict'}": True,
        f"probability {percent(probability)}": not math.isnan(probability),
        f"alarm {'ON' if alarm else 'off'} at {verdict.alarm_level:.0%}": alarm is not None,
        f"p-value {p_value:.2g}": not math.isnan(p_value),
        f"no signal: {verdict.quality}": verdict.quality != "good",
    }
    return ", ".join(text for text, is_known in parts.items() if is_known)
