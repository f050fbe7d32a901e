"""Models that diagnose recordings: a saved diagnoser, and the orders of a bearing."""

import argparse
import hashlib
import os
from collections.abc import Callable, Iterator
from functools import lru_cache, partial
from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipFile

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from .._answers import answers
from ..diagnosers import (
    make_alpio,
    make_diagnoser,
    make_extended_state_pio,
    make_fault_order_classifier,
)
from ..fault_places import FAULTS, HEALTHY
from ..fusion import SensorFusion
from ..persistence import load_diagnoser
from ..recordings.listing import ListedRecording
from ..recordings.rates import rates_agree, resampled_blocks
from ..recordings.windows import block_length, cut_blocks
from ..speeds import SPEED_FACTOR
from ..verdicts import CHANGED, HOLD, NO_SIGNAL, NONE_OF_THESE, Judge
from .diagnosis import Diagnosis
from .messages import CommandError, as_command_error, printable
from .workers import cancelled

#: Titles and makers of the diagnosers that `evaluate` compares, in the order of its tables.
DIAGNOSERS = {
    "alpio": ("ALPIO", make_alpio),
    "extended-state": ("Extended state", make_extended_state_pio),
    "diagnoser": ("Diagnoser", make_diagnoser),
}
#: Advice on verdicts that are no condition.
_ADVICE = {
    NO_SIGNAL: "No window carries a signal. Check the sensor, its cable and the logger.",
    NONE_OF_THESE: "None of these: the recording resembles no condition of the model. Check the "
    "sensor, the unit and the stated speed; if they are right, the condition is new to it.",
    CHANGED: "Changed: the healthy limits are exceeded, but no condition can be named. Another "
    "load, mounting or sensor can be the reason.",
}


def of_outputs(args: argparse.Namespace, model: Any) -> Any:
    """Return a model for the number of outputs in the arguments."""
    if args.outputs is None:
        return model
    return SensorFusion(estimator=model, n_outputs=args.outputs)


