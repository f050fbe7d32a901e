"""Sensors that one ``skarxlag watch`` follows, and the loop that follows them."""

import math
import os
import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from ...monitoring.together import CutBlock, diagnose_together
from ...monitoring.verdict import MonitorVerdict
from ...persistence.monitor_states import load_monitor_state, save_monitor_state
from ...verdicts.windows import HOLD
from ..commands.messages import CommandError, UsageError, as_command_error, refuse, say
from ..commands.models import SavedModel
from ..readers.recording_tables import channel_names, read_cells, speed_facts
from ..readers.speeds import TACHO
from .folders import FolderFollower
from .lines import SensorLines
from .options import SensorOptions
from .pipes import PipeFollower

#: Seconds between two savings of the state.
_SAVE_EVERY = 60.0
#: Seconds between two looks at sources without news.
_PAUSE = 0.2
#: Latest remarks on a sensor that are not printed again.
_MOST_REMARKS = 50
_NEEDED = ("name", "source", "model")
_FURTHER = ("channel", "rpm")


def listed_sensors(options: SensorOptions) -> list[SensorOptions]:
    """Return the options of each sensor of a table: those of the command and of its line.

    Raises
    ------
    CommandError
        If the table cannot be read, or a line cannot be used.
    UsageError
        If an option is given that a column of the table replaces.
    """
    path = options.model
    with as_command_error():
        columns, rows = read_cells(path, "name")
        if not {*_NEEDED} <= {*columns} <= {*_NEEDED, *_FURTHER} or not rows:
            raise CommandError(
                f"{path}: {len(rows)} sensors with the columns {', '.join(columns)}; "
                f"expected {', '.join(_NEEDED)}, and if needed {', '.join(_FURTHER)}"
            )
        if "rpm" in columns:
            refuse(options, ["rpm_column"], f"{path} has a column rpm")
        sensors: dict[str, SensorOptions] = {}
        for number, cells in rows.items():
            row = dict(zip(columns, cells, strict=True))
            name = row["name"]
            if name in sensors:
                raise CommandError(f"{path}: two sensors of the name {name!r}")
            sensors[name] = _of_line(options, f"{path}, line {number}", row)
        return [*sensors.values()]


def _of_line(options, where, row):
    name = row["name"]
    if Path(name).name != name or not all(row[column] for column in _NEEDED):
        raise CommandError(
            f"{where}: {row}, expected a name without slashes, a source and a model"
        )
    folder = options.model.parent
    changes = {"name": name, "model": folder / row["model"]}
    changes["source"] = str(folder / row["source"])
    if options.state is not None:
        changes["state"] = options.state / f"{name}.json"
    if row.get("channel"):
        changes["channel"] = channel_names(row["channel"])
    if row.get("rpm"):
        changes["rpm"] = speed_facts(where, row["rpm"])
    return replace(options, **changes)


def acknowledgement(state: Path) -> Path:
    """Return the file next to a state that asks a running `watch` to acknowledge an alarm."""
    return state.with_name(f"{state.name}.acknowledge")


