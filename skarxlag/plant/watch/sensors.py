"""Sensors that one ``skarxlag watch`` follows, and the loop that follows them."""

import argparse
import os
import threading
import time
from collections import Counter
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from ...monitoring.monitor import diagnose_together
from ...persistence.monitor_states import load_monitor_state, save_monitor_state
from ...verdicts.windows import HOLD
from ..commands.arguments import refuse
from ..commands.messages import (
    CommandError,
    UsageError,
    as_command_error,
    printable,
    say,
)
from ..commands.models import SavedModel
from ..readers.recording_tables import channel_names, read_rows, speed_facts
from ..readers.speeds import TACHO
from .folders import FolderFollower
from .lines import SensorLines, sentence
from .pipes import PipeFollower

#: Seconds between two savings of the state.
_SAVE_EVERY = 60.0
#: Arguments on which the meaning of a state depends.
_READING = ("channel", "dtype", "time_column", "rpm_column", "pulses_per_revolution")
_NEEDED = ("name", "source", "model")
_FURTHER = ("channel", "rpm")


def listed_sensors(args: argparse.Namespace) -> list[argparse.Namespace]:
    """Return the arguments of each sensor: those of the command and of its line of the table.

    Raises
    ------
    CommandError
        If the table cannot be read, or a line cannot be used.
    UsageError
        If an option is given that a column of the table replaces.
    """
    path = args.model
    with as_command_error():
        columns, rows = read_rows(path, "name")
        if not {*_NEEDED} <= {*columns} <= {*_NEEDED, *_FURTHER} or not rows:
            raise CommandError(
                f"{path}: {len(rows)} sensors with the columns {', '.join(columns)}; "
                f"expected {', '.join(_NEEDED)}, and if needed {', '.join(_FURTHER)}"
            )
        refuse(args, ["sensor"], f"{path} has a column name")
        if "rpm" in columns:
            refuse(args, ["rpm_column"], f"{path} has a column rpm")
        table = {
            f"{path}, line {number}": dict(zip(columns, cells, strict=True))
            for number, cells in rows.items()
        }
        names = Counter(row["name"] for row in table.values())
        return [_of_line(args, where, row, names) for where, row in table.items()]


def _of_line(args, where, row, names):
    name = row["name"]
    if not name or Path(name).name != name or names[name] > 1:
        raise CommandError(
            f"{where}: name {name!r}, expected a unique name without slashes"
        )
    for column in ("source", "model"):
        if row[column] in ("", "-"):
            raise CommandError(f"{where}: {column} {row[column]!r}, expected a file")
    sensor = argparse.Namespace(**vars(args))
    folder = args.model.parent
    sensor.sensor = name
    sensor.model = folder / row["model"]
    sensor.source = str(folder / row["source"])
    sensor.state = sensor.state and sensor.state / f"{name}.json"
    if row.get("channel"):
        sensor.channel = channel_names(row["channel"])
    if row.get("rpm"):
        sensor.rpm = speed_facts(where, row["rpm"])
    return sensor


def acknowledgement(state: Path) -> Path:
    """Return the file next to a state that asks a running `watch` to acknowledge an alarm."""
    return state.with_name(f"{state.name}.acknowledge")


def is_latched(state: dict[str, Any]) -> bool:
    """Return whether the alarm in a state is latched."""
    alarm = state.get("alarm", state)
    return isinstance(alarm, dict) and alarm.get("latched") is True


