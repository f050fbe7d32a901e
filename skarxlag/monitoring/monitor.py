"""A fitted diagnoser on a running sensor."""

from __future__ import annotations

from collections import Counter
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from .._validation import check_real
from ..quality import signal_quality
from .alarm import CumulativeSumAlarm, healthy_windows, runs_of
from .evidence import FadingEvidence
from .memory import VerdictMemory
from .opinions import WindowOpinions
from .own_windows import DetectorOnOwnWindows
from .settings import check_count, checked_memory, checked_windowing
from .verdict import MonitorVerdict
from .windowing import WindowStream

#: Windows that are diagnosed together: many blocks bring fewer, and a long one is cut.
_BATCH = 256

#: What a state raises that is none.
_DAMAGED = (ValueError, KeyError, TypeError, AttributeError, IndexError, OverflowError)


class ConditionMonitor:
    """A fitted diagnoser on a running sensor: samples in, verdicts out.

    Blocks of any length are cut into windows across their borders. Each window that carries a
    signal is diagnosed by itself. Two memories make a verdict and an alarm of them: evidence that
    fades, and Page's cumulative sum with a stated rate of false alarms. Windows without a signal
    (NaN, a dead channel, dropouts) and gaps between blocks are counted; the evidence grows older
    meanwhile, and the cumulative sum waits.

    The same samples in other blocks give the same verdicts, to the last bit. The memory does not
    grow with time: less than one window of samples is kept, and a few numbers.

    Parameters
    ----------
    diagnoser : fitted classifier or None
        Tells conditions apart and states probabilities, such as what `make_diagnoser` gives. None:
        there is only a detector.
    sampling_rate : float
        In Hz.
    detector : fitted Pipeline or None, default=None
        Tells healthy from faulty windows, such as what `make_detector` gives. None: the detection
        threshold of the diagnoser, which holds at its training speed only.
    window_length : int, default=1200
        Samples in a window: those that the diagnoser was fitted on.
    detector_window_length : int or None, default=None
        Samples in a window of the detector, where it was fitted on others than the diagnoser. They
        neither overlap nor leave gaps. A verdict then tells what those said that ended since the
        verdict before. None: `window_length`, and the detector sees the windows of the diagnoser.
    hop : int or None, default=None
        Samples from the start of one window to the start of the next. None: `window_length`.
    half_life : float, default=10.0
        Seconds in which the weight of evidence halves, above 0; infinity forgets nothing.
    false_alarm_interval : float, default=1000.0
        Mean number of hours of signal between false alarms, above 0.
    window_false_alarm_rate : float or None, default=None
        Share in (0, 1) of healthy windows that exceed the detection threshold. None: the
        `false_alarm_rate` that the last step of the detector was fitted with.
    persistence : float, default=0.5
        Probability in (0, 1) that a healthy window exceeds the threshold after one that did, for
        windows that do not overlap. Such windows come in runs, since a machine's load and speed
        last longer than a window; 0.5 stands for runs of two. `calibrate` measures it.
    faulty_rate : float, default=0.5
        Share in (0, 1) of windows which exceed the threshold that the alarm shall find soonest.
    gap_tolerance : float or None, default=None
        Seconds by which the stated time of a block may differ from the time that the blocks before
        it lead to expect. Beyond it there is a gap, and windows start afresh. None: half a window.

    Attributes
    ----------
    conditions : list
        Those that the diagnoser knows.
    counts : dict
        Samples, windows by their quality, gaps, seconds missing, clock steps back, alarms.

    Raises
    ------
    ValueError
        If a parameter is out of its range, the diagnoser states no probabilities, or no alarm can
        be as rare as is asked for.

    See Also
    --------
    window_verdicts : Verdicts on the windows of a recording that is complete.

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

    conditions: list[Any]

    def __init__(
        self,
        diagnoser: Any,
        sampling_rate: float,
        *,
        detector: Any = None,
        window_length: int = 1200,
        detector_window_length: int | None = None,
        hop: int | None = None,
        half_life: float = 10.0,
        false_alarm_interval: float = 1000.0,
        window_false_alarm_rate: float | None = None,
        persistence: float = 0.5,
        faulty_rate: float = 0.5,
        gap_tolerance: float | None = None,
    ) -> None:
        self._windowing = checked_windowing(window_length, hop, sampling_rate, gap_tolerance)
        memory = checked_memory(half_life, false_alarm_interval, persistence, faulty_rate)
        self._half_life, self._faulty_rate = memory["half_life"], memory["faulty_rate"]
        hop, window_length = self._windowing["hop"], self._windowing["window_length"]
        self._own = None
        if detector_window_length not in (None, window_length):
            self._own = self._detector_alone(
                diagnoser,
                detector,
                sampling_rate,
                window_length=detector_window_length,
                false_alarm_interval=false_alarm_interval,
                window_false_alarm_rate=window_false_alarm_rate,
                persistence=persistence,
                faulty_rate=faulty_rate,
                gap_tolerance=self._windowing["gap_tolerance"],
            )
        self._opinions = WindowOpinions(diagnoser, detector, detects=self._own is None)
        self.conditions = self._opinions.conditions
        self._run_length = false_alarm_interval * 3600 * sampling_rate / hop
        if window_false_alarm_rate is None:
            window_false_alarm_rate = self._opinions.false_alarm_rate
        if self._opinions.detects:
            check_real(
                window_false_alarm_rate,
                "window_false_alarm_rate",
                min_val=0,
                max_val=1,
                include_boundaries="neither",
            )
        self._healthy = {
            "rate": window_false_alarm_rate,
            # Windows that share samples exceed together.
            "persistence": max(float(persistence), 1 - hop / window_length),
        }
        self._seen, self._n_channels = Counter(), None
        self._start_afresh()

    def _detector_alone(self, diagnoser, detector, sampling_rate, **settings):
        if diagnoser is None or detector is None:
            raise ValueError(
                f"detector_window_length={settings['window_length']!r}, expected None without both "
                "a diagnoser and a detector"
            )
        monitor = ConditionMonitor(None, sampling_rate, detector=detector, **settings)
        return DetectorOnOwnWindows(monitor, settings["window_length"])

    def _start_afresh(self):
        self._stream = WindowStream(**self._windowing)
        alarm = None
        if self._opinions.detects:
            alarm = CumulativeSumAlarm(
                self._run_length, faulty_rate=self._faulty_rate, **self._healthy
            )
        evidence = FadingEvidence(len(self.conditions), self._half_life)
        self._memory = VerdictMemory(self.conditions, evidence, alarm)
        self._last_start, self._speeds = None, []
        if self._own is not None:
            self._own.start_afresh()

    @property
    def counts(self) -> dict[str, Any]:
        """What came so far: see the class."""
        alarm = self._memory.alarm
        n_raised = 0 if alarm is None else alarm.n_raised
        return {
            "samples": self._stream.n_samples,
            "windows": dict(self._memory.qualities),
            "gaps": self._stream.n_gaps,
            "missing_seconds": self._stream.missing_seconds,
            "clock_steps_back": self._stream.n_steps_back,
            "alarms": n_raised if self._own is None else self._own.monitor.counts["alarms"],
        }

    def update(
        self, samples: ArrayLike, *, time: float | None = None, rpm: float | None = None
    ) -> list[MonitorVerdict]:
        """Take the next block, and give a verdict for each window that is complete now.

        Parameters
        ----------
        samples : array-like of shape (n_samples,) or (n_channels, n_samples)
            Real samples in the unit that the diagnoser was fitted on, any number of them; of
            several channels the output is the first. NaN stands for samples that are missing.
        time : float or None, default=None
            When the first of them was taken, in seconds on any clock. None: right after the block
            before.
        rpm : float or None, default=None
            Nominal shaft speed from here on, for a diagnoser that uses it.

        Returns
        -------
        list of MonitorVerdict
            In the order of time; empty where no window became complete.

        Raises
        ------
        ValueError
            If the samples are not real numbers, or of another number of channels than before.
        """
        signal = self._check_samples(samples)
        if time is not None:
            check_real(time, "time")
        if rpm is not None:
            check_real(rpm, "rpm", min_val=0, include_boundaries="neither")
            self._speeds.append((self._stream.n_samples, float(rpm)))
        if self._own is not None:
            self._own.update(samples, time, rpm)
        verdicts = []
        for start, windows, gap in self._stream.push(signal, time):
            for first in range(0, len(windows), _BATCH):
                batch = np.ascontiguousarray(windows[first : first + _BATCH])
                begin = start + first * self._stream.hop
                verdicts += self._judge(batch, begin, gap if first == 0 else 0.0)
        if self._own is not None:
            length = self._stream.window_length
            verdicts = [self._own.told_by(each.start + length, each) for each in verdicts]
        return verdicts

    def calibrate(self, samples: ArrayLike, *, rpm: float | None = None) -> Self:
        """Learn from healthy samples how often, and in what runs, healthy windows exceed.

        Both numbers are means of a Beta(1, 1) posterior, so few windows claim little. Recordings
        that are given one after another add up. What was received so far is dropped: the monitor
        starts afresh.

        Parameters
        ----------
        samples : array-like of shape (n_samples,) or (n_channels, n_samples)
            One recording of the healthy machine, which the detector was not fitted on.
        rpm : float or None, default=None
            As in `update`.

        Returns
        -------
        ConditionMonitor
            This monitor.

        Raises
        ------
        ValueError
            If nothing detects, or healthy windows exceed so often that no alarm can be as rare as
            is asked for.
        """
        if self._own is not None:
            self._own.monitor.calibrate(samples, rpm=rpm)
            self._start_afresh()
            return self
        if not self._opinions.detects:
            raise ValueError("calibrate: the monitor has no detector, so there is no alarm")
        self._start_afresh()
        exceeds = [v.exceeds for v in self.update(samples, rpm=rpm) if v.exceeds is not None]
        seen = self._seen + runs_of(exceeds)
        before, self._healthy = self._healthy, healthy_windows(seen)
        try:
            self._start_afresh()
        except ValueError:
            self._healthy = before
            self._start_afresh()
            raise
        self._seen = seen
        return self

    def _check_samples(self, samples):
        signal = np.asarray(samples)
        if signal.dtype.kind not in "iuf" or signal.ndim not in (1, 2) or signal.shape[:-1] == (0,):
            raise ValueError(
                f"samples of type {signal.dtype} and shape {signal.shape}, expected real numbers "
                "of shape (n_samples,) or (n_channels, n_samples)"
            )
        n_channels = 1 if signal.ndim == 1 else len(signal)
        if self._n_channels not in (None, n_channels):
            raise ValueError(
                f"samples of {n_channels} channels, expected {self._n_channels} as in the blocks "
                "before"
            )
        self._n_channels = n_channels
        return np.atleast_2d(signal).astype(np.float64, copy=False)

    def _judge(self, windows, start, gap):
        rpm = self._speeds_at(start, len(windows))
        windows = windows[:, 0] if self._n_channels == 1 else windows
        quality = signal_quality(windows)
        good = np.flatnonzero(quality == "good")
        found = self._opinions.of(windows[good], None if rpm is None else rpm[good])
        verdicts = []
        place = np.cumsum(quality == "good") - 1
        for i, kind in enumerate(quality.tolist()):
            begin = start + i * self._stream.hop
            passed = 0 if self._last_start is None else begin - self._last_start
            self._last_start = begin
            log_probability, exceeds = found.window(place[i] if kind == "good" else None)
            verdicts.append(
                self._memory.judge(
                    begin,
                    self._stream.time_of(begin + self._stream.window_length),
                    passed / self._stream.sampling_rate + (gap if i == 0 else 0.0),
                    kind,
                    log_probability,
                    exceeds,
                )
            )
        return verdicts

    def _speeds_at(self, start, n_windows):
        """Speed at the start of each window, and None where none was ever given."""
        starts = start + self._stream.hop * np.arange(n_windows)
        changes = np.array([sample for sample, _ in self._speeds])
        current = np.searchsorted(changes, starts, "right") - 1
        if not self._speeds or current[0] < 0:
            return None
        speeds = np.array([rpm for _, rpm in self._speeds])[current]
        del self._speeds[: current[-1]]
        return speeds

    def state(self) -> dict[str, Any]:
        """All that the next verdicts depend on, for `restore` after a restart.

        Returns
        -------
        dict
            Plain numbers, texts, lists and dicts, and one array: the samples of the window that is
            not complete yet. `save_monitor_state` writes it into a file.
        """
        return {
            "settings": self._settings(),
            "healthy": dict(self._healthy),
            "seen": dict(self._seen),
            "n_channels": self._n_channels,
            "last_start": self._last_start,
            "speeds": [list(change) for change in self._speeds],
            "stream": self._stream.state(),
            "memory": self._memory.state(),
            "own": None if self._own is None else self._own.state(),
        }

    def _settings(self):
        return self._windowing | {
            "conditions": [str(name) for name in self.conditions],
            "half_life": self._half_life,
            "run_length": self._run_length,
            "faulty_rate": self._faulty_rate,
            "detector_window_length": None if self._own is None else self._own.length,
        }

    def restore(self, state: dict[str, Any]) -> Self:
        """Go on where another monitor with the same settings was.

        Parameters
        ----------
        state : dict
            What `state` gave.

        Returns
        -------
        ConditionMonitor
            This monitor.

        Raises
        ------
        ValueError
            If the state is of other settings or conditions, or is damaged; the monitor is then as
            after its construction.
        """
        settings = state.get("settings") if isinstance(state, dict) else None
        if not isinstance(settings, dict):
            raise ValueError(f"state is a {type(state).__name__}, expected what `state` gave")
        for name, value in self._settings().items():
            if settings.get(name) != value:
                raise ValueError(f"state: {name} is {settings.get(name)!r}, expected {value!r}")
        before = self._healthy, self._seen, self._n_channels
        try:
            self._take_over(state)
        except _DAMAGED as error:
            self._healthy, self._seen, self._n_channels = before
            self._start_afresh()
            raise ValueError(f"state is damaged: {error}") from error
        return self

    def _take_over(self, state):
        """Set all that `state` gives; whatever is wrong with it is an error."""
        if self._opinions.detects:
            for name in self._healthy:
                value = state["healthy"][name]
                check_real(value, name, min_val=0, max_val=1, include_boundaries="neither")
        self._healthy = {name: state["healthy"][name] for name in self._healthy}
        self._seen = Counter({str(name): check_count(n) for name, n in state["seen"].items()})
        self._start_afresh()
        self._stream.restore(state["stream"])
        self._memory.restore(state["memory"])
        if self._own is not None:
            self._own.restore(state["own"])
        n_channels, last_start = state["n_channels"], state["last_start"]
        self._n_channels = None if n_channels is None else check_count(n_channels, least=1)
        self._last_start = None if last_start is None else check_count(last_start)
        rest = state["stream"]["rest"]
        if rest is not None and len(rest) != self._n_channels:
            raise ValueError(f"state: {len(rest)} channels wait, expected {self._n_channels}")
        speeds = [(check_count(sample), rpm) for sample, rpm in state["speeds"]]
        for _, rpm in speeds:
            check_real(rpm, "rpm", min_val=0, include_boundaries="neither")
        if speeds != sorted(speeds, key=lambda change: change[0]):
            raise ValueError("state: changes of speed are not in the order of time")
        self._speeds = speeds
