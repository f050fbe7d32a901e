"""What ``skarxlag watch`` tells: lines of JSON for programs, sentences for people."""

import json
import math
import sys
from typing import Any

from ..monitoring import MonitorVerdict
from .messages import printable

#: What parsers count.
_UNREAD = {
    "n_bad": "lines that are no numbers",
    "n_bad_times": "times that could not be read",
    "n_cut": "bytes of a sample that is not whole",
}


class VerdictLines:
    """Lines of JSON on standard output, one a verdict or fewer.

    Parameters
    ----------
    every : float or None
        Seconds of the sensor's time between two lines. A verdict that differs from the line before
        in condition, alarm or quality is written at once. None: every verdict is written.
    """

    def __init__(self, every: float | None) -> None:
        self._every, self._last = every, None

    def write(self, verdicts: list[MonitorVerdict], source: str | None) -> None:
        """Write what has to be written of some verdicts, and let it go at once."""
        for verdict in verdicts:
            if self._is_due(verdict):
                self._last = verdict
                print(_json(verdict, source))
        if verdicts:
            sys.stdout.flush()

    def _is_due(self, verdict):
        if self._every is None or self._last is None or _news(verdict) != _news(self._last):
            return True
        passed = verdict.time - self._last.time
        # A clock that was set back would keep all silent; times are sums of rounded steps.
        return passed < 0 or passed >= self._every * (1 - 1e-9)


def _news(verdict):
    return verdict.verdict, verdict.alarm, verdict.quality


def _json(verdict, source):
    line = {
        name: None if isinstance(value, float) and math.isnan(value) else value
        for name, value in verdict._asdict().items()
    }
    if source is not None:
        line["source"] = printable(source)
    return json.dumps(line, allow_nan=False)


def sentence(verdict: MonitorVerdict) -> str:
    """A verdict for people.

    Examples
    --------
    >>> sentence(MonitorVerdict(0, 0.5, "good", "worn", "worn", 0.93, True, False, 0.25))
    '0.5 s, worn, confidence 93%, alarm off at 25%'
    """
    parts = [f"{verdict.time:.1f} s"]
    parts.append("no verdict" if verdict.verdict is None else f"{verdict.verdict}")
    if verdict.verdict is not None:
        parts.append(f"confidence {verdict.confidence:.0%}")
    if verdict.alarm is not None:
        parts.append(f"alarm {'ON' if verdict.alarm else 'off'} at {verdict.alarm_level:.0%}")
    if verdict.quality != "good":
        parts.append(f"no signal: {verdict.quality}")
    return ", ".join(parts)


def summary(counts: dict[str, Any], parser: Any) -> str:
    """What came in all.

    Parameters
    ----------
    counts : dict
        Of the monitor.
    parser : RawSamples, TextSamples or None
        Counts what could not be read.
    """
    windows = ", ".join(f"{n} {name}" for name, n in sorted(counts["windows"].items()))
    parts = [f"{counts['samples']} samples", f"windows: {windows or 'none'}"]
    parts.append(f"{counts['gaps']} gaps of {counts['missing_seconds']:.1f} s")
    if counts["clock_steps_back"]:
        parts.append(f"clock set back {counts['clock_steps_back']} times")
    for name, what in _UNREAD.items():
        if getattr(parser, name, 0):
            parts.append(f"{getattr(parser, name)} {what}")
    parts.append(f"{counts['alarms']} alarms")
    return "; ".join(parts)