class Sensor:
    """Sensor that is watched, or will be as soon as its source and its model permit it.

    Parameters
    ----------
    args : argparse.Namespace
        Arguments of the command for the sensor.
    news : Event
        Set if the loop need not wait.
    load : callable
        Returns the model in a file.
    is_alone : bool
        Whether an error ends the command. Otherwise the sensor is tried again.

    Attributes
    ----------
    follower : PipeFollower, FolderFollower or None
        What reads the source; None while that is not possible.
    problem : str or None
        Why the sensor is not watched.
    unsaved : str or None
        Why its state is not saved.
    """

    def __init__(
        self,
        args: argparse.Namespace,
        news: threading.Event,
        load: Callable[[Path], SavedModel],
        is_alone: bool,
    ) -> None:
        self._args = args
        self._load = load
        self._news = news
        self._is_alone = is_alone
        path = args.model if args.source == "-" else args.source
        # The path of a folder may be a dot.
        self._lines = SensorLines(args, args.sensor or Path(os.path.abspath(path)).stem)
        self.follower: Any = None
        self.problem: str | None = None
        self.unsaved: str | None = None
        self._memory: tuple[dict[str, Any], dict[str, Any]] | None = None
        self._model: SavedModel | None = None
        self._retry_at = self._save_at = self._status_at = 0.0
        self._is_saved_latched = self._is_announced = False
        self._limits = HOLD

    def say(self, text: str) -> None:
        """Print a line to standard error, after the name of the sensor if the user stated one."""
        say(text if self._args.sensor is None else f"{self._args.sensor}: {text}")

    def _start(self):
        args = self._args
        self._model = model = self._load(args.model)
        model.check_order(args.source, args.channel)
        path = Path(args.source)
        if args.source != "-" and not path.exists():
            raise CommandError(f"{path}: no such file or folder")
        if path.is_dir():
            follower = FolderFollower(args, model, self.say, self._add)
        elif path.is_file():
            raise CommandError(
                f"{path} is a file; tail -n +1 -F {path} | skarxlag watch {args.model} -"
            )
        else:
            follower = PipeFollower(args, model, self.say, self._news)
        self._restore(follower)
        self._lines.begin(model)
        self.follower = follower
        if not self._is_announced:
            self._is_announced = True
            self.say(model.heading)
            self.say(follower.alarm() or "No alarm: the model has no healthy limits.")

    def _restore(self, follower):
        path = self._args.state
        if self._memory is None and (path is None or not path.exists()):
            return
        state, facts = self._memory or load_monitor_state(path)
        for name, value in self._facts().items():
            if name not in ("model", "saved") and facts.get(name, value) != value:
                raise CommandError(
                    f"{path}: a state of {name.replace('_', ' ')} {facts[name]!r}, "
                    f"expected {value!r}; name another --state or delete it"
                )
        difference = ""
        if facts.get("model", self._model.identity) != self._model.identity:
            difference = f"the state is of model {facts['model'][:12]}"
        try:
            pause = max(time.time() - facts.get("saved", time.time()), 0.0)
            follower.restore({} if difference else state, facts, pause)
        except (ValueError, KeyError) as error:
            self.say(f"Verdicts and the alarm start afresh: {difference or error}")
            # Somebody has to acknowledge the alarm, whatever the model is.
            follower.monitor.latched = self._args.latch and is_latched(state)

    def _facts(self):
        source = self._args.source
        return {name: getattr(self._args, name) for name in _READING} | {
            "source": source if source == "-" else os.path.realpath(source),
            "model": self._model.identity,
            "saved": time.time(),
        }

    def step(self) -> bool:
        """Take what is new, and return whether there was something."""
        is_news = False
        now = time.monotonic()
        try:
            with as_command_error():
                if self.follower is None and now >= self._retry_at:
                    self._start()
                if self.follower is not None:
                    if self.follower.has_ended:
                        raise CommandError(f"{self._args.source}: the pipe has ended")
                    self._acknowledge()
                    is_news = self.follower.step()
                    self._note_success()
        except (CommandError, UsageError) as error:
            self.fail(error)
        latched = self.follower is not None and self.follower.monitor.latched
        if now >= self._save_at or latched != self._is_saved_latched:
            self.save()
        state = "none" if self.follower is None else self.follower.alarm_state
        self._lines.beat(state, self.problem)
        return is_news

    def next_cut(self) -> Any:
        """Return the windows of the next part of what is new; None if there is none."""
        try:
            with as_command_error():
                return self.follower and self.follower.next_cut()
        except CommandError as error:
            self.fail(CommandError(f"{self._args.source}: {error}"))
        return None

    def report(self, verdicts: Any) -> None:
        """Write the verdicts on the windows of a part."""
        self._note_success()
        for verdict in verdicts:
            fields = verdict._asdict()
            self._add({"seconds": fields.pop("time")} | fields)

    def _add(self, fields):
        self._lines.add(fields)
        if fields["limits"] not in (HOLD, self._limits):
            self._limits = fields["limits"]
            self.say(f"No alarm: {self._limits}.")
        now = time.monotonic()
        if self._args.verbose and now >= self._status_at:
            self._status_at = now + 1.0
            self.say(sentence(fields))

    def fail(self, error: Exception) -> None:
        """Stop to watch until the next attempt; print a problem when it begins."""
        if self._is_alone:
            raise error
        if self.follower is not None:
            facts = self._facts() | self.follower.facts()
            self._memory = self.follower.monitor.state(), facts
            self.save()
            self.follower.close()
            self.follower = None
        self._retry_at = time.monotonic() + self._args.retry
        if str(error) != self.problem:
            self.problem = str(error)
            self.say(f"error: {error}; tried again every {self._args.retry:g} s")

    def _note_success(self):
        """Print that a problem is over. A pipe may still hold what cannot be read."""
        if self.problem is not None and self.follower.is_readable:
            self.problem = None
            self.say("watched again")

    def _acknowledge(self):
        """Acknowledge a latched alarm if the file next to the state asks for it."""
        if not self._args.latch or not acknowledgement(self._args.state).exists():
            return
        if self.follower.monitor.latched:
            self.follower.monitor.latched = False
            state = self.follower.alarm_state
            self._lines.acknowledged(state)
            self.say(f"The alarm was acknowledged, and is {state}.")
        acknowledgement(self._args.state).unlink()

    def save(self) -> None:
        """Save the state. If it cannot be written, verdicts go on, and it is tried again."""
        self._save_at = time.monotonic() + _SAVE_EVERY
        path = self._args.state
        if path is None or self.follower is None:
            return
        self._is_saved_latched = self.follower.monitor.latched
        try:
            facts = self._facts() | self.follower.facts()
            save_monitor_state(self.follower.monitor, path, **facts)
        except OSError as error:
            if self.unsaved is None:
                self.say(f"error: the state is not saved, tried every minute: {error}")
            self.unsaved = str(error)
        else:
            if self.unsaved is not None:
                self.say("the state is saved again")
            self.unsaved = None

    def finish(self) -> bool:
        """Save the state, print the summary, and return whether a problem remains."""
        self.save()
        if self.follower is not None:
            self.follower.close()
            last = self._lines.last
            about = "" if last is None else f"; last: {printable(sentence(last))}"
            self.say(self.follower.summary() + about)
        return self.problem is not None or self.unsaved is not None


