"""Report of `diagnose`: recordings by severity, and pictures of the most severe."""

from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from functools import lru_cache, partial
from typing import Any

import numpy as np
import pandas as pd

from ...bearings import bearing_orders
from ...core.fault_locations import NO_FINDING
from ...core.validation import output_of_windows
from ...verdicts.names import NO_SIGNAL, NO_VERDICT
from ..commands.diagnosis import Diagnosis
from ..commands.messages import CommandError, counted, percent
from ..commands.results import agreement, records
from ..readers.listing import ListedRecording
from ..readers.rates import rates_agree
from .drawings import order_pictures, recording_pictures, windows_picture
from .pages import render
from .recording_overview import STRETCH, Stretch, overview

#: Recordings with pictures, the most severe first.
MOST_DRAWN = 20
#: Healthy recordings next to whose spectra a spectrum is drawn: those of the nearest
#: speeds.
_MOST_HEALTHY = 5
#: CSS classes of verdicts, the most severe first.
_SEVERITIES = ("fault", "unclear", "open", "healthy")
_READING_ERRORS = (OSError, ValueError, ImportError, CommandError)


def html_report(
    model: Any,
    recordings: Sequence[ListedRecording],
    diagnoses: Sequence[Diagnosis],
    rows: pd.DataFrame,
    resample: bool = False,
    bearing: str | None = None,
) -> str:
    """Return the report of a run.

    The most severe recordings come first. Recordings that are not healthy have a
    section with details, and the first 20 recordings have pictures, too.

    Parameters
    ----------
    model : RecordingModel
        What diagnosed the recordings.
    recordings, diagnoses : sequence
        The recordings, and their results.
    rows : DataFrame
        As `recording_rows` returns them.
    resample : bool, default=False
        Whether recordings were brought to the sampling rate of the model.
    bearing : str or None, default=None
        Bearing whose lines are marked; None: that of the model, if it has one.

    Returns
    -------
    str
        The page.
    """
    verdicts = rows["verdict"].astype(str)
    # The section of a recording has the reason, too.
    labels = verdicts.where(rows["error"] == "", NO_VERDICT)
    severity = labels.map(partial(verdict_style, healthy=str(model.healthy)))
    rows = rows.assign(
        verdict=verdicts,
        label=labels,
        severity=pd.Categorical(severity, _SEVERITIES, ordered=True),
        remarks=[diagnosis.remarks for diagnosis in diagnoses],
        has_alarm=rows["alarm"] == "yes",
    )
    ranked = rows.sort_values(
        ["severity", "has_alarm", "p_value", "probability"],
        ascending=[True, False, True, False],
        kind="stable",
    )
    entries = records(ranked)
    n_drawn = min(len(entries), MOST_DRAWN)
    drawing = RunPictures(model, recordings, diagnoses, rows, resample, bearing)
    for place, entry in zip(ranked.index[:n_drawn], entries, strict=False):
        entry["figures"] = drawing.of_recording(place)
    counts = Counter((entry["label"], entry["severity"]) for entry in entries)
    return render(
        "report",
        model=model,
        percent=percent,
        entries=entries,
        n_recordings=counted(len(entries), "recording"),
        counts=counts.items(),
        n_drawn=n_drawn,
        n_detailed=max(int((severity != "healthy").sum()), n_drawn),
        accuracy=stated_conditions(rows, model.conditions),
        agreement=agreement(rows, model),
    )


def stated_conditions(rows: pd.DataFrame, conditions: Sequence[Any]) -> pd.DataFrame:
    """Return counts of verdicts (columns) by stated condition (rows)."""
    judged = rows[rows["condition"].notna() & (rows["error"] == "")]
    names = dict.fromkeys(
        [*map(str, conditions), *judged["condition"], *judged["verdict"]]
    )
    in_order = pd.CategoricalDtype([*names])
    return pd.crosstab(
        judged["condition"].astype(in_order), judged["verdict"].astype(in_order)
    )


def verdict_style(verdict: str, healthy: str) -> str:
    """Return the style of a verdict: that of a fault, of healthy, or of no verdict.

    Examples
    --------
    >>> verdict_style("inner race", "normal"), verdict_style("no signal", "normal")
    ('fault', 'unclear')
    """
    if verdict == healthy:
        return "healthy"
    if verdict == NO_FINDING:
        return "open"
    return "unclear" if verdict in (NO_SIGNAL, NO_VERDICT) else "fault"


