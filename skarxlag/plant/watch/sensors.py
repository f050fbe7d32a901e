"""Sensors that one ``skarxlag watch`` follows, and the loop that follows them."""

import os
import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from ...monitoring.together import diagnose_together
from ...monitoring.verdict import MonitorVerdict
from ...persistence.monitor_states import load_monitor_state, save_monitor_state
from ...verdicts.windows import HOLD
from ..commands.messages import CommandError, UsageError, as_command_error, refuse, say
from ..commands.models import SavedModel
from ..readers.speeds import TACHO
from .folders import FolderFollower
from .lines import SensorLines
from .options import SensorOptions, listed_sensors
from .pipes import PipeFollower

#: Seconds between two savings of the state.
_SAVE_EVERY = 60.0
#: Seconds between two looks at sources without news.
_PAUSE = 0.2
#: Latest remarks on a sensor that are not printed again.
_MOST_REMARKS = 50


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

    Attributes
    ----------
    follower : FolderFollower, PipeFollower or None
        What reads the source; None while that is not possible.
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
        self._lines = SensorLines(name, options.heartbeat)
        self.follower: Any = None
        # Latest state, and facts about it.
        self._saved: tuple[dict[str, Any], dict[str, Any]] | None = None
        # Why the sensor is not watched, and why its state is not on disk.
        self._problem: str | None = None
        self._unsaved: str | None = None
        self._retry_at = self._save_at = 0.0
        self._remarks: deque[str] = deque(maxlen=_MOST_REMARKS)

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
        try:
            with as_command_error():
                if self.follower is None and time.monotonic() >= self._retry_at:
                    self.follower = self._started()
                if self.follower is not None:
                    verdicts = self._new_verdicts()
        except (CommandError, UsageError) as error:
            self._fail(error)
        for fields in verdicts or ():
            self._add(fields)
        if self.follower is not None:
            self._acknowledge()
            self._lines.alarm_state = self.follower.alarm_state
            is_latched = self.follower.monitor.latched
            is_due = time.monotonic() >= self._save_at
            if is_due or is_latched != self._saved[1]["latched"]:
                self._save()
        self._lines.beat(self._problem)
        return verdicts is not None

    def report(self, verdicts: Iterable[MonitorVerdict]) -> None:
        """Write the verdicts on the windows of what was new."""
        for verdict in verdicts:
            fields = verdict._asdict()
            self._add({"seconds": fields.pop("time")} | fields)

    def _add(self, fields):
        self._lines.add(fields)
        if fields["limits"] != HOLD:
            self._remark(f"No alarm: {fields['limits']}.")

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
        if self._saved is None and options.state is not None and options.state.exists():
            self._saved = load_monitor_state(options.state)
        if self._saved is not None:
            self._restore(follower)
        self._lines.begin(model)
        self._remark(model.heading)
        self._remark(follower.heading)
        return follower

    def _restore(self, follower):
        state, facts = self._saved
        if facts.get("source") != self._options.source:
            raise CommandError(
                f"{self._options.state}: a state of {facts.get('source')}, expected "
                f"{self._options.source}; name another --state or delete it"
            )
        is_of_model = facts.get("model") == self._facts["model"]
        try:
            follower.restore(state if is_of_model else {}, facts)
        except (ValueError, KeyError) as error:
            reason = error if is_of_model else "the state is of another model"
            self._say(f"Verdicts and the alarm start afresh: {reason}")
            # Somebody has to acknowledge the alarm, whatever the model is.
            follower.monitor.latched = self._options.latch and facts.get("latched")

    def _new_verdicts(self):
        """Return the fields of new verdicts, or None if nothing new has come."""
        follower = self.follower
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
        self._close()
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
        if self.follower.monitor.latched:
            self.follower.monitor.latched = False
            self._lines.alarm_state = self.follower.alarm_state
            self._lines.write("acknowledged")
            self._say(f"The alarm was acknowledged, and is {self._lines.alarm_state}.")
        note.unlink()

    def _save(self):
        """Save the state. If it cannot be written, verdicts go on, and it is tried again."""
        self._save_at = time.monotonic() + _SAVE_EVERY
        monitor = self.follower.monitor
        facts = self._facts | self.follower.facts()
        facts |= {"saved": time.time(), "latched": monitor.latched}
        self._saved = monitor.state(), facts
        if self._options.state is None:
            return
        try:
            save_monitor_state(monitor, self._options.state, **facts)
            self._unsaved = None
        except OSError as error:
            self._unsaved = str(error)
            self._remark(f"error: the state is not saved, tried every minute: {error}")

    def _close(self):
        """Save the state, and close the source."""
        if self.follower is not None:
            self._save()
            self.follower.close()
            self.follower = None

    def finish(self) -> bool:
        """Save the state, print the summary, and return whether a problem remains."""
        self._close()
        self._say(f"last: {self._lines.verdict}; alarm: {self._lines.alarm_state}")
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
    news_at = None
    try:
        # The first pass loads the models.
        while not signals:
            is_news = any([sensor.step() for sensor in sensors])
            followed = [one for one in sensors if one.follower is not None]
            # Windows of several sensors are diagnosed together, which takes a ninth.
            cut = [one for one in followed if one.follower.cut is not None]
            verdicts = diagnose_together([one.follower.cut for one in cut])
            for sensor, of_sensor in zip(cut, verdicts, strict=True):
                sensor.report(of_sensor)
            if is_alone and sensors[0].follower.has_ended:
                break
            now = time.monotonic()
            is_waiting = any(one.follower.is_waiting for one in followed)
            if is_news or is_waiting or news_at is None:
                news_at = now
            if options.idle is not None and now - news_at >= options.idle:
                break
            if not is_news:
                time.sleep(_PAUSE)
    finally:
        problems = [sensor.finish() for sensor in sensors]
    return any(problems)
