"""Models that diagnose recordings: one in a file, or the pipeline of a bearing."""

import operator
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache, partial
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.base import clone

from ... import diagnosers
from ...core.capabilities import capabilities, requests
from ...core.fault_locations import FAULTS, HEALTHY
from ...core.speeds import SPEED_FACTOR
from ...persistence.models import load_diagnoser
from ...verdicts.judge import Judge
from ..readers.cutting import block_length, cut_blocks
from ..readers.entries import ListedRecording, OpenRecording
from ..readers.formats.rates import NO_RATE, rates_agree, unit_advice
from .messages import CommandError, as_command_error, counted, printable, speeds_as_text
from .training_facts import channels_of_model

#: Samples of a row without a model, at most: longer recordings are several rows.
_LONGEST_ROW = 2**21
#: Facts of the training that a file may state, by the parameters of `Judge`.
_OF_TRAINING = ("conditions", "train_rpm", "sampling_rate")
#: Error on a recording of unknown speed.
_NO_SPEED = "rpm is missing; expected --rpm, a column, or the file to state it"


@dataclass(eq=False)
class RecordingModel:
    """Model that diagnoses recordings.

    Parameters
    ----------
    diagnoser : Pipeline
        The diagnoser. Without a judge, it is fitted to each recording, which is one row.
    facts : dict
        Facts by the names of `save_diagnoser`, as far as they are known.
    judge : Judge or None
        The diagnoser with its healthy limits and its known conditions.
    takes_rpm : bool
        Whether it takes the speed of a recording.
    heading : str
        Description in one line.
    load : callable
        Returns the model in a worker.
    other_bearing : str or None, default=None
        Bearing of the recordings, if it is not that of the training.

    Attributes
    ----------
    conditions : list of label
        Conditions that it names, the healthy one first.
    healthy : label or None
        The healthy condition; None if it is not known.
    train_rpm : list of float
        Training speeds; empty if they are not known.
    sampling_rate : float or None
        In Hz; None if it is not known.
    window_length : int or None
        Samples in a row; None if a recording is one row.
    usual_channels : list of list of str
        Ways to state its channels, the best first.
    identity : str
        Text that differs between models.
    """

    diagnoser: Any
    facts: dict[str, Any]
    judge: Judge | None
    takes_rpm: bool
    heading: str
    load: Callable[[], "RecordingModel"]
    other_bearing: str | None = None

    def __post_init__(self) -> None:
        self.conditions: list[Any] = self.facts["conditions"]
        self.healthy: Any = self.facts["healthy"]
        self.train_rpm: list[float] = self.facts.get("train_rpm") or []
        self.sampling_rate: float | None = self.facts.get("sampling_rate")
        self.window_length: int | None = self.facts.get("window_length")
        self.usual_channels = channels_of_model(self.facts)
        self.identity = self.heading

    def open(self, recording: ListedRecording, resample: bool = False) -> OpenRecording:
        """Open a recording, with the channels of the model if none are stated.

        A file that has no more channels than the model needs none to be stated. With
        `resample`, the recording is brought to the sampling rate of the model.
        """
        usual = [names if len(names) > 1 else names[0] for names in self.usual_channels]
        stated = recording.channel
        return recording.open(
            block_length(self.window_length or 1),
            channels=[*usual, None] if stated is None else [stated],
            reads_speed=self.takes_rpm,
            resample=self.sampling_rate if resample else None,
        )

    def row_blocks(
        self, opened: OpenRecording
    ) -> Iterator[tuple[NDArray[Any], NDArray[Any], Any]]:
        """Yield the rows of an open recording, block by block.

        Yields
        ------
        start : ndarray of int of shape (n_rows,)
            Position of the first sample of each row.
        X : ndarray of shape (n_rows[, n_channels], n_samples)
            The rows.
        rpm : float, ndarray of shape (n_rows, n_samples), or None
            Their speed, or those at each sample; None if it is not known.
        """
        if self.window_length is None:
            yield from _long_rows(opened)
            return
        rate = opened.sampling_rate or self.sampling_rate
        n_before = 0
        for X in cut_blocks(opened.blocks, opened.entry.name, self.window_length):
            start = np.arange(n_before, n_before + len(X)) * self.window_length
            yield start, X, opened.entry.speeds(start, X.shape[-1], rate)
            n_before += len(X)

    def judge_of(
        self, row: NDArray[Any], rpm: Any, sampling_rate: float | None
    ) -> Judge:
        """Return a judge that is fitted to a row, for a model without one."""
        diagnoser = clone(self.diagnoser)
        diagnoser.set_params(decide__sampling_rate=sampling_rate)
        # Its limits hold at the speed of the row that it is fitted to.
        return Judge(
            diagnoser.fit(row[np.newaxis]),
            conditions=self.conditions,
            train_rpm=[np.mean(rpm)],
        )


