"""Run ``skarxlag trend``: draw results and logs over weeks."""

import argparse
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from ...core.files import write_atomically
from ...verdicts.names import NO_VERDICT
from ..pages.figures import (
    Axis,
    DateAxis,
    Figure,
    Mark,
    Strips,
    curve,
    dots,
    verdict_strips,
    verdict_style,
)
from ..pages.pages import render
from ..pages.trend_data import read_rows
from .messages import percent, printable

#: Parts of the time axis, at most.
_MOST_PARTS = 240
#: Events in the list of a sensor, at most.
_MOST_EVENTS = 200
#: A pause is a gap if it is this many times as long as the median one, and an hour.
_GAP_FACTOR = 20
_LEAST_GAP = pd.Timedelta(hours=1)
#: Severity of styles: a sensor whose alarm is on comes first.
_SEVERITIES = ("fault", "unclear", "healthy")
#: Titles of quantities, and the ends of their axes that are not those of their values.
_QUANTITIES = {
    "alarm_level": ("Alarm level (1 raises the alarm)", {"low": 0.0, "high": 1.05}),
    "p_value": ("p-value (power of ten)", {"high": 0.2}),
    "probability": ("Probability of the verdict", {"low": 0.0, "high": 1.05}),
    "velocity_rms": ("Velocity RMS (mm/s)", {"low": 0.0}),
}


class Event(NamedTuple):
    """Event of a sensor.

    Parameters
    ----------
    time : str
        When it happened.
    text : str
        What happened.
    style : str
        CSS class.
    """

    time: str
    text: str
    style: str


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    rows = read_rows(args.files, args.time, args.sensor)
    sensors = [_sensor(*group) for group in rows.groupby("sensor", sort=True)]
    sensors.sort(key=lambda sensor: _SEVERITIES.index(sensor["style"]))
    files = ", ".join(printable(path.name) for path in args.files)
    page = render("trend", sensors=sensors, files=files, n_rows=len(rows))
    write_atomically(args.output, page.encode())
    print(f"Written: {args.output}")
    return 0


def _sensor(name: Any, rows: pd.DataFrame) -> dict[str, Any]:
    """Return name, state, figures and events of a sensor."""
    verdicts = rows["verdict"].fillna(NO_VERDICT).astype(str).str.partition(":")[0]
    rows = rows.assign(verdict=verdicts, healthy=rows["healthy"].astype(str))
    last = rows.iloc[-1]
    state = last["verdict"]
    style = verdict_style(state, last["healthy"])
    if pd.notna(last["probability"]):
        state += f", probability {percent(last['probability'])}"
    if pd.notna(last["alarm"]):
        state += f"; alarm {'on' if last['alarm'] else 'off'}"
    events = _events(rows)
    return {
        "name": printable(name),
        "state": state,
        "style": "fault" if last["alarm"] == 1 else style,
        "at": _text(last["time"]),
        "figures": _figures(rows) if (rows["kind"] == "verdict").any() else [],
        "events": events[: -_MOST_EVENTS - 1 : -1],
        "n_events": len(events),
    }


def _text(time):
    is_date = isinstance(time, pd.Timestamp)
    return f"{time:%Y-%m-%d %H:%M:%S}" if is_date else f"recording {time}"


def _figures(rows: pd.DataFrame) -> list[Any]:
    """Return figures of one sensor; a quantity that is not known has none."""
    x, moments = _time_axis(rows["time"])
    rows = rows.assign(share=x.share(moments))[rows["kind"] == "verdict"]
    n_parts = min(_MOST_PARTS, len(rows))
    part = np.minimum((rows["share"] * n_parts).astype(int), n_parts - 1).to_numpy()
    healthy = rows["healthy"].iloc[-1]
    strips = verdict_strips(rows, healthy, part, n_parts, "", "alarm")
    figures: list[Any] = [Strips("Verdicts and alarm", x, strips)]
    for name, (title, ends) in _QUANTITIES.items():
        values = rows[name].to_numpy()
        if name == "p_value":
            values = np.log10(np.maximum(values, np.finfo(float).tiny))
        if np.isfinite(values).any():
            y = replace(Axis.around(title, values), **ends)
            extremes = pd.Series(y.share(values)).groupby(part).agg(["min", "max"])
            extremes = extremes.reindex(range(n_parts))
            figures.append(Figure(title, x, y, _ranges(extremes)))
    return figures


def _time_axis(times: pd.Series) -> tuple[Axis, Any]:
    """Return the axis of some times, and their positions on it."""
    if isinstance(times.iloc[0], pd.Timestamp):
        moments = times.astype("datetime64[ns, UTC]").astype("int64").to_numpy() / 1e9
        end = moments[0] + max(moments[-1] - moments[0], 60.0)
        return DateAxis("Time (UTC)", moments[0], end), moments
    moments = times.to_numpy(dtype=float)
    return Axis("Number of the recording", moments[0] - 0.5, moments[-1] + 0.5), moments


def _ranges(extremes: pd.DataFrame) -> list[Mark]:
    """Return a curve through the extremes of equal parts of the axis, and their maxima."""
    centre = (np.arange(len(extremes)) + 0.5) / len(extremes)
    path = curve(np.repeat(centre, 2), extremes.to_numpy().ravel())
    highest = dots(centre, extremes["max"])
    return [Mark(path, "signal", ""), Mark(highest, "signal dots", "")]


def _events(rows: pd.DataFrame) -> list[Event]:
    """Return changes of verdict, alarm, model and problem, acknowledgements and gaps."""
    states = rows[["verdict", "alarm", "model", "problem"]].astype(object)
    # Missing values would differ from themselves.
    states = states.where(states.notna(), "")
    before = states.shift(fill_value="")
    is_new = states != before
    is_acknowledged = rows["kind"] == "acknowledged"
    gaps = _gaps(rows["time"])
    events = []
    for row in rows.index[is_new.any(axis=1) | is_acknowledged | (gaps != "")]:
        state = states.loc[row]
        changed = is_new.loc[row]
        texts = {}
        if gaps[row]:
            texts[f"no rows for {gaps[row]}"] = "unclear"
        if is_acknowledged[row]:
            texts["alarm acknowledged"] = "unclear"
        if changed["model"] and state["model"] and before.at[row, "model"]:
            texts[f"another model: {state['model']}"] = "unclear"
        if changed["verdict"]:
            style = verdict_style(state["verdict"], rows.at[row, "healthy"])
            texts[f"verdict: {state['verdict']}"] = style
        if changed["alarm"] and state["alarm"] != "":
            is_on = bool(state["alarm"])
            texts[f"alarm {'on' if is_on else 'off'}"] = "fault" if is_on else "healthy"
        if changed["problem"] and state["problem"]:
            texts[printable(state["problem"])] = "unclear"
        time = _text(rows.at[row, "time"])
        events += [Event(time, text, style) for text, style in texts.items()]
    return events


def _gaps(times: pd.Series) -> pd.Series:
    """Return the length of the gap before each row as text, empty if there is none."""
    texts = pd.Series("", times.index)
    if isinstance(times.iloc[0], pd.Timestamp):
        pause = times.diff()
        is_gap = pause > max(_GAP_FACTOR * pause.median(), _LEAST_GAP)
        texts[is_gap] = pause[is_gap].dt.round("s").astype(str)
    return texts
