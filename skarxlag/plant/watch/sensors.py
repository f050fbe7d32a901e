"""Sensors that one ``skarxlag watch`` follows, and the loop that follows them."""

import argparse
import math
import os
import time
from collections import deque
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from ...monitoring.together import diagnose_together
from ...persistence.monitor_states import load_monitor_state, save_monitor_state
from ...verdicts.windows import HOLD
from ..commands.arguments import refuse
from ..commands.messages import (
    CommandError,
    UsageError,
    as_command_error,
    say,
)
from ..commands.models import SavedModel
from ..readers.recording_tables import channel_names, read_rows, speed_facts
from ..readers.speeds import TACHO
from .folders import FolderFollower
from .lines import SensorLines
from .pipes import PipeFollower

#: Seconds between two savings of the state.
_SAVE_EVERY = 60.0
#: Seconds between two looks at sources without news.
_PAUSE = 0.2
#: Latest remarks on a sensor that are not printed again.
_MOST_REMARKS = 50
#: Arguments on which the meaning of a state depends.
_READING = ("source", "channel", "dtype", "rpm_column")
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
        sensors = {}
        for number, cells in rows.items():
            row = dict(zip(columns, cells, strict=True))
            sensor = _of_line(args, f"{path}, line {number}", row)
            if sensors.setdefault(sensor.sensor, sensor) is not sensor:
                raise CommandError(f"{path}: two sensors of the name {sensor.sensor!r}")
        return [*sensors.values()]