class Sensor:
    """Sensor that is watched, or will be as soon as its source and its model permit it.

    Parameters
    ----------
    options : SensorOptions
        Options of the sensor.
    load : callable
        Returns the model in a file.
    is_alone : bool
        Whether an error ends the command. Otherwise the sensor is tried again.
    """

    def __init__(
        self,
        options: SensorOptions,
        load: Callable[[Path], SavedModel],
        is_alone: bool,
    ) -> None:
        self._options = options
        self._load = load
        self._is_alone = is_alone
        path = options.model if options.source == "-" else options.source
        # The path of a folder may be a dot.
        name = options.name or Path(os.path.abspath(path)).stem
        self._lines = SensorLines(name, options.every)
        # What reads the source; None until that is possible.
        self._follower: Any = None
        # Why the sensor is not watched, and why its state is not saved.
        self._problem: str | None = None
        self._unsaved: str | None = None
        self._is_open = self._is_saved_latched = False
        self._retry_at = self._save_at = 0.0
        self._remarks: deque[str] = deque(maxlen=_MOST_REMARKS)

    @property
    def has_ended(self) -> bool:
        """Whether the source has ended."""
        return self._follower.has_ended

    def _say(self, text):
        """Print a line to standard error, after the name of a sensor of a table."""
        say(text if self._is_alone else f"{self._options.name}: {text}")

    def _remark(self, text):
        if text and text not in self._remarks:
            self._remarks.append(text)
            self._say(text)

    def step(self) -> bool:
        """Take what is new, and return whether there was something."""
        verdicts = None
        now = time.monotonic()
        try:
            with as_command_error():
                if not self._is_open and now >= self._retry_at:
                    self._open()
                if self._is_open:
                    verdicts = self._new_verdicts()
        except (CommandError, UsageError) as error:
            self._fail(error)
        for fields in verdicts or ():
            self._add(fields)
        if self._is_open:
            self._acknowledge()
            latched = self._follower.monitor.latched
            if now >= self._save_at or latched != self._is_saved_latched:
                self._save()
        state = self._follower.alarm_state if self._follower else "none"
        self._lines.beat(state, self._problem)
        return verdicts is not None

    @property
    def is_waiting(self) -> bool:
        """Whether something has come that is not finished yet."""
        return self._is_open and self._follower.is_waiting

    @property
    def cut(self) -> CutBlock | None:
        """Windows of what was new; None if there are none."""
        return self._follower.cut if self._is_open else None

    def report(self, verdicts: Iterable[MonitorVerdict]) -> None:
        """Write the verdicts on the windows of what was new."""
        for verdict in verdicts:
            fields = verdict._asdict()
            self._add({"seconds": fields.pop("time")} | fields)

    def _add(self, fields):
        self._lines.add(fields)
        if fields["limits"] != HOLD:
            self._remark(f"No alarm: {fields['limits']}.")

    def _open(self):
        if self._follower is None:
            self._follower = self._started()
        self._follower.open()
        self._is_open = True

    def _started(self):
        """Return a follower of the source that continues from the state."""
        options = self._options
        model = self._load(options.model)
        model.check_order(options.source, options.channel)
        path = Path(options.source)
        if options.source != "-" and not path.exists():
            raise CommandError(f"{path}: no such file or folder")
        if path.is_file():
            raise CommandError(
                f"{path} is a file; tail -n +1 -F {path} | skarxlag watch "
                f"{options.model} -"
            )
        kind = FolderFollower if path.is_dir() else PipeFollower
        follower = kind(options, model, self._remark)
        self._facts = {"source": options.source, "model": model.identity}
        if options.state is not None and options.state.exists():
            self._restore(follower)
        self._lines.begin(model)
        self._say(model.heading)
        self._say(follower.alarm() or "No alarm: the model has no healthy limits.")
        if model.error_rates is not None:
            self._say(model.error_rates.missed(model.rows))
        return follower

    def _restore(self, follower):
        path = self._options.state
        state, facts = load_monitor_state(path)
        source = self._options.source
        if facts.get("source", source) != source:
            raise CommandError(
                f"{path}: a state of {facts['source']}, expected {source}; name another "
                "--state or delete it"
            )
        is_of_model = facts.get("model") == self._facts["model"]
        pause = max(time.time() - facts.get("saved", math.inf), 0.0)
        try:
            follower.restore(state if is_of_model else {}, facts, pause)
        except (ValueError, KeyError) as error:
            reason = error if is_of_model else "the state is of another model"
            self._say(f"Verdicts and the alarm start afresh: {reason}")
            # Somebody has to acknowledge the alarm, whatever the model is.
            follower.monitor.latched = self._options.latch and facts.get("latched")

    def _new_verdicts(self):
        """Return the fields of new verdicts, or None if nothing new has come."""
        follower = self._follower
        if follower.has_ended:
            raise CommandError(f"{self._options.source}: the pipe has ended")
        verdicts = follower.step()
        if self._problem is not None and follower.is_readable:
            self._problem = None
            self._say("watched again")
        return verdicts

    def _fail(self, error):
        """Stop to watch until the next attempt; print a problem when it begins."""
        if self._is_alone:
            raise error
        if self._is_open:
            self._save()
            self._follower.close()
            self._is_open = self._is_saved_latched = False
        self._retry_at = time.monotonic() + self._options.retry
        if str(error) != self._problem:
            self._problem = str(error)
            self._say(f"error: {error}; tried again every {self._options.retry:g} s")

    def _acknowledge(self):
        """Acknowledge a latched alarm if the file next to the state asks for it."""
        if not self._options.latch:
            return
        note = acknowledgement(self._options.state)
        if not note.exists():
            return
        if self._follower.monitor.latched:
            self._follower.monitor.latched = False
            state = self._follower.alarm_state
            self._lines.write("acknowledged", state)
            self._say(f"The alarm was acknowledged, and is {state}.")
        note.unlink()

    def _save(self):
        """Save the state. If it cannot be written, verdicts go on, and it is tried again."""
        self._save_at = time.monotonic() + _SAVE_EVERY
        path = self._options.state
        if path is None:
            return
        monitor = self._follower.monitor
        self._is_saved_latched = monitor.latched
        facts = self._facts | self._follower.facts()
        facts |= {"saved": time.time(), "latched": monitor.latched}
        was_unsaved = self._unsaved is not None
        try:
            save_monitor_state(monitor, path, **facts)
            self._unsaved = None
        except OSError as error:
            self._unsaved = str(error)
        if self._unsaved and not was_unsaved:
            self._say(
                f"error: the state is not saved, tried every minute: {self._unsaved}"
            )
        elif was_unsaved and not self._unsaved:
            self._say("the state is saved again")

    def finish(self) -> bool:
        """Save the state, print the summary, and return whether a problem remains."""
        if self._is_open:
            self._save()
            self._follower.close()
        if self._follower is not None:
            self._say(self._follower.summary() + self._lines.summary())
        return self._problem is not None or self._unsaved is not None


