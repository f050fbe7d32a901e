"""Follow a folder into which a logger drops recordings: one verdict for each snapshot."""

import argparse
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ...monitoring.alarm import CumulativeSumAlarm
from ...verdicts.names import POSSIBLY_CHANGED
from ..commands.arguments import refuse
from ..commands.diagnosis import Diagnosis, diagnose_file
from ..commands.messages import counted, say
from ..commands.models import SavedModel
from ..readers.entries import ListedRecording
from ..readers.files import recording_start

#: Names of files that count as diagnosed, although the files may be gone.
_MOST_NAMES = 100_000
#: Pause after a look at a folder, in durations of the look, at least.
_PAUSE = 20
#: Probability that a healthy snapshot exceeds the limits after one that did, if load or
#: speed last longer than the time between snapshots.
_PERSISTENCE = 0.5
_HOURS_A_YEAR = 8766


class FolderFollower:
    """Diagnoser of the files of a folder, each once and as a whole, with an alarm.

    A file is diagnosed when its size and time have not changed for a while, whatever
    its time is. The alarm counts snapshots.

    Parameters
    ----------
    args : argparse.Namespace
        Arguments of the command for the sensor.
    model : SavedModel
        The model.
    remark : callable
        Prints a line about the sensor, once.
    add : callable
        Called with the fields of the line of each snapshot.

    Attributes
    ----------
    monitor : CumulativeSumAlarm
        The alarm.
    cut : None
        Whole files are diagnosed, and no blocks are cut.
    has_ended, is_readable : bool
        False, since a folder never ends; and True.
    """

    cut = None
    has_ended = False
    is_readable = True

    def __init__(
        self,
        args: argparse.Namespace,
        model: SavedModel,
        remark: Callable[[str], None],
        add: Callable[[dict[str, Any]], None],
    ) -> None:
        refuse(args, ["rpm_column"], "belongs to csv lines")
        why = "counts hours of signal; --alarm-delay counts the snapshots of a folder"
        refuse(args, ["false_alarm_interval"], why)
        self._args = args
        self._model = model
        self._remark = remark
        self._add = add
        self._folder = Path(args.source)
        self._has_alarm = model.judge.limits.exist
        self._rate = model.judge.limits.rate if self._has_alarm else _PERSISTENCE / 2
        self.monitor = self._new_alarm(_PERSISTENCE)
        self._names: set[str] = set()
        # State of each file that was not diagnosed, and since when it is so.
        self._waiting: dict[str, tuple[Any, float]] = {}
        self._finished: list[str] = []
        self._look_at = 0.0
        self._n_diagnosed = 0
        self._n_skipped = 0

    def _new_alarm(self, persistence):
        # The interval between false alarms has no influence, because the delay is stated.
        delay = self._args.alarm_delay or 1
        return CumulativeSumAlarm(1.0, self._rate, persistence, delay, self._args.latch)

    @property
    def alarm_state(self) -> str:
        """State of the alarm, see `MonitorVerdict`."""
        return self.monitor.alarm_state if self._has_alarm else "none"

    def open(self) -> None:
        """Do nothing: each look opens the folder."""

    def step(self) -> bool:
        """Diagnose the next file that is finished, and return whether there was one."""
        start = time.monotonic()
        if not self._finished and start >= self._look_at:
            self._look(start)
            end = time.monotonic()
            self._look_at = end + _PAUSE * (end - start)
        if not self._finished:
            return False
        name = self._finished.pop()
        self._names.add(name)
        self._waiting.pop(name, None)
        self._diagnose(self._folder / name)
        return True

    def _look(self, moment):
        """Find the files that are finished."""
        names = {name for name in os.listdir(self._folder) if name[0] != "."}
        if len(self._names) > _MOST_NAMES:
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
            if state == before and moment - since >= self._args.settle:
                finished.append((*state, name))
        self._waiting = waiting
        self._finished = [name for *_, name in sorted(finished, reverse=True)]

    def _diagnose(self, path):
        args = self._args
        recording = ListedRecording(
            None,
            path.name,
            path,
            channel=args.channel,
            dtype=args.dtype,
            sampling_rate=args.sampling_rate or self._model.sampling_rate,
            pulses_per_revolution=args.pulses_per_revolution or 1,
            **args.rpm,
        )
        diagnosis = diagnose_file(recording, lambda: self._model)
        if diagnosis.error is not None:
            self._n_skipped += 1
            say(f"skipped: {path}: {diagnosis.error}")
            return
        self._n_diagnosed += 1
        for remark in diagnosis.remarks:
            self._remark(remark)
        start = recording_start(path, channel=recording.channel, dtype=recording.dtype)
        seconds = path.stat().st_mtime if start is None else start
        self._add({"seconds": seconds, "source": path.name} | self._fields(diagnosis))

    def _fields(self, diagnosis: Diagnosis) -> dict[str, Any]:
        """Count a snapshot, and return its entries in the results with those of the alarm."""
        entries = {
            name.replace(" ", "_").replace("-", "_"): value
            for name, value in diagnosis.verdict.items()
            if not name.startswith("share of ")
        }
        exceeds = {"yes": True, "no": False}.get(entries["alarm"])
        alarm = self.monitor
        if exceeds is not None:
            alarm.add(exceeds)
        is_healthy = entries["verdict"] == self._model.healthy
        if is_healthy and alarm.alarm_state in ("on", "not yet an alarm"):
            entries |= {"verdict": POSSIBLY_CHANGED, "probability": np.nan}
        has_signal = entries["no_signal"] < entries["windows"]
        return entries | {
            "quality": "good" if has_signal else "no signal",
            "exceeds": exceeds,
            "alarm": (alarm.active or alarm.latched) if self._has_alarm else None,
            "alarm_level": alarm.level if self._has_alarm else np.nan,
            "alarm_state": self.alarm_state,
        }

    def restore(
        self, state: dict[str, Any], facts: dict[str, Any], pause: float
    ) -> None:
        """Continue from a state; files whose names it has are not diagnosed again."""
        self._names = set(map(str, facts.get("names", ())))
        self.monitor.restore(state)

    def facts(self) -> dict[str, Any]:
        """Return what is saved with the state."""
        return {"names": sorted(self._names)}

    def alarm(self) -> str | None:
        """Describe the delay of the alarm and the rate of false alarms; None without limits."""
        if not self._has_alarm:
            return None
        n = self._args.alarm_delay or 1
        delay = "the first snapshot that exceeds"
        if n > 1:
            delay = f"the last of {n} snapshots in a row that exceed"
        # Whether snapshots exceed by chance, each for itself, is not known.
        alarms = map(self._new_alarm, (_PERSISTENCE, self._rate))
        run_length = min(alarm.run_length() for alarm in alarms)
        expected = f"at most one in {run_length:.3g} snapshots"
        if seconds := self._interval():
            an_hour = 3600 / seconds / run_length
            expected = (
                f"at most {an_hour:.2g} an hour and {an_hour * _HOURS_A_YEAR:.2g} a year, "
                f"with a snapshot every {seconds:.3g} s"
            )
        return (
            f"Alarm: at {delay} the healthy limits. Expected false alarms: {expected}."
        )

    def _interval(self):
        """Return the usual seconds between the files of the folder; 0 if they are too few."""
        files = filter(Path.is_file, self._folder.glob("[!.]*"))
        times = np.sort([path.stat().st_mtime for path in files])
        return np.median(np.diff(times)) if len(times) > 2 else 0.0

    def summary(self) -> str:
        """Return the counts of the run."""
        return (
            f"{counted(self._n_diagnosed, 'snapshot')}, {self._n_skipped} skipped, "
            f"{counted(self.monitor.n_raised, 'alarm')}"
        )

    def close(self) -> None:
        """Do nothing: no file stays open."""
