"""Models that diagnose recordings: a saved diagnoser, and the orders of a bearing."""

import argparse
import operator
import os
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache, partial
from hashlib import sha256
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import diagnosers
from ..core.capabilities import capabilities, unfolded_steps
from ..core.fault_locations import FAULTS, HEALTHY
from ..core.speeds import SPEED_FACTOR
from ..decisions.fault_orders import FaultOrderClassifier
from ..decisions.fusion import SensorFusion
from ..persistence.models import load_diagnoser
from ..recordings.files import chosen_channels
from ..recordings.listing import ListedRecording
from ..recordings.rates import NO_RATE, rates_agree, resampled_blocks, unit_advice
from ..recordings.windows import block_length, cut_blocks
from ..verdicts.healthy_limits import FEW_HEALTHY, HOLD_FOR_RECORDED, LEAST_HEALTHY
from ..verdicts.judge import Judge
from ..verdicts.names import CHANGED, NO_SIGNAL, UNCERTAIN, UNKNOWN
from ..verdicts.windows import HOLD, joined_tables
from .channels import channel_remarks, channels_of_model, plain_unit
from .diagnosis import Diagnosis, cancelled
from .messages import CommandError, as_command_error, counted, listed, printable
from .refused_rows import compares_orders, why_no_orders
from .velocity import velocity_rms

#: Titles and makers of the diagnosers that `evaluate` compares, in the order of its
#: tables.
DIAGNOSERS = {
    "alpio": ("ALPIO", diagnosers.make_alpio),
    "extended-state": ("Extended state", diagnosers.make_extended_state_pio),
    "diagnoser": ("Diagnoser", diagnosers.make_diagnoser),
}
#: Error on a recording of unknown speed, if combs decide alone.
NO_SPEED = "rpm is missing; expected --rpm, a column, or the file to state it"
#: Reservation to a healthy verdict of combs alone.
_NO_COMB = "Most ball faults show no comb."
#: Advice on verdicts that are no condition.
_ADVICE = {
    NO_SIGNAL: "No window carries a signal. Check the sensor, its cable and the logger.",
    UNKNOWN: "The recording resembles no condition of the model. Check the sensor, the speed, the "
    "load and the mounting. If they are as in training, the condition is new.",
    UNCERTAIN: "The recording is not healthy. The place of the fault is not certain.",
    CHANGED: "Changed: a new fault, or another load, mounting or sensor, can be the reason.",
}


def of_outputs(args: argparse.Namespace, model: Any) -> Any:
    """Return a model for the number of outputs in the arguments."""
    if args.outputs is None:
        return model
    return SensorFusion(estimator=model, n_outputs=args.outputs)


