"""Lines of JSON that ``skarxlag watch`` writes for one sensor."""

import argparse
import json
import math
import time
from datetime import UTC, datetime
from typing import Any

from ..commands.messages import percent, printable
from ..commands.models import SavedModel

#: Fields of a verdict whose changes are written at once.
_NEWS = ("verdict", "alarm", "quality")
#: Range of the seconds since 1970 that are taken for dates, from 1973 to 2096. A clock
#: that counts from the start of a machine is below it.
_DATES = (1e8, 4e9)
#: States of the alarm in which it is on.
_ON = ("on", "latched")
#: Descriptions of the states of the alarm, with its level.
_ALARMS = {
    "off": "alarm off at {:.0%}",
    "not yet an alarm": "not yet an alarm, at {:.0%}",
    "on": "alarm ON at {:.0%}",
    "latched": "alarm latched, at {:.0%}",
}


class OutputError(Exception):
    """Standard output that cannot be written, which no sensor is the reason of."""


class SensorLines:
    """Lines of one sensor, also while it cannot be watched.

    Parameters
    ----------
    args : argparse.Namespace
        Arguments of the command.
    name : str
        Name of the sensor.

    Attributes
    ----------
    last : dict or None
        Fields of the latest verdict.
    """

    def __init__(self, args: argparse.Namespace, name: str) -> None:
        self._args = args
        self._head = {"sensor": printable(name), "healthy": None, "model": None}
        self.last: dict[str, Any] | None = None
        self._written: dict[str, Any] | None = None
        self._line_at = self._verdict_at = time.monotonic()

    def begin(self, model: SavedModel) -> None:
        """State the model in the lines from here on."""
        self._head |= {"healthy": model.healthy, "model": model.short_identity}

    def add(self, fields: dict[str, Any]) -> None:
        """Write a verdict, if it is due."""
        self.last = fields
        self._verdict_at = time.monotonic()
        if self._is_due(fields):
            self._written = fields
            self._print("verdict", fields["seconds"], fields)

    def _is_due(self, fields):
        every = self._args.every
        before = self._written
        if every is None or before is None:
            return True
        if any(fields[name] != before[name] for name in _NEWS):
            return True
        # A clock that was set back would suppress all lines; times are sums of rounded
        # steps.
        return not 0 <= fields["seconds"] - before["seconds"] < every * (1 - 1e-9)

    def beat(self, alarm_state: str, problem: str | None) -> None:
        """Write a heartbeat, with what is wrong, if no line was written for so long."""
        heartbeat = self._args.heartbeat
        if heartbeat is not None and time.monotonic() - self._line_at >= heartbeat:
            fields = self._present(alarm_state) | {"problem": problem}
            self._print("heartbeat", None, fields)

    def acknowledged(self, alarm_state: str) -> None:
        """Write that a latched alarm was acknowledged."""
        self._print("acknowledged", None, self._present(alarm_state))

    def _present(self, alarm_state):
        """Return the verdict and the alarm at present."""
        return {
            "seconds_without_verdict": round(time.monotonic() - self._verdict_at, 3),
            "verdict": self.last and self.last["verdict"],
            "alarm": None if alarm_state == "none" else alarm_state in _ON,
            "alarm_state": alarm_state,
        }

    def _print(self, kind, seconds, fields):
        self._line_at = time.monotonic()
        line = {"kind": kind, "time": iso_date(seconds), **self._head, **fields}
        for name, value in line.items():
            if isinstance(value, float) and not math.isfinite(value):
                line[name] = None
            elif isinstance(value, str):
                line[name] = printable(value)
        try:
            print(json.dumps(line, allow_nan=False), flush=True)
        except BrokenPipeError:
            raise
        except OSError as error:
            raise OutputError(f"standard output: {error}") from error


def iso_date(seconds: float | None) -> str:
    """Return seconds since 1970 as ISO 8601 date in UTC; the present if they are no date."""
    is_date = seconds is not None and _DATES[0] < seconds < _DATES[1]
    moment = datetime.fromtimestamp(seconds, UTC) if is_date else datetime.now(UTC)
    return moment.isoformat(timespec="milliseconds")


def sentence(fields: dict[str, Any]) -> str:
    """Describe a verdict by the fields of its line.

    Examples
    --------
    >>> fields = {"verdict": "worn", "probability": 0.93, "alarm_level": 0.25}
    >>> fields |= {"alarm_state": "not yet an alarm", "p_value": 0.003, "quality": "good"}
    >>> sentence({"seconds": 0.5, **fields})
    '0.5 s, worn, probability 93.0%, not yet an alarm, at 25%, p-value 0.003'
    >>> fields |= dict.fromkeys(("probability", "p_value"), math.nan)
    >>> sentence({"source": "1.wav", **fields, "quality": "constant", "alarm_state": "none"})
    '1.wav, worn, no signal: constant'
    """
    source = fields.get("source")
    parts = [f"{fields['seconds']:.1f} s" if source is None else printable(source)]
    parts.append(str(fields["verdict"] or "no verdict"))
    if not math.isnan(fields["probability"]):
        parts.append(f"probability {percent(fields['probability'])}")
    if fields["alarm_state"] != "none":
        parts.append(_ALARMS[fields["alarm_state"]].format(fields["alarm_level"]))
    if not math.isnan(fields["p_value"]):
        parts.append(f"p-value {fields['p_value']:.2g}")
    if fields["quality"] != "good":
        parts.append(f"no signal: {fields['quality']}")
    return ", ".join(parts)
