"""Output of ``skarxlag watch``: lines of JSON for programs, sentences for people."""

import json
import math
import time
from collections.abc import Mapping
from datetime import UTC, datetime

from ..monitoring import ConditionMonitor, MonitorVerdict
from .messages import percent, printable

#: Range of the seconds since 1970 that are taken for dates, from 1973 to 2096. A clock that counts
#: from the start of a machine is below it.
_DATES = (1e8, 4e9)


class VerdictLines:
    """Writer of one line of JSON for each verdict, or of fewer, to standard output.

    Parameters
    ----------
    sensor : str
        Name of the sensor, which each line states.
    healthy : label or None
        The healthy condition, which each line states.
    every : float or None
        Seconds of the sensor's time between two lines. A verdict that differs from the line before
        in condition, alarm or quality is written at once. None: every verdict is written.
    heartbeat : float or None
        Seconds without a line after which `beat` writes a line of the kind ``"heartbeat"``. None:
        never.

    Attributes
    ----------
    last : MonitorVerdict or None
        The last verdict, written or not.
    """

    last: MonitorVerdict | None

    def __init__(
        self, sensor: str, healthy: object, every: float | None, heartbeat: float | None
    ) -> None:
        self._facts = {"sensor": printable(sensor), "healthy": healthy}
        self._every, self._heartbeat = every, heartbeat
        self.last = self._written = None
        self._line_at = self._window_at = time.monotonic()

    def beat(self) -> None:
        """Write a heartbeat if it is due."""
        now = time.monotonic()
        if self._heartbeat is None or now - self._line_at < self._heartbeat:
            return
        fields = {"seconds_without_window": round(now - self._window_at, 3)}
        fields["verdict"] = None if self.last is None else self.last.verdict
        fields["alarm"] = None if self.last is None else self.last.alarm
        self._print("heartbeat", None, fields)

    def write(self, verdicts: list[MonitorVerdict], source: str | None) -> None:
        """Write those of some verdicts that are due."""
        for verdict in verdicts:
            self.last, self._window_at = verdict, time.monotonic()
            if self._is_due(verdict):
                self._written, fields = verdict, verdict._asdict()
                seconds = fields.pop("time")
                fields = {"seconds": seconds} | fields
                if source is not None:
                    fields["source"] = printable(source)
                self._print("verdict", seconds, fields)

    def _is_due(self, verdict):
        if self._every is None or self._written is None or _news(verdict) != _news(self._written):
            return True
        passed = verdict.time - self._written.time
        # A clock that was set back would suppress all lines; times are sums of rounded steps.
        return passed < 0 or passed >= self._every * (1 - 1e-9)

    def _print(self, kind, seconds, fields):
        self._line_at = time.monotonic()
        line = {"kind": kind, "time": _iso_date(seconds)} | self._facts | fields
        for name, value in line.items():
            if isinstance(value, float) and not math.isfinite(value):
                line[name] = None
        print(json.dumps(line, allow_nan=False), flush=True)


def _iso_date(seconds):
    """Seconds since 1970 as ISO 8601 date in UTC; the present if they are no date."""
    is_date = seconds is not None and _DATES[0] < seconds < _DATES[1]
    moment = datetime.fromtimestamp(seconds, UTC) if is_date else datetime.now(UTC)
    return moment.isoformat(timespec="milliseconds")


def _news(verdict):
    return verdict.verdict, verdict.alarm, verdict.quality


def sentence(verdict: MonitorVerdict) -> str:
    """Describe a verdict.

    Examples
    --------
    >>> first = MonitorVerdict(
    ...     0, 0.5, 900.0, "good", 0.0, "worn", "worn", 0.93, True, False, 0.25, 0.003, "hold"
    ... )
    >>> sentence(first)
    '0.5 s, worn, probability 93.0%, alarm off at 25%, p-value 0.003'
    """
    parts = [f"{verdict.time:.1f} s"]
    parts.append("no verdict" if verdict.verdict is None else f"{verdict.verdict}")
    if not math.isnan(verdict.probability):
        parts.append(f"probability {percent(verdict.probability)}")
    if verdict.alarm is not None:
        parts.append(f"alarm {'ON' if verdict.alarm else 'off'} at {verdict.alarm_level:.0%}")
    if not math.isnan(verdict.p_value):
        parts.append(f"p-value {verdict.p_value:.2g}")
    if verdict.quality != "good":
        parts.append(f"no signal: {verdict.quality}")
    return ", ".join(parts)


def summary(
    monitor: ConditionMonitor, unread: Mapping[str, int], last: MonitorVerdict | None
) -> str:
    """Return the counts of a run and its last verdict.

    Parameters
    ----------
    monitor : ConditionMonitor
        The monitor.
    unread : mapping of str to int
        Counts of what could not be read.
    last : MonitorVerdict or None
        The last verdict.
    """
    counts = monitor.counts
    windows = ", ".join(f"{n} {name}" for name, n in sorted(counts["windows"].items()))
    parts = [f"{counts['samples']} samples", f"windows: {windows or 'none'}"]
    parts.append(f"{counts['gaps']} gaps of {counts['missing_seconds']:.1f} s")
    if counts["clock_steps_back"]:
        parts.append(f"clock set back {counts['clock_steps_back']} times")
    parts += [f"{n} {what}" for what, n in unread.items() if n]
    parts.append(f"{counts['alarms']} alarms")
    if last is not None:
        parts.append(f"last: {printable(sentence(last))}")
    return "; ".join(parts)