class RunPictures:
    """Pictures of the recordings of a run, next to the healthy ones of the same run.

    Parameters
    ----------
    model, recordings, diagnoses, rows, resample, bearing
        As in `html_report`.
    """

    def __init__(
        self,
        model: Any,
        recordings: Sequence[ListedRecording],
        diagnoses: Sequence[Diagnosis],
        rows: pd.DataFrame,
        resample: bool,
        bearing: str | None,
    ) -> None:
        self._model = model
        self._recordings = recordings
        self._diagnoses = diagnoses
        self._resample = resample
        self._bearing = bearing or model.summary.get("bearing")
        healthy = str(model.healthy)
        has_signal = (rows["error"] == "") & (rows["verdict"] != NO_SIGNAL)
        is_stated = (rows["condition"] == healthy) & has_signal
        is_healthy = is_stated if is_stated.any() else rows["verdict"] == healthy
        self._healthy = np.flatnonzero(is_healthy)
        self._reason = "stated healthy" if is_stated.any() else "healthy by verdict"
        # A healthy recording is compared with several others.
        self._healthy_stretch = lru_cache(MOST_DRAWN)(self._read_healthy_stretch)

    def of_recording(self, place: int) -> list[Any]:
        """Return pictures, and sentences on those that cannot be drawn.

        There are none if the recording has no result, or cannot be read again.

        Parameters
        ----------
        place : int
            Position of the recording in the run.
        """
        windows = self._diagnoses[place].windows
        if windows is None:
            return []
        with suppress(*_READING_ERRORS):
            return self._pictures(place, windows)
        return []

    def _pictures(self, place: int, windows: pd.DataFrame) -> list[Any]:
        model = self._model
        verdict = str(self._diagnoses[place].verdict["verdict"])
        typical = np.flatnonzero(windows["verdict"].astype(str) == verdict)
        middle = typical[len(typical) // 2] if len(typical) else 0
        start = int(windows["start"].iloc[middle])
        view = self._read(place, start)
        stretch = view.stretch
        references = self._references(place, stretch)
        pictures = [*recording_pictures(view, self._bearing, references, self._reason)]
        if len(windows) > 1:
            rate = stretch.sampling_rate
            pictures.insert(1, windows_picture(windows, rate, model.healthy))
        # A model that is fitted to the row itself learned nothing else.
        if verdict != NO_SIGNAL and model.judge is not None:
            speed = stretch.rpm
            if np.ndim(speed) == 1:
                speed = speed[start - view.first :][: view.row.shape[-1]]
            orders = None if self._bearing is None else bearing_orders(self._bearing)
            pictures += order_pictures(model.diagnoser, view.row, speed, orders)
        return pictures

    def _read(self, place, at):
        """Read a recording as the model does, with a stretch around a sample."""
        model = self._model
        opened = model.open(self._recordings[place], self._resample)
        if not model.takes_rpm:
            opened = opened._replace(entry=opened.entry.with_speed())
        rate = opened.sampling_rate or model.sampling_rate
        return overview(opened, model.windows(opened), rate, at)

    def _references(self, place, stretch):
        """Return stretches of the healthy recordings of the nearest speeds."""
        others = self._healthy[self._healthy != place]
        if stretch.rpm is not None:
            speeds = [self._recordings[other].rpm or np.inf for other in others]
            distances = np.abs(np.log(np.array(speeds) / stretch.mean_rpm))
            others = others[np.argsort(distances, kind="stable")]
        return [
            healthy
            for healthy in map(self._healthy_stretch, others[:_MOST_HEALTHY])
            if healthy is not None
            and rates_agree(healthy.sampling_rate, stretch.sampling_rate)
        ]

    def _read_healthy_stretch(self, place):
        """Return the first stretch of a healthy recording; None if it cannot be read again."""
        recording = self._recordings[place]
        with suppress(*_READING_ERRORS):
            opened = self._model.open(recording, self._resample)
            X = next(self._model.windows(opened))
            samples = output_of_windows(X).ravel()[:STRETCH]
            rate = opened.sampling_rate or self._model.sampling_rate
            return Stretch(samples, rate, recording.rpm)
        return None
