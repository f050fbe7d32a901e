"""A fitted diagnoser on a running sensor."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from ..core.capabilities import capabilities
from ..core.speeds import speeds_of_rows
from ..core.state import expect
from ..core.validation import (
    ABOVE_0,
    as_samples,
    check_count,
    check_flag,
    check_rate,
    check_real,
)
from ..verdicts.judge import Judge
from ..verdicts.names import NO_VERDICT
from . import _memory
from ._recent import RecentWindows
from .verdict import MonitorVerdict

#: Largest number of windows that are diagnosed together.
_BATCH = 256
#: Largest delay of an alarm in windows; the mean time between false alarms is computed
#: from it.
_LONGEST_DELAY = 1000


class ConditionMonitor:
    """Diagnoser of a running sensor, from blocks of samples to verdicts.

    Blocks of any length are cut into windows across their borders. Each window that
    carries a signal is diagnosed by itself. The verdict follows from the fading mean of
    the evidence of the windows. With a bearing, the contrasts of the windows are
    gathered: combs of their mean decide, together with the probabilities by spectra if
    the model learned several conditions. Page's cumulative sum turns windows that
    exceed the healthy limits into an alarm with a stated rate of false alarms. Windows
    without a signal (NaN, a dead channel, dropouts), windows at an implausible speed
    and gaps between blocks are counted. Meanwhile the evidence grows older, and the
    cumulative sum stays.

    The same samples in other blocks give the same verdicts, to the last bit. The
    monitor keeps less than one window of samples and a few numbers, for any time.

    Use :func:`recording_verdicts` instead for a recording that is complete.

    Parameters
    ----------
    diagnoser : fitted classifier or None
        Classifier with probabilities, such as the result of `make_diagnoser`. None:
        there is only a detector.
    sampling_rate : float
        In Hz.
    conditions : sequence of label, default=None
        Order of the conditions, the healthy one first: a permutation of those of the
        diagnoser. For a detector alone, the name of the healthy condition. None:
        sorted, or ``["healthy"]``.
    detector : fitted Pipeline or None, default=None
        Detector with the healthy limits, such as the result of `make_detector`, fitted
        on windows of the same length. None: the detection threshold of the diagnoser,
        which holds at its training speeds only. Without a stated speed, the machine is
        taken to run at one of these.
    window_length : int, default=1200
        Samples in a window of `fit`.
    hop : int or None, default=None
        Samples from the start of one window to the start of the next. None:
        `window_length`.
    half_life : float, default=10.0
        Seconds in which the weight of evidence halves, above 0; infinity for no fading.
    false_alarm_interval : float, default=1000.0
        Smallest mean number of hours of signal between false alarms, above 0.
    alarm_delay : int or None, default=None
        Windows in a row that exceed the healthy limits, after which the alarm goes on,
        from 1 to
        1000. The mean time between false alarms follows from it. None: the smallest delay that
        `false_alarm_interval` allows.
    latch : bool, default=False
        Whether an alarm stays on until `acknowledge` is called, also if windows do not
        exceed the limits any more.
    persistence : float, default=0.5
        Probability in (0, 1) that a healthy window exceeds the limits after one that
        did, for windows that do not overlap. Such windows come in runs, because load
        and speed of a machine last longer than a window; 0.5 means runs of two.
        `calibrate` measures it.
    gap_tolerance : float or None, default=None
        Seconds by which the stated time of a block may differ from the end of the block
        before. Beyond it there is a gap, and a new window starts. None: half a window.
    train_rpm : sequence of float, default=()
        Training speeds. Empty: those that the models state. Windows whose stated speed
        lies farther than a factor of 5 outside them get no verdict.

    Attributes
    ----------
    conditions : list
        Conditions of the diagnoser; empty if there is none.
    healthy : label or None
        The healthy condition; None if it is not known.
    counts : dict
        Numbers of samples, windows by their quality, gaps, missing seconds, clock steps
        back and alarms.
    alarm_delay : int or None
        Windows in a row that exceed the healthy limits, after which the alarm goes on,
        if no window before exceeded; None if there are no healthy limits.
    false_alarm_interval : float or None
        Mean number of hours of signal between false alarms; None if there are no
        healthy limits.
    alarm_state : str
        As in the latest `MonitorVerdict`.
    latched : bool
        Whether an alarm was on that is not acknowledged; False without `latch`.

    Raises
    ------
    ValueError
        If a parameter is out of its range, the diagnoser has no probabilities, or no
        alarm can be as rare as stated.

    See Also
    --------
    window_verdicts : Verdicts on the windows of a complete recording.

    Examples
    --------
    >>> from skarxlag import make_diagnoser, make_windows
    >>> rng = np.random.default_rng(0)
    >>> smooth, rough = rng.normal(size=(2, 48_000)) * [[1], [3]]
    >>> smooth = np.convolve(smooth, [1, 1, 1], "same")
    >>> X = np.concatenate([make_windows(smooth[:24_000]), make_windows(rough[:24_000])])
    >>> diagnoser = make_diagnoser(healthy="good").fit(X, np.repeat(["good", "worn"], 20))
    >>> monitor = ConditionMonitor(diagnoser, 20e3, half_life=1.0)
    >>> for block in np.array_split(smooth[24_000:], 7):
    ...     verdicts = monitor.update(block)
    >>> verdicts[-1].verdict, verdicts[-1].alarm, verdicts[-1].time
    ('good', False, 1.2)
    >>> for block in np.array_split(rough[24_000:], 7):
    ...     verdicts = monitor.update(block)
    >>> verdicts[-1].window_verdict, verdicts[-1].alarm
    ('worn', True)
    """

    def __init__(
        self,
        diagnoser: Any,
        sampling_rate: float,
        *,
        conditions: Sequence[Any] | None = None,
        detector: Any = None,
        window_length: int = 1200,
        hop: int | None = None,
        half_life: float = 10.0,
        false_alarm_interval: float = 1000.0,
        alarm_delay: int | None = None,
        latch: bool = False,
        persistence: float = 0.5,
        gap_tolerance: float | None = None,
        train_rpm: Any = (),
    ) -> None:
        check_count(window_length, "window_length")
        hop = window_length if hop is None else check_count(hop, "hop")
        check_real(sampling_rate, "sampling_rate", **ABOVE_0)
        check_real(false_alarm_interval, "false_alarm_interval", **ABOVE_0)
        if alarm_delay is not None:
            alarm_delay = int(check_count(alarm_delay, "alarm_delay"))
            at_most = f"at most {_LONGEST_DELAY}"
            expect(alarm_delay <= _LONGEST_DELAY, "alarm_delay", alarm_delay, at_most)
        check_flag(latch, "latch")
        if half_life != np.inf:
            check_real(half_life, "half_life", **ABOVE_0)
        if gap_tolerance is None:
            gap_tolerance = 0.5 * window_length / sampling_rate
        check_real(gap_tolerance, "gap_tolerance", min_val=0)
        check_rate(persistence, "persistence")
        options = {
            "conditions": conditions,
            "detector": detector,
            "train_rpm": train_rpm,
        }
        self._judge = Judge(
            diagnoser, same_speed=True, sampling_rate=sampling_rate, **options
        )
        model = detector if diagnoser is None else diagnoser
        described = capabilities(model)
        self.conditions: list[Any] = []
        if described.conditions is not None:
            self.conditions = self._judge.conditions
        self.healthy: Any = self._judge.healthy
        self._half_life = float(half_life)
        self._n_channels = described.n_channels
        self._length = int(window_length)
        self._hop = int(hop)
        # The shaft speed is one more channel.
        sizes = {
            "n_rows": described.n_channels + 1,
            "window_length": self._length,
            "hop": self._hop,
        }
        times = {
            "sampling_rate": float(sampling_rate),
            "gap_tolerance": float(gap_tolerance),
        }
        self._windowing = sizes | times
        # Windows that share samples exceed together.
        persistence = max(float(persistence), 1 - hop / window_length)
        self._alarming = {"persistence": persistence, "rate": self._judge.limits.rate}
        self._windows_an_hour = 3600 * sampling_rate / hop
        self._alarming["run_length"] = false_alarm_interval * self._windows_an_hour
        self._alarming["delay"] = alarm_delay
        self._latch = bool(latch)
        self._settings = {
            **self._windowing,
            **self._alarming,
            "half_life": self._half_life,
            "conditions": [str(name) for name in self.conditions],
            "healthy": None if self.healthy is None else str(self.healthy),
            "train_rpm": [float(speed) for speed in self._judge.train_rpm],
        }
        self._seen = np.zeros(4, dtype=int)
        self._start_afresh()

    def _start_afresh(self):
        self._stream = _memory.WindowStream(**self._windowing)
        self._recent = RecentWindows(self._judge, self._half_life)
        self._alarm = self._new_alarm(self._seen) if self._judge.limits.exist else None
        self._qualities, self._rpm, self._varies = Counter(), None, False
        self.latched: bool = False

    def _new_alarm(self, seen):
        measured = _memory.healthy_shares(seen) if seen.any() else {}
        return _memory.CumulativeSumAlarm(**self._alarming | measured)

    @property
    def counts(self) -> dict[str, Any]:
        """Return the counts so far: see the class."""
        return {
            "samples": self._stream.n_samples,
            "windows": dict(self._qualities),
            "gaps": self._stream.n_gaps,
            "missing_seconds": self._stream.missing_seconds,
            "clock_steps_back": self._stream.n_steps_back,
            "alarms": 0 if self._alarm is None else self._alarm.n_raised,
        }

    @property
    def alarm_delay(self) -> int | None:
        """Return the windows in a row that raise an alarm: see the class."""
        return None if self._alarm is None else self._alarm.delay

    @property
    def false_alarm_interval(self) -> float | None:
        """Return the mean number of hours between false alarms: see the class."""
        return (
            None
            if self._alarm is None
            else self._alarm.run_length() / self._windows_an_hour
        )

    @property
    def alarm_state(self) -> str:
        """Return the state of the alarm, see `MonitorVerdict`."""
        if self._alarm is None:
            return "none"
        if self._alarm.active:
            return "on"
        if self.latched:
            return "latched"
        return "not yet an alarm" if self._alarm.sum > 0 else "off"

    def acknowledge(self) -> None:
        """Release a latched alarm.

        The alarm goes off if windows do not keep it on. Otherwise it goes off as
        without `latch`. The next alarm is latched again.
        """
        self.latched = False

    def update(
        self,
        samples: ArrayLike,
        *,
        time: float | None = None,
        rpm: ArrayLike | None = None,
    ) -> list[MonitorVerdict]:
        """Add the next block, and return a verdict for each window that is complete now.

        Parameters
        ----------
        samples : array-like of shape (n_samples,) or (n_channels, n_samples)
            Any number of real samples in the unit of `fit`. Of several channels, the
            first is the output. NaN is a missing sample, and so is a masked one.
        time : float or None, default=None
            Time of the first sample, in seconds on any clock. None: the block follows
            the block before.
        rpm : float, array-like of shape (n_samples,) or None, default=None
            Shaft speed from here on, or at each sample; NaN within an array is the
            speed before. None: as before. A verdict states the speed at the middle of
            its window. Orders follow an array of speeds, see :func:`rpm_from_tacho`.

        Returns
        -------
        list of MonitorVerdict
            In the order of time; empty if no window became complete.

        Raises
        ------
        ValueError
            If the samples are not real numbers, or have another number of channels than
            the model; if there is not one speed, or one for each sample.
        """
        signal = self._checked(samples)
        if time is not None:
            check_real(time, "time")
        speeds = self._speeds(rpm, signal.shape[1])
        start, windows = self._stream.push(np.vstack([signal, speeds]), time)
        verdicts = []
        for first in range(0, len(windows), _BATCH):
            verdicts += self._judged(
                windows[first : first + _BATCH], start + first * self._hop
            )
        return verdicts

    def calibrate(self, samples: ArrayLike, *, rpm: float | None = None) -> Self:
        """Measure how often, and in what runs, healthy windows exceed the limits.

        Both numbers are means of a Beta(1, 1) posterior: with few windows, the
        estimates stay near 1/2. Several recordings add up. The monitor starts again
        without samples.

        Parameters
        ----------
        samples : array-like of shape (n_samples,) or (n_channels, n_samples)
            A recording of the healthy machine that was not used to fit the detector.
        rpm : float or None, default=None
            As in `update`.

        Returns
        -------
        ConditionMonitor
            This monitor.

        Raises
        ------
        ValueError
            If there are no healthy limits, or healthy windows exceed them so often that
            no alarm can be as rare as stated.
        """
        expect(
            self._judge.limits.exist,
            "detector",
            None,
            "a detector, or a diagnoser with limits",
        )
        self._start_afresh()
        exceeds = [
            v.exceeds for v in self.update(samples, rpm=rpm) if v.exceeds is not None
        ]
        self._start_afresh()
        seen = self._seen + _memory.runs_of(exceeds)
        self._alarm = self._new_alarm(seen)
        self._seen = seen
        return self

    def _checked(self, samples):
        """Samples of shape (n_channels, n_samples)."""
        signal, n = np.asarray(as_samples(samples, "samples")), self._n_channels
        if signal.ndim == 1 and (n == 1 or signal.size == 0):
            signal = signal.reshape(n, -1)
        is_right = signal.dtype.kind in "iuf" and signal.ndim == 2 and len(signal) == n
        found, expected = (
            f"{signal.dtype} of shape {signal.shape}",
            f"{n} channels as in fit",
        )
        expect(
            is_right,
            "samples",
            found,
            f"{expected}: real numbers of shape ({n}, n_samples)",
        )
        return signal

    def _speeds(self, rpm, n_samples):
        """Speed at each sample, NaN if it is not known."""
        before = np.nan if self._rpm is None else self._rpm
        if rpm is None:
            return np.full(n_samples, before)
        speeds, expected = (
            speeds_of_rows(rpm, n_samples),
            f"one for each of {n_samples} samples",
        )
        expect(speeds.shape == (n_samples,), "rpm", rpm, f"one number, or {expected}")
        if np.ndim(rpm) == 1:
            stated = pd.Series([before, *speeds]).ffill().to_numpy()
            speeds, rpm, self._varies = stated[1:], stated[-1], True
        self._rpm = float(rpm)
        return speeds

    def _judged(self, windows, start):
        rows = np.ascontiguousarray(
            windows[:, 0] if self._n_channels == 1 else windows[:, :-1]
        )
        speeds = windows[:, -1, windows.shape[2] // 2]
        rpm = None if self._rpm is None else speeds
        if self._varies:
            rpm = np.where(
                np.isnan(windows[:, -1]), speeds[:, np.newaxis], windows[:, -1]
            )
        results = self._judge.window_results(rows, rpm)
        names = results.columns.keys()
        columns = [column.tolist() for column in results.columns.values()]
        tables = [
            dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True)
        ]
        judged = [
            self._without_verdict(results, i, tables[i], start + i * self._hop, rpm)
            for i, rpm in enumerate(speeds.tolist())
        ]
        return self._with_verdicts(judged)

    def _without_verdict(self, results, i, table, start, rpm):
        """Return all but the verdict by recent windows, the means for it, and the alarm."""
        end = self._stream.time_of(start + self._length)
        self._recent.move_to(end)
        self._recent.add_p_value(table.get("p-value", np.nan))
        exceeds = None if math.isnan(table["alarm"]) else bool(table["alarm"])
        if exceeds is not None:
            self._count(exceeds)
        quality = table["quality"]
        window_verdict = verdict = means = None
        if quality == "good" and results.refusal[i] != "":
            quality = NO_VERDICT
            window_verdict = table["verdict"]
            verdict = window_verdict
        else:
            if quality == "good":
                self._recent.add(results, i)
                window_verdict = table["verdict"] if self.conditions else None
            means = self._recent.means()
        # A latched alarm is of earlier windows.
        alarm = None if self._alarm is None else self._alarm.active
        self._qualities[quality] += 1
        is_on, level = self._alarm_and_level()
        judged = MonitorVerdict(
            start=start,
            time=end,
            rpm=rpm,
            quality=quality,
            quality_share=table["quality share"],
            window_verdict=window_verdict,
            verdict=verdict,
            probability=np.nan,
            exceeds=exceeds,
            alarm=is_on,
            alarm_level=level,
            p_value=self._recent.p_value(),
            limits=table["limits"],
            alarm_state=self.alarm_state,
        )
        return judged, means, alarm

    def _with_verdicts(self, judged):
        """Return the verdicts on windows with those by recent windows, named together."""
        verdicts = [verdict for verdict, _, _ in judged]
        with_means = [i for i, (_, means, _) in enumerate(judged) if means is not None]
        if not with_means:
            return verdicts
        means = [judged[i][1] for i in with_means]
        names = self._judge.named(
            np.array([each.evidence for each in means]),
            np.array([each.n_windows for each in means]),
            [judged[i][2] for i in with_means],
            [each.contrast for each in means],
        )
        for i, named in zip(with_means, names, strict=True):
            verdicts[i] = verdicts[i]._replace(
                verdict=named.verdict, probability=named.probability
            )
        return verdicts

    def _count(self, exceeds):
        """Add a window to the cumulative sum."""
        n_raised = self._alarm.n_raised
        self._alarm.add(exceeds)
        if self._latch and self._alarm.n_raised > n_raised:
            self.latched = True

    def _alarm_and_level(self):
        if self._alarm is None:
            return None, np.nan
        return self._alarm.active or self.latched, self._alarm.sum / self._alarm.limit

    def state(self) -> dict[str, Any]:
        """Return the state that `restore` continues from after a restart.

        Returns
        -------
        dict
            Plain numbers, texts, lists and dicts. `save_monitor_state` writes it to a
            file.
        """
        own = {
            "settings": dict(self._settings),
            "seen": self._seen.tolist(),
            "rpm": self._rpm,
        }
        own |= {"qualities": dict(self._qualities), "varies": self._varies}
        own["latched"] = self.latched
        return own | {name: part.state() for name, part in self._parts().items()}

    def _parts(self):
        parts = {"stream": self._stream, **self._recent.parts}
        return parts if self._alarm is None else parts | {"alarm": self._alarm}

    def restore(self, state: dict[str, Any]) -> Self:
        """Continue from the state of a monitor with the same settings.

        Parameters
        ----------
        state : dict
            Result of `state`.

        Returns
        -------
        ConditionMonitor
            This monitor.

        Raises
        ------
        ValueError
            If the state has other settings, conditions, channels or training speeds, or
            is damaged. The monitor is then as after its construction.
        """
        before = self._seen
        try:
            for name, value in self._settings.items():
                found = state["settings"].get(name)
                expect(found == value, name, found, f"{value!r}, as this monitor")
            self._seen = np.array([_memory.check_count(n) for n in state["seen"]])
            is_right = self._seen.shape == (4,) and np.all(np.diff(self._seen) <= 0)
            expect(
                is_right, "seen", state["seen"], "as many windows as exceed, or more"
            )
            self._start_afresh()
            for name, part in self._parts().items():
                part.restore(state[name])
            for name, n in state["qualities"].items():
                self._qualities[str(name)] = _memory.check_count(n)
            self._varies = bool(state["varies"])
            self.latched = self._latch and bool(state["latched"])
            self._rpm = None if state["rpm"] is None else float(state["rpm"])
        # Errors of damaged states are as varied as the damage.
        except Exception as error:
            self._seen = before
            self._start_afresh()
            raise ValueError(
                f"state of another monitor, or damaged: {error}"
            ) from error
        return self