def follow(args: argparse.Namespace, signals: list[Any], news: threading.Event) -> bool:
    """Follow one sensor, or those of a table, until the end.

    The end is that of the only source, a signal, or that nothing new has come for long.

    Parameters
    ----------
    args : argparse.Namespace
        Arguments of the command. Without a source, its model is a table.
    signals : list
        Signals so far; any of them ends the command.
    news : Event
        Set if the loop need not wait.

    Returns
    -------
    bool
        Whether a problem remains.
    """
    is_alone = args.source is not None
    listed = [args] if is_alone else listed_sensors(args)
    if not any("speed_source" in one.rpm for one in listed):
        refuse(args, ["pulses_per_revolution"], f"belongs to --rpm {TACHO}CHANNEL")
    # Each model is loaded once.
    load = cache(SavedModel)
    sensors = [Sensor(one, news, load, is_alone) for one in listed]
    try:
        # The first pass loads the models.
        since = None
        while not signals:
            is_news = any([sensor.step() for sensor in sensors])
            _diagnose(sensors)
            if is_alone and sensors[0].follower.has_ended:
                break
            if is_news or since is None:
                since = time.monotonic()
            elif args.idle is not None and time.monotonic() - since >= args.idle:
                break
            news.wait(args.poll)
            news.clear()
    finally:
        problems = [sensor.finish() for sensor in sensors]
    return any(problems)


def _diagnose(sensors):
    """Diagnose what is new, windows of several sensors together."""
    while True:
        cuts = [(sensor, sensor.next_cut()) for sensor in sensors]
        cuts = [(sensor, cut) for sensor, cut in cuts if cut is not None]
        if not cuts:
            return
        verdicts = diagnose_together([cut for _, cut in cuts])
        for (sensor, _), of_sensor in zip(cuts, verdicts, strict=True):
            sensor.report(of_sensor)
