"""Report of `diagnose`: recordings by severity, and pictures of the most severe."""

from collections import Counter
from collections.abc import Sequence
from functools import partial
from typing import Any

import pandas as pd

from ...bearings import bearing_orders
from ...core.fault_locations import NO_FINDING
from ...verdicts.names import NO_SIGNAL, NO_VERDICT
from ..commands.diagnosis import Diagnosis
from ..commands.messages import CommandError, counted, percent
from ..commands.results import records
from ..readers.listing import ListedRecording
from . import render
from .pictures import order_pictures, recording_pictures, view_recording

#: Recordings with pictures, the most severe first.
MOST_DRAWN = 20
#: CSS classes of verdicts, the most severe first.
_SEVERITIES = ("fault", "unclear", "open", "healthy")


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
    severity = labels.map(partial(_style, healthy=str(model.healthy)))
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
    bearing = bearing or model.facts.get("bearing")
    for place, entry in zip(ranked.index[:n_drawn], entries, strict=False):
        entry["figures"] = _figures(
            model, recordings[place], diagnoses[place], resample, bearing
        )
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
    )


def _style(verdict, healthy):
    """Return the style of a verdict."""
    styles = {
        healthy: "healthy",
        NO_FINDING: "open",
        NO_SIGNAL: "unclear",
        NO_VERDICT: "unclear",
    }
    return styles.get(verdict, "fault")


def _figures(model, recording, diagnosis, resample, bearing):
    """Return pictures of a recording, and sentences on those that cannot be drawn.

    There are none if the recording has no result, or cannot be read again.
    """
    windows = diagnosis.windows
    if windows is None:
        return []
    verdict = str(diagnosis.verdict["verdict"])
    typical = windows.loc[windows["verdict"].astype(str) == verdict, "start"]
    start = typical.iloc[len(typical) // 2] if len(typical) else 0
    try:
        opened = model.open(recording, resample)
        if not model.takes_rpm:
            opened = opened._replace(entry=opened.entry.with_speed())
        rate = opened.sampling_rate or model.sampling_rate
        view = view_recording(opened, rate, at=int(start))
    except (OSError, ValueError, ImportError, CommandError):
        return []
    pictures = [*recording_pictures(view, bearing)]
    # A model that is fitted to the row itself learned nothing else.
    if verdict != NO_SIGNAL and model.judge is not None:
        orders = None if bearing is None else bearing_orders(bearing)
        row = view.row(int(start), model.window_length)
        pictures += order_pictures(model.diagnoser, *row, orders)
    return pictures
