"""A fitted diagnoser on a running sensor."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from numbers import Integral
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.utils import check_scalar

from .._answers import answers
from .._validation import check_real
from ..speeds import SPEED_FACTOR
from ..verdicts import CHANGED, NO_VERDICT, SMALLEST_PROBABILITY, Judge, no_verdict
from .memory import CumulativeSumAlarm, FadingEvidence, FadingPValue, healthy_windows, runs_of
from .windowing import WindowStream, check_count

#: Largest number of windows that are diagnosed together.
_BATCH = 256


class MonitorVerdict(NamedTuple):
    """Verdict of a `ConditionMonitor` when a window is complete.

    Parameters
    ----------
    start : int
        Number of samples before the window.
    time : float
        Time in seconds at the end of the window: on the clock of the blocks' times, or since the
        first sample if there are none.
    rpm : float
        Stated shaft speed in the middle of the window; NaN if there is none.
    quality : str
        ``"good"``; why the window carries no signal, see `signal_quality`; or ``"no verdict"``.
    window_verdict : object
        Condition of this window alone; ``"no verdict: ..."`` with the reason, such as an
        implausible speed; None if the window carries no signal or there is no classifier.
    verdict : object
        Condition by the evidence of all recent windows; ``"changed"`` if this is the healthy
        condition, or there is no classifier, while the alarm is on; ``"no verdict: ..."`` as for
        the window; None if no window within the half-life had a verdict.
    probability : float
        Probability of `verdict`; NaN if it is no condition.
    exceeds : bool or None
        Whether this window alone exceeds the healthy limits; None if they do not hold at its speed,
        or the window carries no signal.
    alarm : bool or None
        Whether the alarm is on; None if there are no healthy limits.
    alarm_level : float
        Cumulative sum over its limit, from 0 to 1; NaN if there are no healthy limits.
    p_value : float
        Probability that recent windows of the healthy machine deviate as much, from those for which
        the healthy limits hold; NaN without a detector, or if there was none within the half-life.
    limits : str
        ``"hold"``, or why the healthy limits do not hold at the speed of the window.
    """

    start: int
    time: float
    rpm: float
    quality: str
    window_verdict: object
    verdict: object
    probability: float
    exceeds: bool | None
    alarm: bool | None
    alarm_level: float
    p_value: float
    limits: str


class ConditionMonitor:
    """Diagnoser of a running sensor, from blocks of samples to verdicts.

    Blocks of any length are cut into windows across their borders. Each window that carries a
    signal is diagnosed by itself. Fading evidence turns the probabilities of the windows into a
    verdict. Page's cumulative sum turns windows that exceed the healthy limits into an alarm with a
    stated rate of false alarms. Windows without a signal (NaN, a dead channel, dropouts), windows
    at an implausible speed and gaps between blocks are counted. Meanwhile the evidence grows older,
    and the cumulative sum stays.

    The same samples in other blocks give the same verdicts, to the last bit. The monitor keeps less
    than one window of samples and a few numbers, for any time.

    Use :func:`recording_verdicts` instead for a recording that is complete.

    Parameters
    ----------
    diagnoser : fitted classifier or None
        Classifier with probabilities, such as the result of `make_diagnoser`. None: there is only a
        detector.
    sampling_rate : float
        In Hz.
    conditions : sequence of label, default=None
        Order of the conditions, the healthy one first: a permutation of those of the diagnoser. For
        a detector alone, the name of the healthy condition. None: sorted, or ``["healthy"]``.
    detector : fitted Pipeline or None, default=None
        Detector with the healthy limits, such as the result of `make_detector`, fitted on windows
        of the same length. None: the detection threshold of the diagnoser, which holds at its
        training speeds only. Without a stated speed, the machine is taken to run at one of these.
    window_length : int, default=1200
        Samples in a window of `fit`.
    hop : int or None, default=None
        Samples from the start of one window to the start of the next. None: `window_length`.
    half_life : float, default=10.0
        Seconds in which the weight of evidence halves, above 0; infinity for no fading.
    false_alarm_interval : float, default=1000.0
        Mean number of hours of signal between false alarms, above 0.
    persistence : float, default=0.5
        Probability in (0, 1) that a healthy window exceeds the limits after one that did, for
        windows that do not overlap. Such windows come in runs, because load and speed of a machine
        last longer than a window; 0.5 means runs of two. `calibrate` measures it.
    faulty_rate : float, default=0.5
        Share in (0, 1) of windows which exceed the limits that the alarm is to detect soonest.
    gap_tolerance : float or None, default=None
        Seconds by which the stated time of a block may differ from the end of the block before.
        Beyond it there is a gap, and a new window starts. None: half a window.
    train_rpm : sequence of float, default=()
        Training speeds. Empty: those that the models state.
    speed_factor : float, default=5.0
        Windows whose stated speed lies farther than this factor, at least 1, outside the training
        speeds get no verdict.

    Attributes
    ----------
    conditions : list
        Conditions of the diagnoser; empty if there is none.
    healthy : label or None
        The healthy condition; None if it is not known.
    counts : dict
        Numbers of samples, windows by their quality, gaps, missing seconds, clock steps back and
        alarms.

    Raises
    ------
    ValueError
        If a parameter is out of its range, the diagnoser has no probabilities, or no alarm can be
        as rare as stated.

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

    conditions: list[Any]
    healthy: Any

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
        persistence: float = 0.5,
        faulty_rate: float = 0.5,
        gap_tolerance: float | None = None,
        train_rpm: Any = (),
        speed_factor: float = SPEED_FACTOR,
    ) -> None:
        check_scalar(window_length, "window_length", Integral, min_val=1)
        hop = window_length if hop is None else check_scalar(hop, "hop", Integral, min_val=1)
        positive = {"sampling_rate": sampling_rate, "false_alarm_interval": false_alarm_interval}
        positive |= {} if half_life == np.inf else {"half_life": half_life}
        for name, value in positive.items():
            check_real(value, name, min_val=0, include_boundaries="neither")
        if gap_tolerance is None:
            gap_tolerance = 0.5 * window_length / sampling_rate
        check_real(gap_tolerance, "gap_tolerance", min_val=0)
        _check_shares(persistence=persistence, faulty_rate=faulty_rate)
        self._judge = Judge(
            diagnoser,
            conditions=conditions,
            detector=detector,
            train_rpm=train_rpm,
            speed_factor=speed_factor,
            same_speed=True,
        )
        can = answers(detector if diagnoser is None else diagnoser)
        self._names = can.conditions is not None
        self._n_channels, self._frames_first = can.n_channels, None
        self.conditions = self._judge.conditions if self._names else []
        self.healthy = self._judge.healthy
        self._windowing = {
            "window_length": int(window_length),
            "hop": int(hop),
            "sampling_rate": float(sampling_rate),
            "gap_tolerance": float(gap_tolerance),
        }
        self._half_life, self._faulty_rate = float(half_life), float(faulty_rate)
        self._run_length = false_alarm_interval * 3600 * sampling_rate / hop
        self._healthy = {
            "rate": self._judge.alarm_rate,
            # Windows that share samples exceed together.
            "persistence": max(float(persistence), 1 - hop / window_length),
        }
        self._seen = Counter()
        self._start_afresh()

    def _start_afresh(self):
        self._stream = WindowStream(**self._windowing)
        self._evidence = FadingEvidence(len(self.conditions), self._half_life)
        self._deviation = FadingPValue(self._half_life)
        self._alarm = None
        if self._judge.detects:
            self._alarm = CumulativeSumAlarm(
                self._run_length, faulty_rate=self._faulty_rate, **self._healthy
            )
        self._qualities, self._last_start, self._speeds = Counter(), None, []

    @property
    def counts(self) -> dict[str, Any]:
        """Return what was counted so far: see the class."""
        return {
            "samples": self._stream.n_samples,
            "windows": dict(self._qualities),
            "gaps": self._stream.n_gaps,
            "missing_seconds": self._stream.missing_seconds,
            "clock_steps_back": self._stream.n_steps_back,
            "alarms": 0 if self._alarm is None else self._alarm.n_raised,
        }

    def update(
        self, samples: ArrayLike, *, time: float | None = None, rpm: ArrayLike | None = None
    ) -> list[MonitorVerdict]:
        """Add the next block, and return a verdict for each window that is complete now.

        Parameters
        ----------
        samples : array-like of shape (n_samples,) or (n_channels, n_samples)
            Any number of real samples in the unit of `fit`. Of several channels, the first is the
            output. The shape (n_samples, n_channels) is accepted, too, if it cannot be mistaken for
            the other one. NaN is a missing sample.
        time : float or None, default=None
            Time of the first sample, in seconds on any clock. None: the block follows the block
            before.
        rpm : float, array-like of shape (n_samples,) or None, default=None
            Shaft speed from here on, or at each sample; NaN within an array is the speed before.
            None: as before. A window has the speed at its middle.

        Returns
        -------
        list of MonitorVerdict
            In the order of time; empty if no window became complete.

        Raises
        ------
        ValueError
            If the samples are not real numbers, or have another number of channels than the model;
            if there is not one speed, or one for each sample.
        """
        signal = self._check_samples(samples)
        if time is not None:
            check_real(time, "time")
        if rpm is not None:
            self._note_speeds(rpm, signal.shape[1])
        verdicts = []
        for start, windows, gap in self._stream.push(signal, time):
            for first in range(0, len(windows), _BATCH):
                batch = np.ascontiguousarray(windows[first : first + _BATCH])
                begin = start + first * self._stream.hop
                verdicts += self._judged(batch, begin, gap if first == 0 else 0.0)
        return verdicts

    def calibrate(self, samples: ArrayLike, *, rpm: float | None = None) -> Self:
        """Measure how often, and in what runs, healthy windows exceed the limits.

        Both numbers are means of a Beta(1, 1) posterior: with few windows, the estimates stay near
        1/2. Several recordings add up. The monitor starts again without samples.

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
            If there are no healthy limits, or healthy windows exceed them so often that no alarm
            can be as rare as stated.
        """
        if not self._judge.detects:
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
        """Samples of shape (n_channels, n_samples)."""
        signal, n = np.asarray(samples), self._n_channels
        if signal.dtype.kind not in "iuf" or signal.ndim not in (1, 2):
            raise ValueError(
                f"samples of type {signal.dtype} and shape {signal.shape}, expected real numbers "
                f"of shape (n_samples,) or ({n}, n_samples)"
            )
        is_empty_or_plain = signal.ndim == 1 and (n == 1 or signal.size == 0)
        if not is_empty_or_plain and (signal.ndim == 1 or n not in signal.shape):
            raise ValueError(
                f"samples of shape {signal.shape}, expected {n} channels as in fit: "
                f"({n}, n_samples)"
            )
        if signal.ndim == 2 and signal.shape != (n, n):
            frames_first = signal.shape[0] != n
            if self._frames_first not in (None, frames_first):
                raise ValueError(
                    f"samples of shape {signal.shape}, expected channels along axis "
                    f"{int(self._frames_first)} as in the blocks before"
                )
            self._frames_first = frames_first
        if signal.ndim == 2 and self._frames_first:
            signal = signal.T
        return signal.reshape(n, -1).astype(np.float64, copy=False)

    def _judged(self, windows, start, gap):
        speeds = self._speeds_at(start, windows)
        found = self._judge.opinions(windows[:, 0] if self._n_channels == 1 else windows, speeds)
        verdicts = []
        for i, quality in enumerate(found.quality.tolist()):
            begin = start + i * self._stream.hop
            passed = 0 if self._last_start is None else begin - self._last_start
            self._last_start = begin
            seconds = passed / self._stream.sampling_rate + (gap if i == 0 else 0.0)
            self._evidence.pass_time(seconds)
            self._deviation.pass_time(seconds)
            if not np.isnan(found.p_value[i]):
                self._deviation.add(found.p_value[i])
            end = self._stream.time_of(begin + self._stream.window_length)
            is_refused = quality == "good" and found.refusal[i] != ""
            quality = NO_VERDICT if is_refused else quality
            self._qualities[quality] += 1
            exceeds = None if np.isnan(found.exceeds[i]) else bool(found.exceeds[i])
            if exceeds is not None and self._alarm is not None:
                self._alarm.add(exceeds)
            alarm, level = None, np.nan
            if self._alarm is not None:
                alarm, level = self._alarm.active, self._alarm.sum / self._alarm.limit
            said = self._conditions(found, i, quality, alarm)
            rpm = np.nan if speeds is None else float(speeds[i])
            p_value, limits = self._deviation.p_value(), str(found.limits[i])
            verdicts.append(
                MonitorVerdict(
                    begin, end, rpm, quality, *said, exceeds, alarm, level, p_value, limits
                )
            )
        return verdicts

    def _conditions(self, found, i, quality, alarm):
        """Verdict of the window, verdict of all windows, and its probability."""
        if quality == NO_VERDICT:
            return (no_verdict(found.refusal[i]),) * 2 + (np.nan,)
        if not self._names:
            if quality == "good":
                self._evidence.add(np.zeros(0))
            is_known = self._evidence.age <= self._half_life
            return None, (CHANGED if alarm else self.healthy) if is_known else None, np.nan
        window_verdict = None
        if quality == "good":
            logs = np.log(np.maximum(found.probability[i], SMALLEST_PROBABILITY))
            self._evidence.add(logs)
            window_verdict = self.conditions[int(logs.argmax())]
        probability = self._evidence.probabilities()
        if probability is None:
            return window_verdict, None, np.nan
        best = int(probability.argmax())
        if alarm and self.conditions[best] == self.healthy:
            return window_verdict, CHANGED, np.nan
        return window_verdict, self.conditions[best], float(probability[best])

    def _note_speeds(self, rpm, n_samples):
        """Note where the speed changes."""
        if np.ndim(rpm) == 0:
            self._speeds.append((self._stream.n_samples, _number(rpm)))
            return
        rpm = np.asarray(rpm, dtype=np.float64)
        if rpm.shape != (n_samples,):
            raise ValueError(f"rpm of shape {rpm.shape}, expected one speed or ({n_samples},)")
        known = np.concatenate([[self._speeds[-1][1] if self._speeds else np.nan], rpm])
        latest = np.maximum.accumulate(np.where(np.isnan(known), 0, np.arange(len(known))))
        known = known[latest]
        is_new = (known[1:] != known[:-1]) & ~np.isnan(known[1:])
        if not self._speeds and n_samples > 0:
            is_new[0] = True
        places = np.flatnonzero(is_new)
        samples = (self._stream.n_samples + places).tolist()
        self._speeds += zip(samples, known[1:][places].tolist(), strict=True)

    def _speeds_at(self, start, windows):
        """Speed in the middle of each window, or None if none was stated so far."""
        middle = start + self._stream.window_length // 2
        middles = middle + self._stream.hop * np.arange(len(windows))
        changes = np.array([sample for sample, _ in self._speeds])
        current = np.searchsorted(changes, middles, "right") - 1
        if not self._speeds:
            return None
        # A window whose middle is before the first stated speed takes that one.
        current = np.maximum(current, 0)
        speeds = np.array([rpm for _, rpm in self._speeds])[current]
        del self._speeds[: current[-1]]
        return speeds

    def state(self) -> dict[str, Any]:
        """Return the state that `restore` continues from after a restart.

        Returns
        -------
        dict
            Plain numbers, texts, lists and dicts, and one array: the samples of the incomplete
            window. `save_monitor_state` writes it to a file.
        """
        return {
            "settings": self._settings(),
            "healthy": dict(self._healthy),
            "seen": dict(self._seen),
            "frames_first": self._frames_first,
            "last_start": self._last_start,
            "speeds": [list(change) for change in self._speeds],
            "stream": self._stream.state(),
            "qualities": dict(self._qualities),
            "evidence": self._evidence.state(),
            "deviation": self._deviation.state(),
            "alarm": None if self._alarm is None else self._alarm.state(),
        }

    def _settings(self):
        return self._windowing | {
            "conditions": [str(name) for name in self.conditions],
            "healthy": None if self.healthy is None else str(self.healthy),
            "n_channels": self._n_channels,
            "half_life": self._half_life,
            "run_length": self._run_length,
            "faulty_rate": self._faulty_rate,
            "train_rpm": [float(speed) for speed in self._judge.train_rpm],
            "alarm_rate": self._judge.alarm_rate,
        }

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
            If the state has other settings, conditions, channels or training speeds, or is damaged.
            The monitor is then as after its construction.
        """
        settings = state.get("settings") if isinstance(state, dict) else None
        if not isinstance(settings, dict):
            raise ValueError(f"state is a {type(state).__name__}, expected the result of `state`")
        for name, value in self._settings().items():
            if settings.get(name) != value:
                raise ValueError(f"state: {name} is {settings.get(name)!r}, expected {value!r}")
        before = self._healthy, self._seen
        try:
            self._take_over(state)
        # Errors of damaged states are as varied as the damage.
        except Exception as error:
            (self._healthy, self._seen), self._frames_first = before, None
            self._start_afresh()
            raise ValueError(f"state is damaged: {error}") from error
        return self

    def _take_over(self, state):
        """Take all values of `state`, or raise an error."""
        healthy = {name: state["healthy"][name] for name in self._healthy}
        if self._judge.detects:
            _check_shares(**healthy)
        self._healthy = healthy
        self._seen = Counter({str(name): check_count(n) for name, n in state["seen"].items()})
        self._start_afresh()
        self._stream.restore(state["stream"])
        self._evidence.restore(state["evidence"])
        self._deviation.restore(state["deviation"])
        if self._alarm is not None:
            self._alarm.restore(state["alarm"])
        qualities = {str(name): check_count(n) for name, n in state["qualities"].items()}
        self._qualities = Counter(qualities)
        last_start, rest = state["last_start"], state["stream"]["rest"]
        self._last_start = None if last_start is None else check_count(last_start)
        if rest is not None and len(rest) != self._n_channels:
            raise ValueError(f"state: {len(rest)} channels wait, expected {self._n_channels}")
        if state["frames_first"] not in (None, True, False):
            raise ValueError(f"state: frames_first is {state['frames_first']!r}")
        self._frames_first = state["frames_first"]
        speeds = [(check_count(sample), _number(rpm)) for sample, rpm in state["speeds"]]
        if speeds != sorted(speeds, key=lambda change: change[0]):
            raise ValueError("state: changes of speed are not in the order of time")
        self._speeds = speeds


def _check_shares(**shares):
    for name, value in shares.items():
        check_real(value, name, min_val=0, max_val=1, include_boundaries="neither")


def _number(rpm):
    """A stated speed, also one that is not plausible."""
    try:
        return float(rpm)
    except (TypeError, ValueError) as error:
        raise ValueError(f"rpm == {rpm!r}, expected a number") from error
