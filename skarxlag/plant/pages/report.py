"""Report of `diagnose`: recordings by severity, and figures of the most severe."""

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import lru_cache, partial
from typing import Any

import numpy as np
import pandas as pd

from ...bearings import bearing_orders
from ...core.capabilities import unfolded_steps
from ...core.validation import output_of_windows
from ...models.identification import ARXLaguerre
from ...plotting._fitted import chosen_model
from ...verdicts.names import NO_SIGNAL, NO_VERDICT
from ..commands.diagnosis import Diagnosis
from ..commands.messages import CommandError, counted, percent
from ..commands.results import agreement, records
from ..readers.listing import ListedRecording
from ..readers.rates import rates_agree
from . import recording_views as views
from .figures import verdict_style
from .model_references import order_references_figure, shape_reference_figure
from .pages import render
from .recording_overview import STRETCH, Stretch, overview

#: Recordings with figures, the most severe first.
MOST_DRAWN = 50
#: Healthy recordings next to whose spectra a spectrum is drawn: those of the nearest
#: speeds.
_MOST_HEALTHY = 5
#: CSS classes of verdicts, the most severe first.
_SEVERITIES = ("fault", "unclear", "healthy")
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
    section with details, and the first 50 recordings have figures, too.

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
        ["severity", "has_alarm", "probability", "p_value"],
        ascending=[True, False, False, True],
        kind="stable",
    )
    entries = records(ranked)
    n_drawn = min(len(entries), MOST_DRAWN)
    drawing = RunFigures(model, recordings, diagnoses, rows, resample, bearing)
    for number, entry in zip(ranked.index[:n_drawn], entries, strict=False):
        entry["figures"] = drawing.of_recording(number)
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


class RunFigures:
    """Figures of the recordings of a run, next to the healthy ones of the same run.

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
        bearing = bearing or model.summary.get("bearing")
        self._orders = None if bearing is None else bearing_orders(bearing)
        healthy = str(model.healthy)
        has_signal = (rows["error"] == "") & (rows["verdict"] != NO_SIGNAL)
        is_stated = (rows["condition"] == healthy) & has_signal
        is_healthy = is_stated if is_stated.any() else rows["verdict"] == healthy
        self._healthy = np.flatnonzero(is_healthy)
        self._reason = "stated healthy" if is_stated.any() else "healthy by verdict"
        # A healthy recording is compared with several others.
        self._healthy_stretch = lru_cache(MOST_DRAWN)(self._read_healthy_stretch)

    def of_recording(self, number: int) -> list[Any]:
        """Return figures, and sentences on those that cannot be drawn.

        There are none if the recording has no result, or cannot be read again.

        Parameters
        ----------
        number : int
            Position of the recording in the run.
        """
        windows = self._diagnoses[number].windows
        if windows is None:
            return []
        with suppress(*_READING_ERRORS):
            return [*self._figures(number, windows)]
        return []

    def _figures(self, number: int, windows: pd.DataFrame) -> Iterator[Any]:
        verdict = self._diagnoses[number].verdict["verdict"]
        typical = np.flatnonzero(windows["verdict"].astype(str) == str(verdict))
        middle = typical[len(typical) // 2] if len(typical) else 0
        start = int(windows["start"].iloc[middle])
        view = self._read(number, start)
        stretch = view.stretch
        yield views.signal_figure(view)
        if len(windows) > 1:
            rate = stretch.sampling_rate
            yield views.windows_figure(windows, rate, self._model.healthy)
        if verdict != NO_SIGNAL:
            yield views.orders_figure(stretch, self._orders)
            references = self._references(number, stretch)
            n_before = start - view.first
            yield from self._learned(view.row, stretch, n_before, not references)
            yield views.spectrum_figure(stretch, references, self._reason)

    def _learned(self, row, stretch, n_before, is_alone):
        """Yield figures of a row next to what the model learned, if it compares them."""
        # A model that is fitted to the row itself learned nothing else.
        if self._model.judge is None:
            return
        diagnoser = self._model.diagnoser
        healthy = self._model.healthy
        rate = stretch.sampling_rate
        speed = stretch.rpm
        if np.ndim(speed) == 1:
            speed = speed[n_before:][: row.shape[-1]]
        # Most models compare no order spectra.
        with suppress(ValueError):
            yield order_references_figure(diagnoser, row, speed, healthy)
        if is_alone:
            with suppress(ValueError):
                yield shape_reference_figure(
                    diagnoser, row, stretch.mean_rpm, healthy, rate
                )

    def _read(self, number, at):
        """Read a recording as the model does, with a stretch around a sample."""
        model = self._model
        opened = model.open(self._recordings[number], self._resample)
        if not model.takes_rpm:
            opened = opened._replace(entry=opened.entry.with_speed())
        rate = opened.sampling_rate or model.sampling_rate
        windows = model.windows(opened)
        return overview(opened, windows, rate, self._predictor(rate), at)

    def _predictor(self, rate):
        """Return the predictions of the model's first step, if it is one that predicts."""

        def predict(X):
            estimator = self._model.fitted(X[0], rate)
            identify = unfolded_steps(estimator)[0]
            if not isinstance(identify, ARXLaguerre):
                return np.empty((len(X), 0))
            member, _ = chosen_model(estimator, None)
            return identify.predict_output(X)[:, member]

        return predict

    def _references(self, number, stretch):
        """Return stretches of the healthy recordings of the nearest speeds."""
        others = self._healthy[self._healthy != number]
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

    def _read_healthy_stretch(self, number):
        """Return the first stretch of a healthy recording; None if it cannot be read again."""
        recording = self._recordings[number]
        with suppress(*_READING_ERRORS):
            opened = self._model.open(recording, self._resample)
            X = next(self._model.windows(opened))
            samples = output_of_windows(X).ravel()[:STRETCH]
            rate = opened.sampling_rate or self._model.sampling_rate
            return Stretch(samples, rate, recording.rpm)
        return None
