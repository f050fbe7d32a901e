"""Diagnosers for the commands, and the model in a file that diagnoses recordings."""

import argparse
import operator
import os
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache, partial
from hashlib import sha256
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from .. import diagnosers
from ..core.capabilities import capabilities, unfolded_steps
from ..decisions.fault_orders import FaultOrderClassifier
from ..decisions.fusion import SensorFusion
from ..persistence.models import load_diagnoser
from ..recordings.files import chosen_channels
from ..recordings.listing import ListedRecording
from ..recordings.rates import rates_agree, resampled_blocks, unit_advice
from ..recordings.windows import block_length, cut_blocks
from ..verdicts.judge import Judge
from ..verdicts.names import CHANGED
from .channels import channel_remarks, channels_of_model
from .messages import CommandError, as_command_error, counted, listed, printable
from .recording_rows import RecordingModel, RecordingRows
from .refused_rows import compares_orders, why_no_orders
from .remarks import NO_COMB, verdict_remarks

#: Titles and makers of the diagnosers that `evaluate` compares, in the order of its
#: tables.
DIAGNOSERS = {
    "alpio": ("ALPIO", diagnosers.make_alpio),
    "extended-state": ("Extended state", diagnosers.make_extended_state_pio),
    "diagnoser": ("Diagnoser", diagnosers.make_diagnoser),
}


def of_outputs(args: argparse.Namespace, model: Any) -> Any:
    """Return a model for the number of outputs in the arguments."""
    if args.outputs is None:
        return model
    return SensorFusion(estimator=model, n_outputs=args.outputs)


class SavedModel(RecordingModel):
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

    def windows(
        self, recording: ListedRecording, resample: bool = False, note: Any = None
    ) -> tuple[Iterator[NDArray[Any]], float | None]:
        """Return an iterator of windows, and their rate; `note` is called with the rate before."""
        recording = self.with_channel(recording)
        self.check_order(recording.name, recording.channel)
        blocks = recording.blocks(block_length(self.window_length))
        if resample:
            blocks = resampled_blocks(blocks, self.sampling_rate, note=note)
        first, rate = next(blocks, (np.empty(0), None))
        self._check_signal(recording.name, first, rate)
        signals = chain([first], (signal for signal, _ in blocks))
        return cut_blocks(signals, recording.name, self.window_length), rate

    def _check_signal(self, name, signal, rate):
        """Refuse a signal with other channels or of another rate than those of `fit`."""
        n_channels = len(np.atleast_2d(signal))
        fitted = f"but {self.path} was fitted"
        expected = self.sampling_rate
        if n_channels != self.n_channels:
            found = f"{counted(n_channels, 'channel')}, {fitted} on {self.n_channels}"
            raise CommandError(f"{name}: {found}")
        if not rates_agree(rate, expected):
            found = f"sampled at {rate:g} Hz, {fitted} at {expected:g} Hz"
            advice = unit_advice(rate, expected) or "; --resample brings it to that"
            raise CommandError(f"{name}: {found}{advice}")

    def rows_of(
        self, recording: ListedRecording, resample: bool = False
    ) -> RecordingRows:
        """Return the rows of a recording with their speeds."""
        stated = recording.channel
        recording = self.with_channel(recording)
        if self.takes_rpm:
            recording = recording.with_speed()
        old_rates: list[float] = []
        windows, rate = self.windows(recording, resample, old_rates.append)
        blocks = self._with_speeds(windows, recording, rate or self.sampling_rate)
        channels = self._compared_channels(recording, stated)
        return RecordingRows(recording, blocks, rate, self.judge, channels, old_rates)

    def _with_speeds(self, windows, recording, rate):
        """Yield the first samples, the windows and the speeds of each block."""
        n_before = 0
        for X in windows:
            start = np.arange(n_before, n_before + len(X)) * self.window_length
            yield start, X, recording.speeds(start, self.window_length, rate)
            n_before += len(X)

    def remarks(
        self,
        recording: ListedRecording,
        rows: RecordingRows,
        windows: pd.DataFrame,
        verdict: dict[str, Any],
    ) -> Iterator[str]:
        """Yield remarks on the recording, the verdict, and what the model assumed."""
        for rate in rows.old_rates:
            yield f"Resampled from {rate:g} to {self.sampling_rate:g} Hz."
        if rows.channels:
            yield from channel_remarks(rows.channels, self.facts, recording.channel)
        yield from [*verdict_remarks(windows, verdict)]
        if verdict["verdict"] == CHANGED and self.facts.get("bearing"):
            yield f"No comb of bearing {self.facts['bearing']} shows a fault."
        if self._has_combs_alone and verdict["verdict"] == self.healthy:
            yield NO_COMB
        if rows.sampling_rate is None and self.sampling_rate is not None:
            yield f"No sampling rate is stated; {self.sampling_rate:g} Hz was assumed."
        rate = rows.sampling_rate or self.sampling_rate
        rpm = rows.recording.rpm
        slowest = windows["rpm"].min() if "rpm" in windows else rpm
        reason = why_no_orders(self.window_length, rate, slowest)
        if reason and compares_orders(self.diagnoser):
            yield reason
        if rpm is None and self.can.is_stretch and self.train_rpm:
            yield "The speed is not stated. Speeds near those of fit were searched."

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


@lru_cache(maxsize=2)
def _cached_model(path, changed):
    """Load a model file as it was at a time."""
    return SavedModel(path)