def follow(options: SensorOptions, signals: Sequence[Any] = ()) -> bool:
    """Follow one sensor, or those of a table, until the end.

    The end is that of the only source, a signal, or that nothing new has come for long.

    Parameters
    ----------
    options : SensorOptions
        Options of the command. Without a source, its model is a table.
    signals : sequence, default=()
        Signals so far; any of them ends the command.

    Returns
    -------
    bool
        Whether a problem remains.
    """
    is_alone = options.source is not None
    listed = [options] if is_alone else listed_sensors(options)
    if not any("speed_source" in one.rpm for one in listed):
        refuse(options, ["pulses_per_revolution"], f"belongs to --rpm {TACHO}CHANNEL")
    # Each model is loaded once.
    load = cache(SavedModel)
    sensors = [Sensor(one, load, is_alone) for one in listed]
    try:
        # The first pass loads the models.
        since = None
        while not signals:
            is_news = any([sensor.step() for sensor in sensors])
            # Windows of several sensors are diagnosed together, which takes a ninth.
            cut = [sensor for sensor in sensors if sensor.cut is not None]
            verdicts = diagnose_together([sensor.cut for sensor in cut])
            for sensor, of_sensor in zip(cut, verdicts, strict=True):
                sensor.report(of_sensor)
            if is_alone and sensors[0].has_ended:
                break
            now = time.monotonic()
            if is_news or since is None or any(one.is_waiting for one in sensors):
                since = now
            if options.idle is not None and now - since >= options.idle:
                break
            if not is_news:
                time.sleep(_PAUSE)
    finally:
        problems = [sensor.finish() for sensor in sensors]
    return any(problems)