class SavedModel:
    """Diagnoser in a file, with its healthy limits, its known conditions and its facts.

    Facts that are missing from the file are read from the fitted steps. They are None if they are
    not known.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        with as_command_error():
            self.diagnoser, facts = load_diagnoser(path)
        self.path, self.can = path, answers(self.diagnoser)
        self.known = facts.pop("known_conditions", None)
        self.detector = facts.pop("detector", None)
        self.facts = _completed(facts, self.diagnoser, self.can)
        if self.known is not None:
            self.facts["false_rejection_rate"] = answers(self.known).stated_rate
        self.conditions, self.healthy = self.facts["conditions"], self.facts["healthy"]
        self.window_length, self.n_channels = self.facts["window_length"], self.facts["n_channels"]
        self.sampling_rate, self.train_rpm = self.facts["sampling_rate"], self.facts["train_rpm"]
        self.takes_rpm = self.can.takes_rpm
        self.judge = self._judge()

    def _judge(self):
        try:
            judge = Judge(
                self.diagnoser,
                conditions=None if self.healthy is None else self.conditions,
                known=self.known,
                detector=self.detector,
                train_rpm=self.train_rpm or (),
                sampling_rate=self.sampling_rate,
            )
        except ValueError as error:
            raise CommandError(f"{self.path}: {error}") from error
        if len(judge.outputs) > 1 and self.facts.get("channels"):
            judge.outputs = self.facts["channels"][: len(judge.outputs)]
        if self.healthy is None:
            # Without a healthy condition there are no healthy limits.
            judge.healthy, judge.detects = None, False
        return judge

    @property
    def rows(self) -> str:
        """Kind of the rows that the diagnoser takes."""
        return "stretches" if self.can.is_stretch else "windows"

    @property
    def heading(self) -> str:
        """Description in one line."""
        speeds = ", ".join(f"{speed:g}" for speed in self.train_rpm or ())
        speeds = f" at {speeds} rpm" if speeds else ""
        rate = self.sampling_rate
        seconds = f", {self.window_length / rate:.3g} s at {rate:g} Hz" if rate else ""
        return (
            f"{self.path}: {self.facts['diagnoser']} calibrated on "
            f"{', '.join(map(str, self.conditions))}{speeds}, {self.rows} of "
            f"{self.window_length} samples{seconds}. Healthy: {self.healthy or 'not known'}"
        )

    @property
    def summary(self) -> dict[str, Any]:
        """Entries for a file of results."""
        return {"file": printable(self.path)} | self.facts

    @property
    def identity(self) -> str:
        """SHA-256 of the file, by which later runs recognise the model."""
        with open(self.path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()

    def loader(self) -> Callable[[], Any]:
        """Return a function that loads the model in a worker, once for all recordings."""
        return partial(_cached_model, os.path.abspath(self.path), os.stat(self.path).st_mtime_ns)

    def diagnose(self, recording: ListedRecording, resample: bool = False) -> Diagnosis:
        """Diagnose a recording, block by block."""
        old_rates, parts, sampling_rate = [], [], None
        if self.takes_rpm:
            recording = recording.with_speed()
        n_windows, length = 0, self.window_length
        for X, rate in self.windows(recording, resample, old_rates.append):
            if cancelled.is_set():
                raise KeyboardInterrupt
            sampling_rate = rate
            start = np.arange(n_windows, n_windows + len(X)) * length
            rpm = recording.speeds(start, length, rate or self.sampling_rate)
            parts.append(self.judge.windows(X, rpm))
            parts[-1].insert(0, "start", start)
            if recording.profile is not None:
                parts[-1].insert(1, "rpm", rpm.mean(axis=1))
            n_windows += len(X)
        windows = pd.concat(parts, ignore_index=True)
        verdict = self.judge.recording(windows)
        remarks = [f"Resampled from {r:g} to {self.sampling_rate:g} Hz." for r in old_rates]
        remarks += _remarks(windows, verdict)
        if verdict["verdict"] == CHANGED and self.facts.get("bearing"):
            remarks.append(f"No comb of bearing {self.facts['bearing']} shows a fault.")
        if sampling_rate is None and self.sampling_rate is not None:
            remarks.append(f"No sampling rate is stated; {self.sampling_rate:g} Hz was assumed.")
        if recording.rpm is None and self.can.is_stretch and self.train_rpm:
            remarks.append("The speed is not stated. Speeds near those of fit were searched.")
        return Diagnosis(verdict, windows, sampling_rate, tuple(remarks))

    def windows(
        self,
        recording: ListedRecording,
        resample: bool = False,
        note: Callable[[float], object] = lambda rate: None,
    ) -> Iterator[tuple[NDArray[Any], float | None]]:
        """Yield windows and sampling rate, block by block; `note` takes the rate before."""
        self.check_order(recording.name, recording.channel)
        sampling_rate = None

        def signals():
            nonlocal sampling_rate
            blocks = recording.blocks(block_length(self.window_length))
            if resample:
                blocks = resampled_blocks(blocks, self.sampling_rate, note=note)
            for signal, sampling_rate in blocks:
                self._check_fits(recording.name, signal, sampling_rate)
                yield signal

        for X in cut_blocks(signals(), recording.name, self.window_length):
            yield X, sampling_rate

    def check_order(self, name: str, channels: str | list[str] | None) -> None:
        """Refuse the channels of the model in another order."""
        fitted = self.facts.get("channels") or []
        if isinstance(channels, list) and channels != fitted and {*channels} == {*fitted}:
            raise CommandError(
                f"{name}: channels {'; '.join(channels)}, but {self.path} was fitted on "
                f"{'; '.join(fitted)}, in this order"
            )

    def _check_fits(self, name, signal, rate):
        n_channels, fitted = 1 if signal.ndim == 1 else len(signal), f"but {self.path} was fitted"
        if n_channels != self.n_channels:
            raise CommandError(f"{name}: {n_channels} channels, {fitted} on {self.n_channels}")
        if not rates_agree(rate, self.sampling_rate):
            raise CommandError(
                f"{name}: sampled at {rate:g} Hz, {fitted} at {self.sampling_rate:g} Hz; "
                "--resample brings it to that"
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
        self.summary = {"bearing": bearing, "conditions": self.conditions, "healthy": HEALTHY}
        self.identity = f"bearing {bearing}"
        self.heading = (
            f"No model: places of faults by the orders of bearing {bearing}. {HEALTHY} means that "
            "no comb exceeds the limit of healthy recordings of other machines."
        )

    def loader(self) -> Callable[[], Any]:
        """Return a function that makes the model in a worker."""
        return partial(BearingModel, self.bearing)

    def fitted(self, row: NDArray[Any], sampling_rate: float | None) -> Any:
        """Return a classifier, fitted on the row."""
        maker = partial(make_fault_order_classifier, bearing=self.bearing)
        return maker(sampling_rate=sampling_rate).fit(row[np.newaxis])

    def windows(
        self, recording: ListedRecording, resample: bool = False
    ) -> Iterator[tuple[NDArray[Any], float]]:
        """Yield the recording as one row, and its sampling rate."""
        ((signal, sampling_rate),) = recording.blocks()
        if sampling_rate is None:
            raise ValueError(
                f"{recording.name}: the sampling rate is not stated; expected --sampling-rate."
            )
        yield signal[np.newaxis], sampling_rate

    def diagnose(self, recording: ListedRecording, resample: bool = False) -> Diagnosis:
        """Diagnose a recording. The first remark is the evidence."""
        recording = recording.with_speed()
        if recording.rpm is None:
            raise ValueError(
                f"{recording.name}: the speed of the shaft is not stated; expected --rpm, a column "
                "rpm, or a speed in the file."
            )
        ((X, sampling_rate),) = self.windows(recording)
        rpm, start = np.atleast_2d(recording.speeds([0], X.shape[-1], sampling_rate)), 0
        if recording.profile is not None:
            # A run-up may begin at rest, and a run-down end there.
            fast = np.flatnonzero(SPEED_FACTOR * rpm[0] >= rpm.max())
            start, end = fast[0], fast[-1] + 1
            X, rpm = X[..., start:end], rpm[:, start:end]
        # The row itself is all that the classifier is fitted on, so its limits hold at this speed.
        facts = {"conditions": self.conditions, "train_rpm": [rpm.mean()]}
        judge = Judge(self.fitted(X[0], sampling_rate), **facts)
        windows = judge.windows(X, rpm if recording.profile is not None else recording.rpm)
        windows.insert(0, "start", start)
        verdict = judge.recording(windows)
        said = [f"{text[0].upper()}{text[1:]}." for text in windows.get("evidence", ())]
        return Diagnosis(verdict, windows, sampling_rate, (*said, *_remarks(windows, verdict)))


def _completed(facts, diagnoser, can):
    """Return all facts; those missing from the file are read from the fitted steps."""
    healthy = "healthy" if can.conditions is None else can.healthy
    names = can.conditions or [healthy]
    read = {
        "diagnoser": type(diagnoser).__name__,
        "conditions": sorted(names, key=lambda name: name != healthy),
        "healthy": healthy,
        "train_rpm": None,
        "sampling_rate": None,
        "window_length": can.window_length,
        "n_channels": can.n_channels,
    }
    if "conditions" in facts:
        read["healthy"] = facts.get("healthy", facts["conditions"][0])
    return read | {name: value for name, value in facts.items() if value is not None}


@lru_cache(maxsize=2)
def _cached_model(path, changed):
    """Load a model file as it was at a time."""
    return SavedModel(path)


def _remarks(windows, verdict):
    if verdict["verdict"] in _ADVICE:
        yield _ADVICE[verdict["verdict"]]
    if verdict["no signal"]:
        reasons = windows.loc[windows["quality"] != "good", "quality"].value_counts()
        listed = ", ".join(f"{reason}: {count}" for reason, count in reasons.items())
        yield f"{verdict['no signal']} of {verdict['windows']} windows carry no signal ({listed})."
    if verdict["limits"] not in ("", HOLD):
        yield f"No alarm: {verdict['limits']}."


def is_model_file(path: Path) -> bool:
    """Return whether a file is a saved model, damaged or not."""
    try:
        with ZipFile(path) as file:
            return "schema.json" in file.namelist()
    except (BadZipFile, OSError):
        return False
