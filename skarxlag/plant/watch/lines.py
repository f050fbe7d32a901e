"""Lines of JSON that ``skarxlag watch`` writes for one sensor."""

import json
import math
import time
from datetime import UTC, datetime
from typing import Any

from ..commands.messages import printable
from ..commands.models import SavedModel


class SensorLines:
    """Lines of one sensor, also while it cannot be watched.

    Parameters
    ----------
    name : str
        Name of the sensor.
    heartbeat : float or None
        Seconds without a line after which a heartbeat is written; None: none is.

    Attributes
    ----------
    verdict : object
        Latest verdict; None if there is none.
    alarm_state : str
        Latest state of the alarm.
    """

    def __init__(self, name: str, heartbeat: float | None) -> None:
        self._head = {"sensor": printable(name), "healthy": None, "model": None}
        self._heartbeat = heartbeat
        self._written_at = time.monotonic()
        self.verdict: Any = None
        self.alarm_state: str = "none"

    def begin(self, model: SavedModel) -> None:
        """State the model in the lines from here on."""
        self._head |= {"healthy": model.healthy, "model": model.short_identity}

    def add(self, fields: dict[str, Any]) -> None:
        """Write a verdict."""
        self.verdict = fields["verdict"]
        self.alarm_state = fields["alarm_state"]
        self._print("verdict", fields)

    def beat(self, problem: str | None) -> None:
        """Write a heartbeat, with what is wrong, if it is due."""
        silence = time.monotonic() - self._written_at
        if self._heartbeat is not None and silence >= self._heartbeat:
            self.write("heartbeat", problem=problem)

    def write(self, kind: str, **fields: Any) -> None:
        """Write a line with the verdict and the alarm at present."""
        state = self.alarm_state
        alarm = None if state == "none" else state in ("on", "latched")
        present = {"verdict": self.verdict, "alarm": alarm, "alarm_state": state}
        self._print(kind, present | fields)

    def _print(self, kind, fields):
        self._written_at = time.monotonic()
        line = {"kind": kind, "time": iso_date(time.time()), **self._head, **fields}
        for name, value in line.items():
            if isinstance(value, float) and not math.isfinite(value):
                line[name] = None
            elif isinstance(value, str):
                line[name] = printable(value)
        print(json.dumps(line, allow_nan=False), flush=True)


def iso_date(seconds: float) -> str:
    """Return seconds since 1970 as ISO 8601 date in UTC.

    >>> iso_date(1.6e9)
    '2020-09-13T12:26:40.000+00:00'
    """
    return datetime.fromtimestamp(seconds, UTC).isoformat(timespec="milliseconds")
