"""Lines of JSON that ``skarxlag watch`` writes for one sensor."""

import json
import math
import time
from datetime import UTC, datetime
from typing import Any

from ..commands.messages import printable
from ..commands.models import SavedModel

#: Fields of a verdict whose changes are written at once.
_NEWS = ("verdict", "alarm", "quality")


class SensorLines:
    """Lines of one sensor, also while it cannot be watched.

    Parameters
    ----------
    name : str
        Name of the sensor.
    every : float or None
        Seconds from one line to the next: of verdicts on the clock of the source, unless
        they change, and of heartbeats while there is no verdict. None: a line for each
        verdict and no heartbeat.
    """

    def __init__(self, name: str, every: float | None) -> None:
        self._head = {"sensor": printable(name), "healthy": None, "model": None}
        self._every = every
        self._last: dict[str, Any] | None = None
        self._written: dict[str, Any] | None = None
        self._line_at = self._verdict_at = time.monotonic()

    def begin(self, model: SavedModel) -> None:
        """State the model in the lines from here on."""
        self._head |= {"healthy": model.healthy, "model": model.short_identity}

    def add(self, fields: dict[str, Any]) -> None:
        """Write a verdict, if it is due."""
        self._last = fields
        self._verdict_at = time.monotonic()
        if self._is_due(fields):
            self._written = fields
            self._print("verdict", fields)

    def _is_due(self, fields):
        before = self._written
        if self._every is None or before is None:
            return True
        if any(fields[name] != before[name] for name in _NEWS):
            return True
        # A clock that was set back would suppress all lines; times are sums of rounded
        # steps.
        least = self._every * (1 - 1e-9)
        return not 0 <= fields["seconds"] - before["seconds"] < least

    def beat(self, alarm_state: str, problem: str | None) -> None:
        """Write a heartbeat, with what is wrong, if it is due."""
        latest = max(self._line_at, self._verdict_at)
        if self._every is not None and time.monotonic() - latest >= self._every:
            self.write("heartbeat", alarm_state, problem=problem)

    def write(self, kind: str, alarm_state: str, **fields: Any) -> None:
        """Write a line with the verdict and the alarm at present."""
        silence = time.monotonic() - self._verdict_at
        has_alarm = alarm_state != "none"
        present = {
            "seconds_without_verdict": round(silence, 3),
            "verdict": self._last and self._last["verdict"],
            "alarm": alarm_state in ("on", "latched") if has_alarm else None,
            "alarm_state": alarm_state,
        }
        self._print(kind, present | fields)

    def _print(self, kind, fields):
        self._line_at = time.monotonic()
        line = {"kind": kind, "time": iso_date(time.time()), **self._head, **fields}
        for name, value in line.items():
            if isinstance(value, float) and not math.isfinite(value):
                line[name] = None
            elif isinstance(value, str):
                line[name] = printable(value)
        print(json.dumps(line, allow_nan=False), flush=True)

    def summary(self) -> str:
        """Describe the latest verdict; empty if there is none."""
        last = self._last
        if last is None:
            return ""
        state = last["alarm_state"]
        alarm = "" if state == "none" else f", alarm: {state}"
        return f"; last: {last['verdict'] or 'no verdict'}{alarm}"


def iso_date(seconds: float) -> str:
    """Return seconds since 1970 as ISO 8601 date in UTC.

    >>> iso_date(1.6e9)
    '2020-09-13T12:26:40.000+00:00'
    """
    return datetime.fromtimestamp(seconds, UTC).isoformat(timespec="milliseconds")
