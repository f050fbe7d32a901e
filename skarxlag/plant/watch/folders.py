"""Follow a folder into which a logger drops recordings: one verdict for each snapshot."""

import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ...monitoring.alarm import CumulativeSumAlarm
from ...verdicts.names import POSSIBLY_CHANGED
from ..commands.diagnosis import diagnose_file
from ..commands.messages import counted, refuse, say
from ..commands.models import SavedModel
from ..readers.entries import ListedRecording
from ..readers.files import recording_start
from .lines import iso_date
from .options import SensorOptions

#: Pause after a look at a folder, in durations of the look, at least.
_PAUSE = 20
#: Probability that a healthy snapshot exceeds the limits after one that did, if load or
#: speed last longer than the time between snapshots.
_PERSISTENCE = 0.5


class FolderFollower:
    """Diagnoser of the files of a folder, each once and as a whole, with an alarm.

    A file is diagnosed when its size and time have not changed for a while, whatever
    its time is. The alarm counts snapshots.

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
    monitor : CumulativeSumAlarm
        The alarm.
    cut : None
        Whole files are diagnosed, and no windows are cut.
    has_ended, is_readable : bool
        False, since a folder never ends; and True.
    """

    cut = None
    has_ended = False
    is_readable = True

    def __init__(
        self,
        options: SensorOptions,
        model: SavedModel,
        remark: Callable[[str], None],
    ) -> None:
        refuse(options, ["rpm_column"], "belongs to csv lines")
        why = "counts hours of signal; --alarm-delay counts the snapshots of a folder"
        refuse(options, ["false_alarm_interval"], why)
        self._options = options
        self._model = model
        self._remark = remark
        self._folder = Path(options.source)
        self._has_alarm = model.judge.limits.exist
        self._rate = model.judge.limits.rate if self._has_alarm else _PERSISTENCE / 2
        self.monitor = self._new_alarm(_PERSISTENCE)
        self._names: set[str] = set()
        # State of each file that was not diagnosed, and since when it is so.
        self._waiting: dict[str, tuple[Any, float]] = {}
        self._finished: list[str] = []
        self._look_at = 0.0

    def _new_alarm(self, persistence):
        # The interval between false alarms has no influence, because the delay is stated.
        delay = self._options.alarm_delay or 1
        latch = self._options.latch
        return CumulativeSumAlarm(1.0, self._rate, persistence, delay, latch)

    @property
    def is_waiting(self) -> bool:
        """Return whether a file is there that was not diagnosed yet."""
        return len(self._waiting) > 0

    @property
    def alarm_state(self) -> str:
        """State of the alarm, see `MonitorVerdict`."""
        return self.monitor.alarm_state if self._has_alarm else "none"

    @property
    def heading(self) -> str:
        """Delay of the alarm and rate of false alarms."""
        if not self._has_alarm:
            return "No alarm: the model has no healthy limits."
        n = self._options.alarm_delay or 1
        # Whether snapshots exceed by chance, each for itself, is not known.
        alarms = map(self._new_alarm, (_PERSISTENCE, self._rate))
        run_length = min(alarm.run_length() for alarm in alarms)
        return (
            f"Alarm: after {counted(n, 'consecutive snapshot')} beyond the healthy limits. "
            f"Expected false alarms: at most one in {run_length:.3g} snapshots."
        )

    def step(self) -> list[dict[str, Any]] | None:
        """Diagnose the next file that is finished: its verdict, or None if there was none."""
        start = time.monotonic()
        if not self._finished and start >= self._look_at:
            self._look(start)
            end = time.monotonic()
            self._look_at = end + _PAUSE * (end - start)
        if not self._finished:
            return None
        name = self._finished.pop()
        self._names.add(name)
        self._waiting.pop(name, None)
        return self._diagnosed(self._folder / name)

    def _look(self, moment):
        """Find the files that are finished."""
        names = {name for name in os.listdir(self._folder) if name[0] != "."}
        self._names &= names
        waiting = {}
        finished = []
        for name in names - self._names:
            path = self._folder / name
            # A folder cannot be read, and opening a pipe would wait for ever.
            if not path.is_file():
                continue
            before, since = self._waiting.get(name, (None, moment))
            status = path.stat()
            state = status.st_mtime_ns, status.st_size
            waiting[name] = state, since if state == before else moment
            if state == before and moment - since >= self._options.settle:
                finished.append((*state, name))
        self._waiting = waiting
        self._finished = [name for *_, name in sorted(finished, reverse=True)]

    def _diagnosed(self, path):
        options = self._options
        recording = ListedRecording(
            None,
            path.name,
            path,
            channel=options.channel,
            dtype=options.dtype,
            sampling_rate=options.sampling_rate or self._model.sampling_rate,
            pulses_per_revolution=options.pulses_per_revolution or 1,
            **options.rpm,
        )
        diagnosis = diagnose_file(recording, lambda: self._model)
        if diagnosis.error is not None:
            say(f"skipped: {path}: {diagnosis.error}")
            return []
        for remark in diagnosis.remarks:
            self._remark(remark)
        start = recording_start(path, channel=recording.channel, dtype=recording.dtype)
        seconds = path.stat().st_mtime if start is None else start
        head = {"time": iso_date(seconds), "seconds": seconds, "source": path.name}
        return [head | self._counted(diagnosis.verdict)]

    def _counted(self, verdict):
        """Count a snapshot, and return its fields with those of the alarm."""
        fields = {
            name.replace(" ", "_").replace("-", "_"): value
            for name, value in verdict.items()
            if not name.startswith("share of ")
        }
        exceeds = {"yes": True, "no": False}.get(fields["alarm"])
        alarm = self.monitor
        if exceeds is not None:
            alarm.add(exceeds)
        is_healthy = fields["verdict"] == self._model.healthy
        if is_healthy and alarm.alarm_state in ("on", "not yet an alarm"):
            fields |= {"verdict": POSSIBLY_CHANGED, "probability": np.nan}
        has_signal = fields["no_signal"] < fields["windows"]
        return fields | {
            "quality": "good" if has_signal else "no signal",
            "exceeds": exceeds,
            "alarm": (alarm.active or alarm.latched) if self._has_alarm else None,
            "alarm_level": alarm.level if self._has_alarm else np.nan,
            "alarm_state": self.alarm_state,
        }

    def restore(self, state: dict[str, Any], facts: dict[str, Any]) -> None:
        """Continue from a state; files whose names it has are not diagnosed again."""
        self._names = set(map(str, facts.get("names", ())))
        self.monitor.restore(state)

    def facts(self) -> dict[str, Any]:
        """Return what is saved with the state."""
        return {"names": sorted(self._names)}

    def close(self) -> None:
        """Do nothing: no file stays open."""