def _long_rows(opened):
    """Yield rows of a recording for a model without a length: all of it, as far as it is one row.

    A longer recording is cut, and its last part that does not fill a row is left out.
    The part of a run-up that is slow is left out, too.
    """
    entry = opened.entry
    if opened.sampling_rate is None:
        raise ValueError(f"{entry.name}: {NO_RATE}")
    if entry.rpm is None:
        raise ValueError(f"{entry.name}: {_NO_SPEED}")
    start = 0
    for signal in _parts(opened.blocks):
        X = signal[np.newaxis]
        rpm = entry.speeds([start], X.shape[-1], opened.sampling_rate)
        first, end = 0, X.shape[-1]
        if entry.profile is not None:
            # A run-up may begin at rest, and a run-down end there.
            fast = np.flatnonzero(SPEED_FACTOR * rpm[0] >= rpm.max())
            first, end = fast[0], fast[-1] + 1
            rpm = rpm[:, first:end]
        yield np.array([start + first]), X[..., first:end], rpm
        start += X.shape[-1]


def _parts(blocks):
    """Yield parts of the largest length of a row, or everything if it is shorter."""
    rest = np.empty(0)
    is_long = False
    for block in blocks:
        rest = np.concatenate([rest, block], axis=-1) if rest.size else block
        while rest.shape[-1] >= _LONGEST_ROW:
            yield rest[..., :_LONGEST_ROW]
            # Without the copy, a few samples would keep the whole part in memory.
            rest = rest[..., _LONGEST_ROW:].copy()
            is_long = True
    if not is_long:
        yield rest


def bearing_model(bearing: str) -> RecordingModel:
    """Return the model that names fault locations by the orders of a bearing.

    Parameters
    ----------
    bearing : str
        The bearing, as `skarxlag.bearings.bearing_orders` takes it.
    """
    conditions = [HEALTHY, *FAULTS]
    # The sampling rate of each recording replaces this one.
    diagnoser = diagnosers.make_fault_order_classifier(
        bearing=bearing, sampling_rate=1.0
    )
    return RecordingModel(
        diagnoser,
        {"bearing": bearing, "conditions": conditions, "healthy": HEALTHY},
        None,
        takes_rpm=True,
        heading=(
            f"No model: fault locations by the orders of bearing {bearing}. Without "
            "healthy recordings of this machine, no recording is called healthy."
        ),
        load=partial(bearing_model, bearing),
    )


