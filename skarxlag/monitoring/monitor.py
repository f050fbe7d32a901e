"""A fitted diagnoser on a running sensor."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from ..core.capabilities import capabilities
from ..core.state import expect
from ..core.validation import check_flag, check_real
from ..verdicts.judge import Judge
from ..verdicts.names import NO_VERDICT
from ._alarm import CumulativeSumAlarm, healthy_shares, runs_of
from ._recent import JudgedWindow, RecentWindows, with_recent_verdicts
from ._settings import MonitorSettings
from ._windows import WindowStream, checked_samples, saved_count, speeds_of_samples
from .verdict import MonitorVerdict

#: Largest number of windows that are diagnosed together.
_BATCH = 256


class ConditionMonitor:
    """Diagnoser of a running sensor, from blocks of samples to verdicts.

    Blocks of any length are cut into windows across their borders. Each window that
    carries a signal is diagnosed by itself. The verdict follows from the fading mean of
    the evidence of the windows. With a bearing, it follows from the combs of their mean
    contrast, together with spectra if the model learned several conditions. Page's
    cumulative sum turns windows that exceed the healthy limits into an alarm with a
    stated rate of false alarms. Windows without a signal (NaN, a dead channel,
    dropouts), windows at an implausible speed and gaps between blocks are counted.
    Meanwhile the evidence grows older, and the cumulative sum stays.

    The same samples in other blocks give the same verdicts, to the last bit. The
    monitor keeps less than one window of samples and a few numbers. Use
    :func:`window_verdicts` or :func:`recording_verdicts` for a complete recording.

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
        which holds at its training speeds only, also if no speed is stated.
    window_length : int, default=1200
        Samples in a window of `fit`.
    hop : int or None, default=None
        Samples from one window to the next. None: `window_length`.
    half_life : float, default=10.0
        Seconds in which the weight of evidence halves, above 0; infinity for no fading.
    false_alarm_interval : float, default=1000.0
        Smallest mean number of hours of signal between false alarms, above 0.
    alarm_delay : int or None, default=None
        Windows in a row that exceed the healthy limits, after which the alarm goes on,
        from 1 to 1000. The mean time between false alarms follows from it. None: the
        smallest delay that `false_alarm_interval` allows.
    latch : bool, default=False
        Whether an alarm stays on until `acknowledge` is called.
    persistence : float, default=0.5
        Probability in (0, 1) that a healthy window exceeds the limits after one that
        did and that it does not overlap. Load and speed of a machine last longer than a
        window; 0.5 means runs of two. `calibrate` measures it.
    gap_tolerance : float or None, default=None
        Seconds by which the stated time of a block may differ from the end of the block
        before. Beyond it, a new window starts. None: half a window.
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
        Samples, windows by quality, gaps, missing seconds, clock steps back and alarms.
    alarm_delay : int or None
        Windows in a row after which the alarm goes on; None without healthy limits.
    false_alarm_interval : float or None
        Mean number of hours of signal between false alarms; None without limits.
    alarm_state : str
        As in the latest `MonitorVerdict`.
    latched : bool
        Whether an alarm was on that is not acknowledged; False without `latch`.

    Raises
    ------
    ValueError
        If a parameter is out of its range, the diagnoser has no probabilities, or no
        alarm can be as rare as stated.

    Examples
    --------
    >>> from skarxlag import make_diagnoser, make_windows
    >>> smooth, rough = np.random.default_rng(0).normal(size=(2, 48_000)) * [[1], [3]]
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
        self._settings = MonitorSettings(
            sampling_rate=sampling_rate,
            window_length=window_length,
            hop=hop,
            half_life=half_life,
            false_alarm_interval=false_alarm_interval,
            alarm_delay=alarm_delay,
            persistence=persistence,
            gap_tolerance=gap_tolerance,
        )
        check_flag(latch, "latch")
        self._latch = bool(latch)
        self._judge = Judge(
            diagnoser,
            same_speed=True,
            sampling_rate=sampling_rate,
            conditions=conditions,
            detector=detector,
            train_rpm=train_rpm,
        )
        described = capabilities(detector if diagnoser is None else diagnoser)
        has_conditions = described.conditions is not None
        self.conditions: list[Any] = self._judge.conditions if has_conditions else []
        self.healthy: Any = self._judge.healthy
        self._n_channels = described.n_channels
        self._runs = np.zeros(4, dtype=int)
        self._start_afresh()

    def _start_afresh(self):
        # The shaft speed is one more channel.
        self._stream = WindowStream(self._n_channels + 1, self._settings)
        self._recent = RecentWindows(self._judge, self._settings.half_life)
        self._alarm = self._new_alarm(self._runs) if self._judge.limits.exist else None
        self._qualities = Counter()
        self._rpm: float | None = None
        self._varies = False

    def _new_alarm(self, runs):
        settings = self._settings
        shares = (self._judge.limits.rate, settings.least_persistence)
        if runs.any():
            shares = healthy_shares(runs)
        return CumulativeSumAlarm(
            settings.run_length, *shares, settings.alarm_delay, self._latch
        )

    @property
    def counts(self) -> dict[str, Any]:
        """Return the counts so far: see the class."""
        return {
            "samples": self._stream.n_samples,
            "windows": dict(self._qualities),
            "gaps": self._stream.n_gaps,
            "missing_seconds": self._stream.missing_seconds,
            "clock_steps_back": self._stream.n_steps_back,
            "alarms": self._alarm.n_raised if self._alarm else 0,
        }

    @property
    def alarm_delay(self) -> int | None:
        """Return the windows in a row that raise an alarm: see the class."""
        return self._alarm and self._alarm.delay

    @property
    def false_alarm_interval(self) -> float | None:
        """Return the mean number of hours between false alarms: see the class."""
        return self._alarm and self._alarm.run_length() / self._settings.windows_an_hour

    @property
    def alarm_state(self) -> str:
        """Return the state of the alarm, see `MonitorVerdict`."""
        return self._alarm.name if self._alarm else "none"

    @property
    def latched(self) -> bool:
        """Return whether an alarm was on that is not acknowledged: see the class."""
        return bool(self._alarm and self._alarm.latched)

    @latched.setter
    def latched(self, value: bool) -> None:
        if self._alarm:
            self._alarm.latched = value

    def acknowledge(self) -> None:
        """Release a latched alarm, which then goes off as without `latch`.

        The next alarm is latched again.
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
            Shaft speed from here on, or at each sample (:func:`rpm_from_tacho`), which
            orders follow. NaN within an array is the speed before. None: as before.

        Returns
        -------
        list of MonitorVerdict
            In the order of time; empty if no window became complete.

        Raises
        ------
        ValueError
            If the samples are no real numbers of the channels of the model, or there is
            not one speed, or one for each sample.
        """
        signal = checked_samples(samples, self._n_channels)
        if time is not None:
            check_real(time, "time")
        speeds = self._speeds(rpm, signal.shape[1])
        start, windows = self._stream.push(np.vstack([signal, speeds]), time)
        verdicts = []
        for first in range(0, len(windows), _BATCH):
            batch = windows[first : first + _BATCH]
            verdicts += self._judged(batch, start + first * self._settings.hop)
        return verdicts

    def calibrate(self, samples: ArrayLike, *, rpm: float | None = None) -> Self:
        """Measure how often, and in what runs, healthy windows exceed the limits.

        Both numbers are means of a Beta(1, 1) posterior, near 1/2 with few windows.
        Several recordings add up. The monitor starts again without samples.

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
            If there are no healthy limits, or healthy windows exceed them too often.
        """
        expected = "a detector, or a diagnoser with limits"
        expect(self._judge.limits.exist, "detector", None, expected)
        self._start_afresh()
        verdicts = self.update(samples, rpm=rpm)
        self._start_afresh()
        runs = self._runs + runs_of([verdict.exceeds for verdict in verdicts])
        self._alarm = self._new_alarm(runs)
        self._runs = runs
        return self

    def _speeds(self, rpm, n_samples):
        """Return the speed at each sample, NaN if it is not known, and keep the last."""
        before = np.nan if self._rpm is None else self._rpm
        if rpm is None:
            return np.full(n_samples, before)
        speeds = speeds_of_samples(rpm, n_samples, before)
        is_array = np.ndim(rpm) > 0
        self._varies = self._varies or is_array
        self._rpm = float(np.append(before, speeds)[-1] if is_array else rpm)
        return speeds

    def _judged(self, windows, start):
        """Return the verdicts on windows of samples and speeds."""
        samples = windows[:, 0] if self._n_channels == 1 else windows[:, :-1]
        speeds = windows[:, -1]
        middle = speeds[:, speeds.shape[1] // 2]
        rpm = None if self._rpm is None else middle
        if self._varies:
            rpm = np.where(np.isnan(speeds), middle[:, np.newaxis], speeds)
        results = self._judge.window_results(np.ascontiguousarray(samples), rpm)
        columns = [column.tolist() for column in results.columns.values()]
        judged = []
        for row, values in enumerate(zip(*columns, strict=True)):
            record = dict(zip(results.columns, values, strict=True))
            record["rpm"] = float(middle[row])
            judged.append(self._judged_window(results, row, record, start))
            start += self._settings.hop
        return with_recent_verdicts(self._judge, judged)

    def _judged_window(self, results, row, record, start):
        """Count a window, and return all but the verdict by recent windows."""
        end = self._stream.time_of(start + self._settings.window_length)
        self._recent.move_to(end)
        self._recent.add_p_value(record.get("p-value", np.nan))
        exceeds = None
        if not math.isnan(record["alarm"]):
            exceeds = bool(record["alarm"])
            self._alarm.add(exceeds)
        quality = record["quality"]
        window_verdict = verdict = means = None
        if quality == "good" and results.refusal[row] != "":
            quality = NO_VERDICT
            window_verdict = verdict = record["verdict"]
        else:
            if quality == "good":
                self._recent.add(results, row)
                window_verdict = record["verdict"] if self.conditions else None
            means = self._recent.means()
        self._qualities[quality] += 1
        alarm = self._alarm
        judged = MonitorVerdict(
            start=start,
            time=end,
            rpm=record["rpm"],
            quality=quality,
            quality_share=record["quality share"],
            window_verdict=window_verdict,
            verdict=verdict,
            probability=np.nan,
            exceeds=exceeds,
            alarm=alarm and (alarm.active or alarm.latched),
            alarm_level=alarm.level if alarm else np.nan,
            p_value=self._recent.p_value(),
            limits=record["limits"],
            alarm_state=self.alarm_state,
        )
        # A latched alarm is of earlier windows.
        return JudgedWindow(judged, means, alarm and alarm.active)

    def state(self) -> dict[str, Any]:
        """Return the state that `restore` continues from after a restart.

        Returns
        -------
        dict
            Plain numbers, texts, lists and dicts, which `save_monitor_state` writes.
        """
        return {
            "settings": self._saved_settings(),
            "seen": self._runs.tolist(),
            "rpm": self._rpm,
            "varies": self._varies,
            "qualities": dict(self._qualities),
            **{name: part.state() for name, part in self._parts().items()},
        }

    def _saved_settings(self):
        return {
            **asdict(self._settings),
            "n_channels": self._n_channels,
            "rate": self._judge.limits.rate,
            "conditions": [str(name) for name in self.conditions],
            "healthy": None if self.healthy is None else str(self.healthy),
            "train_rpm": [float(speed) for speed in self._judge.train_rpm],
        }

    def _parts(self):
        parts = {"stream": self._stream, **self._recent.parts}
        return parts | {"alarm": self._alarm} if self._alarm else parts

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
        before = self._runs
        try:
            for name, value in self._saved_settings().items():
                saved = state["settings"].get(name)
                expect(saved == value, name, saved, f"{value!r}, as this monitor")
            self._runs = np.array([saved_count(number) for number in state["seen"]])
            fits = self._runs.shape == (4,) and np.all(np.diff(self._runs) <= 0)
            expect(fits, "seen", state["seen"], "as many windows as exceed, or more")
            self._start_afresh()
            for name, part in self._parts().items():
                part.restore(state[name])
            for quality, number in state["qualities"].items():
                self._qualities[str(quality)] = saved_count(number)
            self._varies = bool(state["varies"])
            self._rpm = None if state["rpm"] is None else float(state["rpm"])
        # Errors of damaged states are as varied as the damage.
        except Exception as error:
            self._runs = before
            self._start_afresh()
            raise ValueError(
                f"state of another monitor, or damaged: {error}"
            ) from error
        return self
