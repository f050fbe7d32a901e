"""Diagnosis by the orders of a bearing, without training."""

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ..core.fault_locations import FAULTS, HEALTHY
from ..core.speeds import SPEED_FACTOR
from ..diagnosers import make_fault_order_classifier
from ..recordings.listing import ListedRecording
from ..recordings.rates import NO_RATE
from ..verdicts.judge import Judge
from .recording_rows import RecordingModel, RecordingRows
from .remarks import NO_COMB, verdict_remarks

#: Error on a recording of unknown speed.
_NO_SPEED = "rpm is missing; expected --rpm, a column, or the file to state it"


class BearingOrders(RecordingModel):
    """Fault locations by the orders of a bearing, with a pipeline fitted to each recording.

    A recording is one row.

    Parameters
    ----------
    bearing : str
        The bearing, as `skarxlag.bearings.bearing_orders` takes it.
    """

    sampling_rate = None
    takes_rpm = True
    healthy = HEALTHY
    conditions = (HEALTHY, *FAULTS)

    def __init__(self, bearing: str) -> None:
        self.bearing = bearing
        facts = {"conditions": self.conditions, "healthy": HEALTHY}
        self.summary = {"bearing": bearing} | facts
        self.load = partial(BearingOrders, bearing)
        self.identity = f"bearing {bearing}"
        self.heading = (
            f"No model: fault locations by the orders of bearing {bearing}. {HEALTHY} "
            f"means that no comb exceeds the limit of other healthy machines. {NO_COMB}"
        )

    def windows(
        self, recording: ListedRecording, resample: bool = False
    ) -> tuple[Iterator[NDArray[Any]], float | None]:
        """Return the recording as one row, and its sampling rate."""
        ((signal, sampling_rate),) = recording.blocks()
        return iter([signal[np.newaxis]]), sampling_rate

    def fitted(self, row: NDArray[Any], sampling_rate: float | None) -> Any:
        """Return a pipeline that is fitted to the row."""
        options = {"bearing": self.bearing, "sampling_rate": sampling_rate}
        return make_fault_order_classifier(**options).fit(row[np.newaxis])

    def rows_of(
        self, recording: ListedRecording, resample: bool = False
    ) -> RecordingRows:
        """Read a recording as one row, and fit the pipeline to it."""
        recording = recording.with_speed()
        (X,), sampling_rate = self.windows(recording)
        if sampling_rate is None:
            raise ValueError(f"{recording.name}: {NO_RATE}")
        if recording.rpm is None:
            raise ValueError(f"{recording.name}: {_NO_SPEED}")
        rpm = recording.speeds([0], X.shape[-1], sampling_rate)
        first = 0
        if recording.profile is not None:
            # A run-up may begin at rest, and a run-down end there.
            fast = np.flatnonzero(SPEED_FACTOR * rpm[0] >= rpm.max())
            first, end = fast[0], fast[-1] + 1
            X, rpm = X[..., first:end], rpm[:, first:end]
        # Its limits hold at the speed of the row that it is fitted to.
        facts = {"conditions": self.conditions, "train_rpm": [np.mean(rpm)]}
        judge = Judge(self.fitted(X[0], sampling_rate), **facts)
        blocks = [(np.array([first]), X, rpm)]
        return RecordingRows(recording, blocks, sampling_rate, judge)

    def remarks(
        self,
        recording: ListedRecording,
        rows: RecordingRows,
        windows: pd.DataFrame,
        verdict: dict[str, Any],
    ) -> Iterator[str]:
        """Yield the evidence of combs, and remarks on the verdict."""
        if "evidence" in windows:
            for text in windows["evidence"].dropna():
                yield f"{text[0].upper()}{text[1:]}."
        if verdict["verdict"] == HEALTHY:
            yield NO_COMB
        yield from verdict_remarks(windows, verdict)
