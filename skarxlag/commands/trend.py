"""Run ``skarxlag trend``: draw results and logs over weeks."""

import argparse
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from ..core.files import write_atomically
from ..verdicts.names import NO_VERDICT
from .figures import (
    Axis,
    DateAxis,
    Figure,
    Mark,
    Strips,
    curve,
    dots,
    strip,
    verdict_style,
)
from .messages import percent, printable
from .pages import render
from .trend_data import read_rows

#: Parts of the time axis, and events in the list of a sensor, at most.
_PARTS, _MOST_EVENTS = 240, 200
#: A pause is a gap if it is this many times as long as the median one, and an hour.
_GAP_FACTOR, _LEAST_GAP = 20, pd.Timedelta(hours=1)


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
    # A sensor whose alarm is on comes first.
    sensors.sort(
        key=lambda sensor: ("fault", "unclear", "healthy").index(sensor["style"])
    )
    files = ", ".join(printable(path.name) for path in args.files)
    page = render("trend", sensors=sensors, files=files, n_rows=len(rows))
    write_atomically(args.output, page.encode())
    print(f"Written: {args.output}")
    return 0


def _sensor(name: Any, rows: pd.DataFrame) -> dict[str, Any]:
    """Return name, state, figures and events of a sensor."""
    rows = rows.assign(verdict=rows["verdict"].fillna(NO_VERDICT).astype(str))
    rows["verdict"] = rows["verdict"].str.partition(":")[0]
    rows["healthy"] = rows["healthy"].astype(str)
    diagnosed = rows[rows["kind"] == "verdict"]
    last = rows.iloc[-1]
    events = _events(rows)
    state = last["verdict"]
    if last["probability"] == last["probability"]:
        state += f", probability {percent(last['probability'])}"
    if last["alarm"] == last["alarm"]:
        state += f"; alarm {'on' if last['alarm'] else 'off'}"
    return {
        "name": printable(name),
        "state": state,
        "style": "fault"
        if last["alarm"] == 1
        else verdict_style(last["verdict"], last["healthy"]),
        "at": _text(last["time"]),
        "figures": _figures(diagnosed) if len(diagnosed) else [],
        "events": events[: -_MOST_EVENTS - 1 : -1],
        "n_events": len(events),
    }


def _text(time):
    is_date = isinstance(time, pd.Timestamp)
    return f"{time:%Y-%m-%d %H:%M:%S}" if is_date else f"recording {time}"


def _figures(rows: pd.DataFrame) -> list[Any]:
    """Return figures of one sensor; a quantity that is not known has none."""
    is_dated = isinstance(rows["time"].iloc[0], pd.Timestamp)
    if is_dated:
        at = rows["time"].astype("datetime64[ns, UTC]").astype("int64").to_numpy() / 1e9
        width = max(at[-1] - at[0], 60.0)
        x: Axis = DateAxis("Time (UTC)", at[0], at[0] + width)
    else:
        at = rows["time"].to_numpy(dtype=float)
        x = Axis("Number of the recording", at[0] - 0.5, at[-1] + 0.5)
    share = np.clip(x.share(at), 0, 1)
    n_parts = min(_PARTS, len(rows))
    part = np.minimum((share * n_parts).astype(int), n_parts - 1)
    centre = (np.arange(n_parts) + 0.5) / n_parts
    figures: list[Any] = [_strips(rows, part, n_parts, x)]
    quantities = {
        "alarm_level": ("Alarm level", 0.0, 1.05),
        "p_value": ("p-value (power of ten)", None, 0.2),
        "probability": ("Probability of the verdict", 0.0, 1.05),
        "velocity_rms": ("Velocity RMS (mm/s)", 0.0, None),
    }
    for name, (title, low, high) in quantities.items():
        values = rows[name].to_numpy()
        if name == "p_value":
            values = np.log10(np.maximum(values, np.finfo(float).tiny))
        if not np.isfinite(values).any():
            continue
        around = Axis.around(title, values)
        y = Axis(
            title,
            around.low if low is None else low,
            around.high if high is None else high,
        )
        grouped = pd.Series(values).groupby(part)
        lows, highs = (
            y.share(extreme.reindex(range(n_parts)))
            for extreme in (grouped.min(), grouped.max())
        )
        marks = [
            Mark(
                curve(np.repeat(centre, 2), np.ravel([lows, highs], "F")),
                "signal",
                "",
            ),
            Mark(dots(centre, highs), "signal dots", ""),
        ]
        figures.append(Figure(title, x, y, marks))
    return figures


def _strips(rows, part, n_parts, x):
    """Return the shares of verdicts, and of the alarm, over time."""
    healthy = rows["healthy"].iloc[-1]
    counts = rows["verdict"].value_counts()
    strips = [
        strip(
            rows["verdict"] == name,
            part,
            n_parts,
            verdict_style(name, healthy),
            f"{name}: {counts[name]} of {len(rows)}",
        )
        for name in counts.index
    ]
    if rows["alarm"].notna().any():
        is_on = rows["alarm"] == 1
        label = f"alarm: {int(is_on.sum())} of {len(rows)}"
        strips.append(strip(is_on, part, n_parts, "fault", label))
    return Strips("Verdicts and alarm", x, strips)


def _events(rows: pd.DataFrame) -> list[Event]:
    """Return changes of verdict, alarm, model and problem, acknowledgements and gaps."""
    states = rows[["verdict", "alarm", "model", "problem"]].astype(object)
    # Missing values would differ from themselves.
    states = states.where(states.notna(), "")
    is_new = states.ne(states.shift()).any(axis=1) | (rows["kind"] == "acknowledged")
    pauses = pd.Series("", rows.index)
    if isinstance(rows["time"].iloc[0], pd.Timestamp):
        pause = rows["time"].diff()
        is_gap = pause > max(_GAP_FACTOR * pause.median(), _LEAST_GAP)
        pauses[is_gap] = pause[is_gap].dt.round("s").astype(str)
        is_new |= is_gap
    events = []
    before = dict.fromkeys(states, "")
    for place in rows.index[is_new]:
        state = states.loc[place].to_dict()
        changed = {
            name: value for name, value in state.items() if value != before[name]
        }
        texts = {}
        if pauses[place]:
            texts[f"no rows for {pauses[place]}"] = "unclear"
        if rows.at[place, "kind"] == "acknowledged":
            texts["alarm acknowledged"] = "unclear"
        if changed.get("model") and before["model"]:
            texts[f"another model: {changed['model']}"] = "unclear"
        if "verdict" in changed:
            style = verdict_style(state["verdict"], rows.at[place, "healthy"])
            texts[f"verdict: {state['verdict']}"] = style
        if changed.get("alarm", "") != "":
            is_on = bool(state["alarm"])
            texts[f"alarm {'on' if is_on else 'off'}"] = "fault" if is_on else "healthy"
        if changed.get("problem"):
            texts[printable(changed["problem"])] = "unclear"
        time = _text(rows.at[place, "time"])
        events += [Event(time, text, style) for text, style in texts.items()]
        before = state
    return events