class SavedModel(RecordingModel):
    """Model in a file, with its healthy limits, its known conditions and its facts.

    Facts that are missing from the file are read from the fitted steps. They are None
    if they are not known.

    Parameters
    ----------
    path : path-like
        The file.
    bearing : str or None, default=None
        Bearing of the recordings, if it is not that of the training. Healthy limits do
        not hold then.

    Attributes
    ----------
    path : path-like
        The file.
    capabilities : Capabilities
        Description of the diagnoser.
    known_conditions, detector : estimator or None
        The models that were saved with the diagnoser.
    identity : str
        SHA-256 of the file.
    takes_bearing : bool
        Whether the diagnoser can be asked about another bearing.
    n_channels : int
        Channels of a row.
    rows : str
        Word for the rows: windows or stretches.
    """

    def __init__(
        self, path: str | os.PathLike[str], bearing: str | None = None
    ) -> None:
        with as_command_error():
            diagnoser, stated = load_diagnoser(path)
            identity = sha256(Path(path).read_bytes()).hexdigest()
        self.path = path
        self.known_conditions = stated.pop("known_conditions", None)
        self.detector = stated.pop("detector", None)
        self.capabilities = capabilities(diagnoser)
        self.takes_bearing = requests(diagnoser, "predict", "bearing")
        if bearing == stated.get("bearing") or not self.takes_bearing:
            bearing = None
        try:
            judge = Judge(
                diagnoser,
                known=self.known_conditions,
                detector=self.detector,
                has_healthy=stated.get("healthy", "") is not None,
                outputs=stated.get("channels"),
                bearing=bearing,
                **{name: stated[name] for name in _OF_TRAINING if stated.get(name)},
            )
        except ValueError as error:
            raise CommandError(f"{path}: {error}") from error
        facts = self._all_facts(diagnoser, judge, stated)
        self.n_channels = facts["n_channels"]
        self.rows = "stretches" if self.capabilities.is_stretch else "windows"
        changed = os.stat(path).st_mtime_ns
        super().__init__(
            diagnoser,
            facts,
            judge,
            takes_rpm=self.capabilities.takes_rpm,
            heading=_heading(path, self.rows, facts, bearing),
            load=partial(_cached_model, os.path.abspath(path), changed, bearing),
            other_bearing=bearing,
        )
        self.identity = identity

    def _all_facts(self, diagnoser, judge, stated):
        """Return the facts that the file states, and those of the models themselves."""
        facts = {
            "file": printable(self.path),
            "diagnoser": type(diagnoser).__name__,
            "conditions": sorted(
                judge.conditions, key=partial(operator.ne, judge.healthy)
            ),
            "healthy": judge.healthy,
            "train_rpm": judge.train_rpm or None,
            "sampling_rate": judge.sampling_rate,
            "window_length": self.capabilities.window_length,
            "n_channels": self.capabilities.n_channels,
        }
        facts |= {name: value for name, value in stated.items() if value is not None}
        if self.known_conditions is not None:
            rate = capabilities(self.known_conditions).stated_rate
            facts["false_rejection_rate"] = rate
        return facts

    @property
    def short_identity(self) -> str:
        """Beginning of the SHA-256 of the file, which results and states name."""
        return self.identity[:12]

    def open(self, recording: ListedRecording, resample: bool = False) -> OpenRecording:
        """Open a recording, and refuse other channels or another rate than those of `fit`."""
        self.check_order(recording.name, recording.channel)
        opened = super().open(recording, resample)
        n_channels = len(opened.channels)
        if n_channels != self.n_channels:
            raise CommandError(
                f"{recording.name}: {counted(n_channels, 'channel')}, but {self.path} was "
                f"fitted on {self.n_channels}; --channel chooses"
            )
        rate = opened.sampling_rate
        expected = self.sampling_rate
        if not rates_agree(rate, expected):
            advice = unit_advice(rate, expected) or "; --resample brings it to that"
            raise CommandError(
                f"{recording.name}: sampled at {rate:g} Hz, but {self.path} was fitted at "
                f"{expected:g} Hz{advice}"
            )
        return opened

    def check_order(self, name: str, channels: str | list[str] | None) -> None:
        """Refuse the channels of the model in another order."""
        fitted = self.facts.get("channels") or []
        if not isinstance(channels, list) or channels == fitted:
            return
        if {*channels} == {*fitted}:
            raise CommandError(
                f"{name}: channels {'; '.join(channels)}, but {self.path} was fitted on "
                f"{'; '.join(fitted)}, in this order"
            )


def _heading(path, rows, facts, bearing):
    """Describe a saved model in one line."""
    conditions = ", ".join(map(str, facts["conditions"]))
    speeds = (
        f" at {speeds_as_text(facts['train_rpm'])} rpm" if facts["train_rpm"] else ""
    )
    size = f"{rows} of {facts['window_length']} samples"
    rate = facts["sampling_rate"]
    if rate:
        size = f"{size}, {facts['window_length'] / rate:.3g} s at {rate:g} Hz"
    asked = "" if bearing is None else f". Asked about bearing {bearing}"
    return (
        f"{path}: {facts['diagnoser']} calibrated on {conditions}{speeds}, {size}. "
        f"Healthy: {facts['healthy'] or 'not known'}{asked}"
    )


@lru_cache(maxsize=2)
def _cached_model(path, changed, bearing):
    """Load a model file as it was at a time."""
    return SavedModel(path, bearing)