def _of_line(args, where, row):
    name = row["name"]
    if Path(name).name != name or not all(row[column] for column in _NEEDED):
        raise CommandError(
            f"{where}: {row}, expected a name without slashes, a source and a model"
        )
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
    load : callable
        Returns the model in a file.
    is_alone : bool
        Whether an error ends the command. Otherwise the sensor is tried again.

    Attributes
    ----------
    follower : PipeFollower, FolderFollower or None
        What reads the source; None until that is possible.
    problem : str or None
        Why the sensor is not watched.
    unsaved : str or None
        Why its state is not saved.
    """

    def __init__(
        self,
        args: argparse.Namespace,
        load: Callable[[Path], SavedModel],
        is_alone: bool,
    ) -> None:
        self._args = args
        self._load = load
        self._is_alone = is_alone
        path = args.model if args.source == "-" else args.source
        # The path of a folder may be a dot.
        name = args.sensor or Path(os.path.abspath(path)).stem
        self._lines = SensorLines(name, args.every)
        self.follower: Any = None
        self.problem: str | None = None
        self.unsaved: str | None = None
        self._is_open = self._is_saved_latched = False
        self._retry_at = self._save_at = 0.0
        self._remarks: deque[str] = deque(maxlen=_MOST_REMARKS)

    def _say(self, text):
        """Print a line to standard error, after the name of the sensor if the user stated one."""
        say(text if self._args.sensor is None else f"{self._args.sensor}: {text}")

    def _remark(self, text):
        if text and text not in self._remarks:
            self._remarks.append(text)
            self._say(text)

    def _start(self):
        args = self._args
        model = self._load(args.model)
        model.check_order(args.source, args.channel)
        path = Path(args.source)
        if args.source != "-" and not path.exists():
            raise CommandError(f"{path}: no such file or folder")
        if path.is_file():
            raise CommandError(
                f"{path} is a file; tail -n +1 -F {path} | skarxlag watch {args.model} -"
            )
        if path.is_dir():
            follower = FolderFollower(args, model, self._remark, self._add)
        else:
            follower = PipeFollower(args, model, self._remark)
        reading = {name: str(getattr(args, name)) for name in _READING}
        self._facts = {"reading": reading, "model": model.identity}
        if args.state is not None and args.state.exists():
            self._restore(follower, model)
        self._lines.begin(model)
        self._say(model.heading)
        self._say(follower.alarm() or "No alarm: the model has no healthy limits.")
        if model.error_rates is not None:
            self._say(model.error_rates.missed(model.rows))
        self.follower = follower

    def _restore(self, follower, model):
        path = self._args.state
        state, facts = load_monitor_state(path)
        reading = self._facts["reading"]
        if facts.get("reading", reading) != reading:
            raise CommandError(
                f"{path}: a state of {facts['reading']}, expected {reading}; name another "
                "--state or delete it"
            )
        is_of_model = facts.get("model") == model.identity
        pause = max(time.time() - facts.get("saved", math.inf), 0.0)
        try:
            follower.restore(state if is_of_model else {}, facts, pause)
        except (ValueError, KeyError) as error:
            reason = error if is_of_model else "the state is of another model"
            self._say(f"Verdicts and the alarm start afresh: {reason}")
            # Somebody has to acknowledge the alarm, whatever the model is.
            follower.monitor.latched = self._args.latch and is_latched(state)

    def step(self) -> bool:
        """Take what is new, and return whether there was something."""
        is_news = False
        now = time.monotonic()
        try:
            with as_command_error():
                if not self._is_open and now >= self._retry_at:
                    if self.follower is None:
                        self._start()
                    self.follower.open()
                    self._is_open = True
                if self._is_open:
                    if self.follower.has_ended:
                        raise CommandError(f"{self._args.source}: the pipe has ended")
                    self._acknowledge()
                    is_news = self.follower.step()
                    if self.problem is not None and self.follower.is_readable:
                        self.problem = None
                        self._say("watched again")
        except (CommandError, UsageError) as error:
            self._fail(error)
        if self._is_open:
            latched = self.follower.monitor.latched
            if now >= self._save_at or latched != self._is_saved_latched:
                self._save()
        state = self.follower.alarm_state if self.follower else "none"
        self._lines.beat(state, self.problem)
        return is_news

    def report(self, verdicts: Any) -> None:
        """Write the verdicts on the windows of what was new."""
        for verdict in verdicts:
            fields = verdict._asdict()
            self._add({"seconds": fields.pop("time")} | fields)

    @property
    def cut(self) -> Any:
        """Windows of what was new; None if there are none."""
        return self.follower.cut if self._is_open else None

    def _add(self, fields):
        self._lines.add(fields)
        if fields["limits"] != HOLD:
            self._remark(f"No alarm: {fields['limits']}.")

    def _fail(self, error):
        """Stop to watch until the next attempt; print a problem when it begins."""
        if self._is_alone:
            raise error
        if self._is_open:
            self._save()
            self.follower.close()
            self._is_open = False
        self._retry_at = time.monotonic() + self._args.retry
        if str(error) != self.problem:
            self.problem = str(error)
            self._say(f"error: {error}; tried again every {self._args.retry:g} s")

    def _acknowledge(self):
        """Acknowledge a latched alarm if the file next to the state asks for it."""
        if not self._args.latch or not acknowledgement(self._args.state).exists():
            return
        if self.follower.monitor.latched:
            self.follower.monitor.latched = False
            state = self.follower.alarm_state
            self._lines.write("acknowledged", state)
            self._say(f"The alarm was acknowledged, and is {state}.")
        acknowledgement(self._args.state).unlink()

    def _save(self):
        """Save the state. If it cannot be written, verdicts go on, and it is tried again."""
        self._save_at = time.monotonic() + _SAVE_EVERY
        self._is_saved_latched = self.follower.monitor.latched
        path = self._args.state
        if path is None:
            return
        facts = self._facts | self.follower.facts() | {"saved": time.time()}
        try:
            save_monitor_state(self.follower.monitor, path, **facts)
        except OSError as error:
            if self.unsaved is None:
                self._say(f"error: the state is not saved, tried every minute: {error}")
            self.unsaved = str(error)
        else:
            if self.unsaved is not None:
                self._say("the state is saved again")
            self.unsaved = None

    def finish(self) -> bool:
        """Save the state, print the summary, and return whether a problem remains."""
        if self._is_open:
            self._save()
            self.follower.close()
        if self.follower is not None:
            self._say(self.follower.summary() + self._lines.summary())
        return self.problem is not None or self.unsaved is not None


def follow(args: argparse.Namespace, signals: list[Any]) -> bool:
    """Follow one sensor, or those of a table, until the end.

    The end is that of the only source, a signal, or that nothing new has come for long.

    Parameters
    ----------
    args : argparse.Namespace
        Arguments of the command. Without a source, its model is a table.
    signals : list
        Signals so far; any of them ends the command.

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
    sensors = [Sensor(one, load, is_alone) for one in listed]
    try:
        # The first pass loads the models.
        since = None
        while not signals:
            is_news = any([sensor.step() for sensor in sensors])
            # Windows of several sensors are diagnosed together, which takes a tenth.
            cut = [sensor for sensor in sensors if sensor.cut is not None]
            verdicts = diagnose_together([sensor.cut for sensor in cut])
            for sensor, of_sensor in zip(cut, verdicts, strict=True):
                sensor.report(of_sensor)
            if is_alone and sensors[0].follower.has_ended:
                break
            if is_news or since is None:
                since = time.monotonic()
                continue
            if args.idle is not None and time.monotonic() - since >= args.idle:
                break
            time.sleep(_PAUSE)
    finally:
        problems = [sensor.finish() for sensor in sensors]
    return any(problems)
