"""A fitted diagnoser on a running sensor."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from ..core.capabilities import capabilities
from ..core.fault_locations import NO_FINDING
from ..core.state import expect
from ..core.validation import ABOVE_0, check_count, check_flag, check_rate, check_real
from ..kernels.evidence import combined_score, p_value_score
from ..verdicts.judge import Judge
from ..verdicts.names import CHANGED, NO_VERDICT, POSSIBLY_CHANGED
from .alarm import CumulativeSumAlarm
from .recent import FadingEvidence
from .together import CutBlock, diagnose_together
from .verdict import MonitorVerdict
from .windows import WindowStream, checked_samples, saved_count, speeds_of_samples

#: Largest delay of an alarm in windows; the mean time between false alarms is computed
#: from it.
_LONGEST_DELAY = 1000
#: Fields of a verdict that its window alone has.
_OF_WINDOW = ("limits", "rms", "peak", "crest_factor")


class ConditionMonitor:
    """Diagnoser of a running sensor, from blocks of samples to verdicts.

    Blocks of any length are cut into windows across their borders. Each window that
    carries a signal is diagnosed by itself. The verdict follows from the fading mean of
    the evidence of the windows. Page's cumulative sum turns windows that exceed the
    healthy limits into an alarm with a stated rate of false alarms. Windows without a
    signal (NaN, a dead channel, dropouts), windows at an implausible speed and gaps
    between blocks are counted. Meanwhile the evidence grows older, and the cumulative
    sum stays.

    The same samples in other blocks give the same verdicts, to the last bit. Use
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
        window; 0.5 means runs of two.
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
    >>> verdicts[-1].window_verdict, verdicts[-1].time
    ('good', 1.2)
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
        train_rpm: Any = (),
    ) -> None:
        check_real(sampling_rate, "sampling_rate", **ABOVE_0)
        length = int(check_count(window_length, "window_length"))
        hop = length if hop is None else int(check_count(hop, "hop"))
        if half_life != np.inf:
            check_real(half_life, "half_life", **ABOVE_0)
        check_real(false_alarm_interval, "false_alarm_interval", **ABOVE_0)
        if alarm_delay is not None:
            alarm_delay = int(check_count(alarm_delay, "alarm_delay"))
            expected = f"at most {_LONGEST_DELAY}"
            expect(alarm_delay <= _LONGEST_DELAY, "alarm_delay", alarm_delay, expected)
        check_flag(latch, "latch")
        check_rate(persistence, "persistence")
        self._judge = Judge(
            diagnoser,
            same_speed=True,
            sampling_rate=sampling_rate,
            conditions=conditions,
            detector=detector,
            train_rpm=train_rpm,
        )
        described = capabilities(detector if diagnoser is None else diagnoser)
        self.conditions: list[Any] = []
        if described.conditions is not None:
            self.conditions = self._judge.conditions
        self.healthy: Any = self._judge.healthy
        # A saved state holds no numbers of NumPy.
        self._settings = {
            "sampling_rate": float(sampling_rate),
            "window_length": length,
            "hop": hop,
            "half_life": float(half_life),
            "false_alarm_interval": float(false_alarm_interval),
            "alarm_delay": alarm_delay,
            "persistence": float(persistence),
            "n_channels": described.n_channels,
            "rate": self._judge.limits.rate,
            "conditions": [str(name) for name in self.conditions],
            "healthy": None if self.healthy is None else str(self.healthy),
            "train_rpm": [float(speed) for speed in self._judge.train_rpm],
        }
        # Windows of monitors of the same models may be diagnosed together.
        self._models = (id(diagnoser), id(detector), *map(repr, self._settings.items()))
        self._latch = bool(latch)
        self._start_afresh()

    def _start_afresh(self):
        settings = self._settings
        length = settings["window_length"]
        hop = settings["hop"]
        rate = settings["sampling_rate"]
        # The shaft speed is one more channel.
        n_rows = settings["n_channels"] + 1
        self._stream = WindowStream(n_rows, length, hop, rate)
        half_life = settings["half_life"]
        self._evidence = FadingEvidence(self._judge.n_evidence, half_life)
        self._p_values = FadingEvidence(1, half_life)
        self._windows_an_hour = 3600 * rate / hop
        self._alarm: CumulativeSumAlarm | None = None
        if self._judge.limits.exist:
            self._alarm = CumulativeSumAlarm(
                settings["false_alarm_interval"] * self._windows_an_hour,
                self._judge.limits.rate,
                # Windows that share samples exceed together.
                max(settings["persistence"], 1 - hop / length),
                settings["alarm_delay"],
                self._latch,
            )
        self._qualities: Counter[str] = Counter()
        self._rpm: float | None = None
        self._varies = False

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
        return self._alarm and self._alarm.run_length() / self._windows_an_hour

    @property
    def alarm_state(self) -> str:
        """Return the state of the alarm, see `MonitorVerdict`."""
        return self._alarm.alarm_state if self._alarm else "none"

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
        return diagnose_together([self.cut(samples, time=time, rpm=rpm)])[0]

    def cut(
        self,
        samples: ArrayLike,
        *,
        time: float | None = None,
        rpm: ArrayLike | None = None,
    ) -> CutBlock:
        """Add the next block as `update` does, and return its windows for `diagnose_together`."""
        n_channels = self._settings["n_channels"]
        signal = checked_samples(samples, n_channels)
        if time is not None:
            check_real(time, "time")
        speeds = self._speeds(rpm, signal.shape[1])
        start, windows = self._stream.push(np.vstack([signal, speeds]), time)
        middle = windows[:, -1, windows.shape[2] // 2]
        rpm = None if self._rpm is None else middle
        if self._varies:
            is_missing = np.isnan(windows[:, -1])
            rpm = np.where(is_missing, middle[:, np.newaxis], windows[:, -1])
        rows = windows[:, 0] if n_channels == 1 else windows[:, :-1]
        return CutBlock(self, start, rows, middle, rpm)

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

    def _count(self, cut, row, result):
        """Count a window, and return the fields of its verdict, and the mean of recent ones."""
        settings = self._settings
        start = cut.start + row * settings["hop"]
        end = self._stream.time_of(start + settings["window_length"])
        self._evidence.move_to(end)
        self._p_values.move_to(end)
        if not math.isnan(result["p-value"]):
            self._p_values.add(p_value_score(result["p-value"]))
        p_value = np.nan
        if recent := self._p_values.mean():
            p_value = combined_score(recent[0].item(), recent[1])
        alarm = self._alarm
        exceeds = None
        if not math.isnan(result["alarm"]):
            exceeds = bool(result["alarm"])
            alarm.add(exceeds)
        quality = result["quality"]
        window_verdict = verdict = mean = None
        if quality == "good" and result["refusal"] != "":
            quality = NO_VERDICT
            window_verdict = verdict = result["verdict"]
        else:
            if quality == "good":
                self._evidence.add(result["evidence"])
                window_verdict = result["verdict"] if self.conditions else None
            mean = self._evidence.mean()
        self._qualities[quality] += 1
        fields = {
            "start": start,
            "time": end,
            "rpm": float(cut.middle[row]),
            "quality": quality,
            "quality_share": result["quality share"],
            "window_verdict": window_verdict,
            "verdict": verdict,
            "probability": np.nan,
            "exceeds": exceeds,
            "alarm": alarm and (alarm.active or alarm.latched),
            "alarm_level": alarm.level if alarm else np.nan,
            "p_value": p_value,
            "alarm_state": self.alarm_state,
            **{name: result[name] for name in _OF_WINDOW},
        }
        # A latched alarm is of earlier windows.
        return fields, mean, bool(alarm and alarm.active)

    def _named(self, fields, is_active, named):
        """Set the verdict by recent windows, which is not healthy if they exceed the limits."""
        verdict = named.verdict
        probability = named.probability
        is_against = fields["alarm_state"] == "not yet an alarm" or (
            fields["p_value"] < (self._judge.limits.rate or 0.0)
        )
        if verdict in (self.healthy, NO_FINDING) and (is_active or is_against):
            verdict = CHANGED if is_active else POSSIBLY_CHANGED
            probability = np.nan
        fields["verdict"] = verdict
        fields["probability"] = probability

    def state(self) -> dict[str, Any]:
        """Return the state that `restore` continues from after a restart.

        Returns
        -------
        dict
            Plain numbers, texts, lists and dicts, which `save_monitor_state` writes.
        """
        return {
            "settings": self._settings,
            "rpm": self._rpm,
            "varies": self._varies,
            "qualities": dict(self._qualities),
            **{name: part.state() for name, part in self._parts().items()},
        }

    def _parts(self):
        parts = {
            "stream": self._stream,
            "evidence": self._evidence,
            "p_values": self._p_values,
        }
        return parts | {"alarm": self._alarm} if self._alarm else parts

    def restore(self, state: dict[str, Any], *, pause: float = 0.0) -> Self:
        """Continue from the state of a monitor with the same settings.

        Parameters
        ----------
        state : dict
            Result of `state`.
        pause : float, default=0.0
            Seconds between the last sample before and the next one, at least 0, of
            which more than half a window is a gap.

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
        check_real(pause, "pause", min_val=0)
        try:
            for name, value in self._settings.items():
                saved = state["settings"].get(name)
                expect(saved == value, name, saved, f"{value!r}, as this monitor")
            self._start_afresh()
            for name, part in self._parts().items():
                part.restore(state[name])
            for quality, number in state["qualities"].items():
                self._qualities[str(quality)] = saved_count(number)
            self._varies = bool(state["varies"])
            self._rpm = None if state["rpm"] is None else float(state["rpm"])
        # Errors of damaged states are as varied as the damage.
        except Exception as error:
            self._start_afresh()
            raise ValueError(
                f"state of another monitor, or damaged: {error}"
            ) from error
        if pause > 0:
            stream = self._stream
            stream.note_time(stream.time_of(stream.n_samples) + pause)
        return self