class SavedModel:
    """Diagnoser in a file, with its healthy limits, its known conditions and its facts.

    Facts that are missing from the file are read from the fitted steps. They are None
    if they are not known.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        with as_command_error():
            self.diagnoser, facts = load_diagnoser(path)
            self.identity = sha256(Path(path).read_bytes()).hexdigest()
        self.path, self.can = path, capabilities(self.diagnoser)
        self.takes_rpm = self.can.takes_rpm
        self.known = facts.pop("known_conditions", None)
        self.detector = facts.pop("detector", None)
        self.load = partial(
            _cached_model, os.path.abspath(path), os.stat(path).st_mtime_ns
        )
        self.judge = self._judge(facts)
        read = {
            "diagnoser": type(self.diagnoser).__name__,
            "conditions": self.judge.conditions,
            "healthy": self.judge.healthy,
            "train_rpm": self.judge.train_rpm or None,
            "sampling_rate": self.judge.sampling_rate,
            "window_length": self.can.window_length,
            "n_channels": self.can.n_channels,
        }
        self.facts = read | {
            name: value for name, value in facts.items() if value is not None
        }
        if self.known is not None:
            self.facts["false_rejection_rate"] = capabilities(self.known).stated_rate
        self.conditions, self.healthy = self.judge.conditions, self.judge.healthy
        self.window_length, self.n_channels = (
            self.facts["window_length"],
            self.facts["n_channels"],
        )
        self.sampling_rate, self.train_rpm = (
            self.judge.sampling_rate,
            self.judge.train_rpm,
        )
        self.summary = {"file": printable(path)} | self.facts
        self.rows = "stretches" if self.can.is_stretch else "windows"
        self.usual_channels = channels_of_model(self.facts)

    def _judge(self, facts):
        names = ("conditions", "train_rpm", "sampling_rate")
        stated = {name: facts[name] for name in names if facts.get(name)}
        stated["has_healthy"] = facts.get("healthy", "") is not None
        if self.can.healthy is not None:
            by_health = partial(operator.ne, self.can.healthy)
            stated.setdefault("conditions", sorted(self.can.conditions, key=by_health))
        models = {"known": self.known, "detector": self.detector}
        try:
            return Judge(
                self.diagnoser, **models, **stated, outputs=facts.get("channels")
            )
        except ValueError as error:
            raise CommandError(f"{self.path}: {error}") from error

    @property
    def short_identity(self) -> str:
        """Beginning of the SHA-256 of the file, which results and states name."""
        return self.identity[:12]

    @property
    def heading(self) -> str:
        """Description in one line."""
        speeds = f" at {listed(self.train_rpm)} rpm" if self.train_rpm else ""
        rate = self.sampling_rate
        seconds = f", {self.window_length / rate:.3g} s at {rate:g} Hz" if rate else ""
        conditions, healthy = (
            ", ".join(map(str, self.conditions)),
            self.healthy or "not known",
        )
        calibration = f"{self.facts['diagnoser']} calibrated on {conditions}{speeds}"
        rows = f"{self.rows} of {self.window_length} samples{seconds}"
        return f"{self.path}: {calibration}, {rows}. Healthy: {healthy}"

    @property
    def _has_combs_alone(self):
        """Whether combs of a bearing decide, without spectra of faults."""
        decide = unfolded_steps(self.diagnoser)[-1]
        return isinstance(decide, FaultOrderClassifier) and decide.conditions_ is None

    def diagnose(self, recording: ListedRecording, resample: bool = False) -> Diagnosis:
        """Diagnose a recording, block by block."""
        old_rates, parts, starts, speeds = [], [], [], []
        n_windows, length = 0, self.window_length
        asked, recording = recording.channel, self.with_channel(recording)
        if self.takes_rpm:
            recording = recording.with_speed()
        channels = self._compared_channels(recording, asked)
        unit = plain_unit(channels[0][1] or "") if channels else None
        velocities = []
        blocks, sampling_rate = self.windows(recording, resample, old_rates.append)
        for X in blocks:
            if cancelled.is_set():
                raise KeyboardInterrupt
            start = np.arange(n_windows, n_windows + len(X)) * length
            rpm = recording.speeds(start, length, sampling_rate or self.sampling_rate)
            parts.append(self.judge.window_results(X, rpm))
            starts.append(start)
            if recording.profile is not None:
                speeds.append(rpm.mean(axis=1))
            n_windows += len(X)
            output = X if X.ndim == 2 else X[:, 0]
            velocities.append(velocity_rms(output.ravel(), sampling_rate, unit))
        windows, evidence = joined_tables(parts)
        windows.insert(0, "start", np.concatenate(starts))
        if speeds:
            windows.insert(1, "rpm", np.concatenate(speeds))
        verdict = self.judge.recording(windows, evidence)
        if velocities[0] is not None:
            # Blocks are of equal length, except for the last, which may be too short.
            stated = [velocity for velocity in velocities if velocity is not None]
            verdict["velocity_rms_mm_s"] = float(np.sqrt(np.mean(np.square(stated))))
        remarks = [
            f"Resampled from {r:g} to {self.sampling_rate:g} Hz." for r in old_rates
        ]
        if channels:
            remarks += channel_remarks(channels, self.facts, asked)
        remarks += _remarks(windows, verdict)
        if verdict["verdict"] == CHANGED and self.facts.get("bearing"):
            remarks.append(f"No comb of bearing {self.facts['bearing']} shows a fault.")
        if self._has_combs_alone and verdict["verdict"] == self.healthy:
            remarks.append(_NO_COMB)
        if sampling_rate is None and self.sampling_rate is not None:
            remarks.append(
                f"No sampling rate is stated; {self.sampling_rate:g} Hz was assumed."
            )
        slowest = windows["rpm"].min() if "rpm" in windows else recording.rpm
        reason = why_no_orders(length, sampling_rate or self.sampling_rate, slowest)
        if reason and compares_orders(self.diagnoser):
            remarks.append(reason)
        if recording.rpm is None and self.can.is_stretch and self.train_rpm:
            remarks.append(
                "The speed is not stated. Speeds near those of fit were searched."
            )
        return Diagnosis(verdict, windows, sampling_rate, remarks)

    def windows(
        self, recording: ListedRecording, resample: bool = False, note: Any = None
    ) -> Any:
        """Return an iterator of windows, and their rate; `note` is called with the rate before."""
        recording = self.with_channel(recording)
        self.check_order(recording.name, recording.channel)
        blocks = recording.blocks(block_length(self.window_length))
        if resample:
            blocks = resampled_blocks(blocks, self.sampling_rate, note=note)
        first, rate = next(blocks, (np.empty(0), None))
        n_channels, fitted = len(np.atleast_2d(first)), f"but {self.path} was fitted"
        name, expected = recording.name, self.sampling_rate
        if n_channels != self.n_channels:
            found = f"{counted(n_channels, 'channel')}, {fitted} on {self.n_channels}"
            raise CommandError(f"{name}: {found}")
        if not rates_agree(rate, expected):
            found = f"sampled at {rate:g} Hz, {fitted} at {expected:g} Hz"
            advice = unit_advice(rate, expected) or "; --resample brings it to that"
            raise CommandError(f"{name}: {found}{advice}")
        signals = chain([first], (signal for signal, _ in blocks))
        return cut_blocks(signals, name, self.window_length), rate

    def with_channel(self, recording: ListedRecording) -> ListedRecording:
        """Return the recording with the channels of the model, if none are stated and it has them.

        A file that has no more channels than the model needs none to be stated.
        """
        if recording.channel is not None:
            return recording
        for names in self.usual_channels:
            own = replace(recording, channel=names if len(names) > 1 else names[0])
            with suppress(ValueError):
                chosen_channels(own.path, channel=own.channel, dtype=own.dtype)
                return own
        return recording

    def channel_remarks(self, recording: ListedRecording, asked: Any) -> list[str]:
        """Return remarks on channels and units that are not those of the model."""
        channels = self._compared_channels(recording, asked)
        return [*channel_remarks(channels, self.facts, asked)] if channels else []

    def _compared_channels(self, recording, asked):
        """Return names and units of channels; none if the model states nothing to compare."""
        is_same = [*np.atleast_1d(asked)] == self.facts.get("channels")
        if self.facts.get("unit") is None and (
            is_same or not self.facts.get("channel_names")
        ):
            return []
        options = {"channel": recording.channel, "dtype": recording.dtype}
        return chosen_channels(recording.path, **options)

    def check_order(self, name: str, channels: str | list[str] | None) -> None:
        """Refuse the channels of the model in another order."""
        fitted = self.facts.get("channels") or []
        if (
            isinstance(channels, list)
            and channels != fitted
            and {*channels} == {*fitted}
        ):
            expected = f"{self.path} was fitted on {'; '.join(fitted)}, in this order"
            raise CommandError(
                f"{name}: channels {'; '.join(channels)}, but {expected}"
            )

    def fitted(self, row: NDArray[Any], sampling_rate: float | None) -> Any:
        """Return the diagnoser."""
        return self.diagnoser


class BearingModel:
    """Places of faults by the orders of a bearing, without training.

    It has the methods of `SavedModel` that `diagnose` needs. A recording is one row.
    """

    sampling_rate, takes_rpm, healthy = None, True, HEALTHY
    conditions = (HEALTHY, *FAULTS)

    def __init__(self, bearing: str) -> None:
        self.bearing = bearing
        self.summary = {
            "bearing": bearing,
            "conditions": self.conditions,
            "healthy": HEALTHY,
        }
        self.load = partial(BearingModel, bearing)
        self.identity = f"bearing {bearing}"
        limit = (
            f"{HEALTHY} means that no comb exceeds the limit of other healthy machines."
        )
        self.heading = (
            f"No model: places of faults by the orders of bearing {bearing}. {limit}"
        )
        self.heading += f" {_NO_COMB}"

    def fitted(self, row: NDArray[Any], sampling_rate: float | None) -> Any:
        """Return a classifier, fitted on the row."""
        maker = partial(diagnosers.make_fault_order_classifier, bearing=self.bearing)
        return maker(sampling_rate=sampling_rate).fit(row[np.newaxis])

    def windows(self, recording: ListedRecording, resample: bool = False) -> Any:
        """Return the recording as one row, and its sampling rate."""
        ((signal, sampling_rate),) = recording.blocks()
        return iter([signal[np.newaxis]]), sampling_rate

    def diagnose(self, recording: ListedRecording, resample: bool = False) -> Diagnosis:
        """Diagnose a recording. The first remark is the evidence."""
        recording = recording.with_speed()
        (X,), sampling_rate = self.windows(recording)
        if sampling_rate is None or recording.rpm is None:
            missing = NO_RATE if sampling_rate is None else NO_SPEED
            raise ValueError(f"{recording.name}: {missing}")
        rpm, start = np.atleast_2d(recording.speeds([0], X.shape[-1], sampling_rate)), 0
        if recording.profile is not None:
            # A run-up may begin at rest, and a run-down end there.
            fast = np.flatnonzero(SPEED_FACTOR * rpm[0] >= rpm.max())
            start, end = fast[0], fast[-1] + 1
            X, rpm = X[..., start:end], rpm[:, start:end]
        # The row itself is all that the classifier is fitted on, so its limits hold at
        # this speed.
        facts = {"conditions": self.conditions, "train_rpm": [rpm.mean()]}
        judge = Judge(self.fitted(X[0], sampling_rate), **facts)
        results = judge.window_results(
            X, rpm if recording.profile is not None else recording.rpm
        )
        windows = results.table()
        windows.insert(0, "start", start)
        verdict = judge.recording(windows, results.evidence)
        texts = windows["evidence"].dropna() if "evidence" in windows else []
        said = [f"{text[0].upper()}{text[1:]}." for text in texts]
        said += [_NO_COMB] if verdict["verdict"] == HEALTHY else []
        return Diagnosis(
            verdict, windows, sampling_rate, [*said, *_remarks(windows, verdict)]
        )


@lru_cache(maxsize=2)
def _cached_model(path, changed):
    """Load a model file as it was at a time."""
    return SavedModel(path)


def _remarks(windows, verdict):
    if verdict["verdict"] in _ADVICE:
        yield _ADVICE[verdict["verdict"]]
    if isinstance(verdict.get("most like"), str):
        yield f"Most like: {verdict['most like']}."
    if verdict["no signal"]:
        reasons = windows.loc[windows["quality"] != "good", "quality"].value_counts()
        listed = ", ".join(f"{reason}: {count}" for reason, count in reasons.items())
        yield f"{verdict['no signal']} of {verdict['windows']} windows carry no signal ({listed})."
    if verdict["limits"] == FEW_HEALTHY:
        yield (
            f"The alarm rests on fewer than {LEAST_HEALTHY} healthy rows, so a fault may be within "
            "its limits."
        )
    elif verdict["limits"] == HOLD_FOR_RECORDED:
        yield (
            "The recording resembles none of the training closely: it is of another bearing, load, "
            "mounting or machine. Healthy limits may not hold for it."
        )
    elif verdict["limits"] not in ("", HOLD):
        yield f"No alarm: {verdict['limits']}."
