"""Rows of ``skarxlag fit``: windows or stretches, as long as the recordings allow."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from sklearn.utils import Bunch

from ...core.speeds import LEAST_REVOLUTIONS
from ...datasets.frames import FACTS
from ...measures.quality import quality_of_outputs
from ..readers.cutting import cut_recordings, speeds_within_rows
from ..readers.entries import ListedRecording
from .messages import CommandError, Reporter, as_command_error, counted
from .training_facts import Channels

#: Samples of a channel that the rows of all recordings hold together: a quarter of a
#: GiB. The fits of companions copy the healthy ones.
MOST_SAMPLES = 2**25
#: Seconds in a stretch, and revolutions of the shaft that it holds at least.
_SECONDS = 1.0
_REVOLUTIONS = 10
#: Samples in a window, of which stretches consist, and in a window of a detector.
_WINDOW_LENGTH = 1200
_DETECTOR_LENGTH = 4800
#: Stretches that the shortest recording holds at least, and those that are enough.
_FEWEST = 2
_ENOUGH = 4
#: Recordings that are named in a report.
_MOST_NAMED = 5


@dataclass(frozen=True)
class TrainingRows:
    """Rows of recordings, and what is known of them.

    Parameters
    ----------
    X : ndarray of shape (n_rows[, n_channels], n_samples)
        Samples.
    facts : DataFrame
        Facts of each row, as far as they are stated, as `protocol_splits` takes them,
        and ``condition``. If speeds vary, ``mean_rpm`` is that of the recording.
    speeds : ndarray of shape (n_rows,) or (n_rows, n_samples), or None
        Speed of each row, or at each sample if it varies within a row.
    word : str
        Word for the rows: windows or stretches.
    sampling_rate : float
        In Hz.
    channels : sequence of Channels
        Of each recording.
    notes : tuple of str
        What was read, and rows that are left out.
    """

    X: NDArray[Any]
    facts: pd.DataFrame
    speeds: NDArray[Any] | None
    word: str
    sampling_rate: float
    channels: Sequence[Channels]
    notes: tuple[str, ...]

    @property
    def y(self) -> NDArray[Any]:
        """Conditions."""
        return self.facts["condition"].to_numpy(str)

    @property
    def metadata(self) -> dict[str, Any]:
        """Speeds and specimens by the parameters of `fit`, if they are stated."""
        metadata = {}
        if self.speeds is not None:
            metadata["rpm"] = self.speeds
        if "specimen" in self.facts:
            metadata["specimen"] = self.facts["specimen"].to_numpy()
        return metadata

    @property
    def seconds(self) -> float:
        """Length of a row."""
        return self.X.shape[-1] / self.sampling_rate

    def where(self, chosen: NDArray[np.bool_]) -> Self:
        """Return some of the rows."""
        # The windows may take half of the memory, so they are not copied without need.
        if chosen.all():
            return self
        return replace(
            self,
            X=self.X[chosen],
            facts=self.facts[chosen].reset_index(drop=True),
            speeds=None if self.speeds is None else self.speeds[chosen],
        )

    def with_note(self, note: str) -> Self:
        """Return the rows with one more note."""
        return replace(self, notes=(*self.notes, note))

    def with_signal(self, source: Any, n_outputs: int) -> Self:
        """Leave out the rows without a signal, which `diagnose` would refuse.

        Parameters
        ----------
        source : path-like
            Named in messages.
        n_outputs : int
            Number of the first channels that are outputs.

        Raises
        ------
        CommandError
            If no row of a condition is left.
        """
        # The model refuses more outputs than there are channels.
        n_channels = 1 if self.X.ndim == 2 else self.X.shape[1]
        outputs = [f"output {s}" for s in range(1, min(n_outputs, n_channels) + 1)]
        facts = {"sampling_rate": self.sampling_rate, "rpm": self.facts.get("rpm")}
        quality, _ = quality_of_outputs(self.X, outputs, **facts)
        is_silent = quality != "good"
        if not is_silent.any():
            return self
        left = self.where(~is_silent)
        silent = self.facts[is_silent].assign(quality=quality[is_silent])
        for condition, reasons in silent.groupby("condition")["quality"]:
            if condition not in left.y:
                raise CommandError(
                    f"{source}: {condition}: no signal ({', '.join(reasons.unique())}); "
                    "check the sensor, its cable and the logger"
                )
        counts = silent.groupby(["recording", "quality"], sort=False).size()
        named = [f"{count} {why} in {name}" for (name, why), count in counts.items()]
        n_rows = counted(len(silent), self.word.removesuffix("s"))
        more = ", ..." if len(named) > _MOST_NAMED else ""
        return left.with_note(
            f"{n_rows} left out, without a signal: {', '.join(named[:_MOST_NAMED])}{more}"
        )


def training_rows(
    recordings: Sequence[ListedRecording],
    source: Any,
    *,
    kind: str | None = None,
    window_length: int | None = None,
    resample_to: float | None = None,
    reporter: Reporter | None = None,
) -> TrainingRows:
    """Return the rows of recordings whose speed can be used.

    Parameters
    ----------
    recordings : sequence of ListedRecording
        The recordings.
    source : path-like
        Named in messages.
    kind : str or None, default=None
        Kind of the diagnoser. None: as the recordings allow.
    window_length, resample_to
        As in ``skarxlag fit``.
    reporter : Reporter or None, default=None
        Counts the recordings that are read.

    Raises
    ------
    CommandError
        If a recording cannot be read, is too short, or has an implausible speed.
    """
    reporter = reporter or Reporter()

    def cut(length):
        reporter.start(len(recordings))
        n_values = length * np.size(recordings[0].channel) * len(recordings)
        with as_command_error():
            return cut_recordings(
                recordings,
                source,
                length,
                max_windows=max(MOST_SAMPLES // n_values, 2),
                resample=resample_to,
                note=lambda entry, n_windows: reporter.step(
                    f"{entry.name}: {n_windows} windows of {length} samples"
                ),
            )

    word = "stretches" if kind == "stretches" else "windows"
    rig = cut(window_length or _WINDOW_LENGTH)
    if not window_length and kind != "diagnoser":
        n_windows = _stretch_windows(rig)
        if n_windows is not None:
            word = "stretches"
        elif kind == "stretches":
            raise CommandError(
                f"{source}: the shortest recording is too short for two stretches; use "
                "--diagnoser diagnoser"
            )
        elif kind == "detector":
            n_windows = _DETECTOR_LENGTH // _WINDOW_LENGTH
        if n_windows is not None:
            # Two copies of the windows could take all of the memory.
            del rig["data"]
            rig = cut(n_windows * _WINDOW_LENGTH)
    speeds, errors = speeds_within_rows(
        rig, LEAST_REVOLUTIONS if word == "stretches" else 0
    )
    rows = TrainingRows(
        rig.pop("data"),
        _facts_of_rows(rig, recordings),
        speeds,
        word,
        float(rig.sampling_rate),
        rig.channels,
        (rig.DESCR,),
    )
    refused = errors[errors != ""]
    if len(refused) == 0:
        return rows
    n_refused = counted(len(refused), word.removesuffix("s"))
    return rows.where(errors == "").with_note(f"{n_refused} left out: {refused[0]}")


def _facts_of_rows(rig, recordings):
    """Return what is stated of each row, and the mean speed of recordings that vary."""
    stated = {name: rig[name] for name in FACTS if rig.get(name) is not None}
    facts = pd.DataFrame(stated)
    if rig.target is not None:
        facts["condition"] = rig.target
    if not any(recording.specimen for recording in recordings):
        facts = facts.drop(columns="specimen", errors="ignore")
    if "campaign" in rig.further:
        facts["campaign"] = rig.further["campaign"].loc[rig.recording].to_numpy(str)
    if rig.profiles:
        means = {name: profile.mean() for name, profile in rig.profiles.items()}
        facts["mean_rpm"] = facts["recording"].map(means).fillna(facts["rpm"])
    return facts


def _stretch_windows(rig: Bunch) -> int | None:
    """Return the number of windows in a stretch, or None if the recordings are too short.

    A stretch takes a second, or ten revolutions at the slowest mean speed if they take
    longer. If one would hold less than four such stretches, a stretch takes a quarter
    of the shortest recording, but not less than half of that.

    >>> rig = Bunch(data=np.zeros((12, 500)), available=np.array([12, 40]), rpm=None,
    ...             sampling_rate=1_000.0, recording=np.repeat("run", 12))
    >>> _stretch_windows(rig)
    2
    >>> rig.rpm = np.full(12, 300.0)
    >>> _stretch_windows(rig)
    3
    >>> rig.rpm = np.full(12, 50.0)
    >>> _stretch_windows(rig)
    """
    seconds = _SECONDS
    if rig.rpm is not None:
        # A run-up may begin at rest.
        slowest = pd.Series(rig.rpm).groupby(rig.recording).mean().min()
        seconds = max(_SECONDS, 60 * _REVOLUTIONS / slowest)
    usual = seconds * rig.sampling_rate / rig.data.shape[-1]
    shortest = rig.available.min()
    n_windows = int(np.ceil(min(usual, max(shortest // _ENOUGH, usual / 2))))
    return n_windows if shortest >= _FEWEST * n_windows else None
