"""Lines of JSON that ``skarxlag watch`` writes for one sensor."""

import argparse
import json
import math
import time
from datetime import UTC, datetime
from operator import attrgetter
from typing import Any

from ...monitoring import ConditionMonitor, MonitorVerdict
from ..commands.messages import percent, printable
from ..commands.models import SavedModel

#: Facts of a verdict that are written at once if they differ from the line before.
_news = attrgetter("verdict", "alarm", "quality")
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
    last : MonitorVerdict or None
        Verdict on the latest window.
    """

    def __init__(self, args: argparse.Namespace, name: str) -> None:
        self._args = args
        self._name = printable(name)
        self._model: SavedModel | None = None
        self._monitor: ConditionMonitor | None = None
        self.last: MonitorVerdict | None = None
        self._written: MonitorVerdict | None = None
        self._line_at = self._window_at = time.monotonic()

    def begin(self, model: SavedModel, monitor: ConditionMonitor) -> None:
        """Continue with a model and its monitor."""
        if self._model is None or model.identity != self._model.identity:
            self.last = self._written = None
        self._model = model
        self._monitor = monitor

    def add(self, verdict: MonitorVerdict, source: str | None) -> None:
        """Write the verdict on a window, if it is due."""
        self.last = verdict
        self._window_at = time.monotonic()
        if self._is_due(verdict):
            self._written = verdict
            fields = verdict._asdict()
            fields = {"seconds": fields.pop("time")} | fields
            if source is not None:
                fields["source"] = printable(source)
            self._print("verdict", verdict.time, fields)

    def _is_due(self, verdict):
        every = self._args.every
        if every is None or self._written is None:
            return True
        if _news(verdict) != _news(self._written):
            return True
        # A clock that was set back would suppress all lines; times are sums of rounded
        # steps.
        return not 0 <= verdict.time - self._written.time < every * (1 - 1e-9)

    def beat(self, problem: str | None) -> None:
        """Write a heartbeat if no line was written for so long.

        Parameters
        ----------
        problem : str or None
            Why the sensor is not watched, or not with the present model.
        """
        heartbeat = self._args.heartbeat
        if heartbeat is not None and time.monotonic() - self._line_at >= heartbeat:
            self._print("heartbeat", None, self._present() | {"problem": problem})

    def acknowledged(self) -> None:
        """Write that a latched alarm was acknowledged."""
        present = self._present()
        if self.last is not None:
            self.last = self.last._replace(
                alarm=present["alarm"], alarm_state=present["alarm_state"]
            )
        self._print("acknowledged", None, present)

    def _present(self):
        """Verdict and alarm at present."""
        state = "none" if self._monitor is None else self._monitor.alarm_state
        return {
            "seconds_without_window": round(time.monotonic() - self._window_at, 3),
            "verdict": self.last and self.last.verdict,
            "alarm": None if state == "none" else state in _ON,
            "alarm_state": state,
        }

    def _print(self, kind, seconds, fields):
        self._line_at = time.monotonic()
        line: dict[str, Any] = {
            "kind": kind,
            "time": iso_date(seconds),
            "sensor": self._name,
            "healthy": self._model and self._model.healthy,
            "model": self._model and self._model.short_identity,
            **fields,
        }
        for name, value in line.items():
            if isinstance(value, float) and not math.isfinite(value):
                line[name] = None
        text = json.dumps(line, allow_nan=False)
        try:
            print(text, flush=True)
        except BrokenPipeError:
            raise
        except OSError as error:
            raise OutputError(error) from error


def iso_date(seconds: float | None) -> str:
    """Return seconds since 1970 as ISO 8601 date in UTC; the present if they are no date."""
    is_date = seconds is not None and _DATES[0] < seconds < _DATES[1]
    moment = datetime.fromtimestamp(seconds, UTC) if is_date else datetime.now(UTC)
    return moment.isoformat(timespec="milliseconds")


def sentence(verdict: MonitorVerdict) -> str:
    """Describe a verdict.

    Examples
    --------
    >>> first = MonitorVerdict(
    ...     *(0, 0.5, 900.0, "good", 0.0, "worn", "worn", 0.93, True, False, 0.25, 0.003, "hold"),
    ...     alarm_state="not yet an alarm",
    ... )
    >>> sentence(first)
    '0.5 s, worn, probability 93.0%, not yet an alarm, at 25%, p-value 0.003'
    >>> nothing = dict.fromkeys(("probability", "p_value"), math.nan)
    >>> sentence(first._replace(**nothing, quality="constant", alarm_state="none"))
    '0.5 s, worn, no signal: constant'
    """
    parts = [f"{verdict.time:.1f} s, {verdict.verdict or 'no verdict'}"]
    if not math.isnan(verdict.probability):
        parts.append(f"probability {percent(verdict.probability)}")
    if verdict.alarm_state != "none":
        parts.append(_ALARMS[verdict.alarm_state].format(verdict.alarm_level))
    if not math.isnan(verdict.p_value):
        parts.append(f"p-value {verdict.p_value:.2g}")
    if verdict.quality != "good":
        parts.append(f"no signal: {verdict.quality}")
    return ", ".join(parts)
