"""Rows of a recording, read block by block, and the models that diagnose them."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ..recordings.listing import ListedRecording
from ..verdicts.judge import Judge
from ..verdicts.windows import joined_tables
from .channels import plain_unit
from .diagnosis import Diagnosis, cancelled
from .velocity import velocity_rms


@dataclass
class RecordingRows:
    """Rows of a recording that are read block by block, and their judge.

    Parameters
    ----------
    recording : ListedRecording
        The recording, with the channels of the model and its speed.
    blocks : iterable of tuple
        Of each block: the first samples of its rows, the rows, and their speeds, as
        `ListedRecording.speeds` returns them.
    sampling_rate : float or None
        In Hz; None if it is not known.
    judge : Judge
        Judge of the rows.
    channels : sequence of tuple, default=()
        Names and units of the channels, if they are known.
    old_rates : list of float
        Rates before resampling, as far as the blocks are read.
    """

    recording: ListedRecording
    blocks: Iterable[tuple[Any, NDArray[Any], Any]]
    sampling_rate: float | None
    judge: Judge
    channels: Sequence[tuple[Any, str | None]] = ()
    old_rates: list[float] = field(default_factory=list)

    @property
    def has_profile(self) -> bool:
        """Return whether speeds are those at each sample."""
        return self.recording.profile is not None

    def verdict(self) -> tuple[pd.DataFrame, dict[str, Any]]:
        """Read the rows, and return a table of them and the verdict on the recording."""
        starts, speeds, parts, velocities = [], [], [], []
        unit = plain_unit(self.channels[0][1] or "") if self.channels else None
        for start, X, rpm in self.blocks:
            if cancelled.is_set():
                raise KeyboardInterrupt
            parts.append(self.judge.window_results(X, rpm))
            starts.append(start)
            if self.has_profile:
                speeds.append(rpm.mean(axis=1))
            output = X if X.ndim == 2 else X[:, 0]
            velocities.append(velocity_rms(output.ravel(), self.sampling_rate, unit))
        windows, evidence = joined_tables(parts)
        windows.insert(0, "start", np.concatenate(starts))
        if self.has_profile:
            windows.insert(1, "rpm", np.concatenate(speeds))
        verdict = self.judge.recording(windows, evidence)
        if velocities[0] is not None:
            # Blocks are of equal length, except for the last, which may be too short.
            stated = [velocity for velocity in velocities if velocity is not None]
            verdict["velocity_rms_mm_s"] = float(np.sqrt(np.mean(np.square(stated))))
        return windows, verdict


class RecordingModel:
    """Model that diagnoses recordings."""

    def windows(
        self, recording: ListedRecording, resample: bool = False
    ) -> tuple[Iterator[NDArray[Any]], float | None]:
        """Return an iterator of the rows of a recording, and their sampling rate."""
        raise NotImplementedError

    def with_channel(self, recording: ListedRecording) -> ListedRecording:
        """Return the recording with the channels of the model, if it has some."""
        return recording

    def fitted(self, row: NDArray[Any], sampling_rate: float | None) -> Any:
        """Return the fitted pipeline that diagnoses a row."""
        raise NotImplementedError

    def rows_of(
        self, recording: ListedRecording, resample: bool = False
    ) -> RecordingRows:
        """Return the rows of a recording with their speeds."""
        raise NotImplementedError

    def remarks(
        self,
        recording: ListedRecording,
        rows: RecordingRows,
        windows: pd.DataFrame,
        verdict: dict[str, Any],
    ) -> Iterator[str]:
        """Yield remarks on a recording, its windows and the verdict."""
        raise NotImplementedError

    def diagnose(self, recording: ListedRecording, resample: bool = False) -> Diagnosis:
        """Diagnose a recording, block by block."""
        rows = self.rows_of(recording, resample)
        windows, verdict = rows.verdict()
        remarks = [*self.remarks(recording, rows, windows, verdict)]
        return Diagnosis(verdict, windows, rows.sampling_rate, remarks)
