"""Charts of the report as SVG text: what happened over time, and a spectrum."""

from html import escape
from typing import Any

import numpy as np
import pandas as pd

_MOST_COLUMNS = 192
#: Size and left margin of a chart, in units of its view box.
WIDTH, LEFT = 460, 74


def timeline(
    windows: pd.DataFrame, conditions: list[str], class_of: dict[str, str], seconds: float | None
) -> str:
    """Verdict, confidence, alarm and quality over time, a column for one or several windows.

    Parameters
    ----------
    windows : DataFrame
        Rows of `window_verdicts`.
    conditions : list of str
        As there.
    class_of : dict of str to str
        Class of each verdict.
    seconds : float or None
        Length of a window; None where the sampling rate is not known.

    Returns
    -------
    str
        An svg element.
    """
    groups = np.array_split(np.arange(len(windows)), min(len(windows), _MOST_COLUMNS))
    verdict, alarm = windows["verdict"].to_numpy(), windows["alarm"].to_numpy(dtype=float)
    bad = windows["quality"].to_numpy() != "good"
    confidence = _confidence(windows, conditions)
    width = (WIDTH - LEFT) / len(groups)
    rows = []
    for place, group in enumerate(groups):
        x = LEFT + place * width
        names, counts = np.unique(verdict[group], return_counts=True)
        rows.append(_bar(x, 4, width, 22, class_of[str(names[counts.argmax()])]))
        known = confidence[group][~bad[group]]
        if len(known) and np.isfinite(known).any():
            height = 40 * float(np.nanmean(known))
            rows.append(_bar(x, 74 - height, width, height, "sure"))
        rows.append(_bar(x, 80, width, 12, "loud", alarm[group].mean()))
        rows.append(_bar(x, 98, width, 12, "soft", bad[group].mean()))
    names = [("verdict", 19), ("confidence", 58), ("alarm", 90), ("no signal", 108)]
    labels = [f'<text x="{LEFT - 6}" y="{y}" text-anchor="end">{name}</text>' for name, y in names]
    if not np.isfinite(confidence).any():
        labels.pop(1)
    unit, end = ("windows", len(windows)) if seconds is None else ("s", len(windows) * seconds)
    axis = (
        f'<path d="M{LEFT} 114H{WIDTH}" class="axis"/><text x="{LEFT}" y="127">0</text>'
        f'<text x="{WIDTH}" y="127" text-anchor="end">{end:.4g} {unit}</text>'
    )
    return svg("Verdict over time", 132, "".join([*rows, *labels, axis]))


def spectrum_chart(
    spectrum: dict[str, Any], class_of: dict[str, str], sampling_rate: float | None
) -> str:
    """Spectrum of a window over the references of two conditions.

    Parameters
    ----------
    spectrum : dict
        As `SpectrumView.drawn` gives it.
    class_of : dict of str to str
        Class of each condition.
    sampling_rate : float or None
        In Hz.

    Returns
    -------
    str
        An svg element.
    """
    frequency = np.array(spectrum["frequency"])
    curves = [spectrum["window"], *spectrum["references"].values()]
    low, high = np.floor(np.min(curves) / 10) * 10, np.ceil(np.max(curves) / 10) * 10
    x = LEFT + frequency * 2 * (WIDTH - LEFT)

    def path(curve, style):
        y = 10 + 150 * (high - np.array(curve)) / max(high - low, 1)
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
        return f'<polyline points="{points}" {style}/>'

    lines = [
        path(curve, f'class="{class_of[name]}" stroke-width="2.5" stroke-dasharray="{dash}"')
        for (name, curve), dash in zip(
            spectrum["references"].items(), ("none", "7 4"), strict=False
        )
    ]
    lines.append(path(spectrum["window"], 'class="ink" stroke-width="1.4"'))
    unit, end = "cycles a sample", 0.5
    if sampling_rate is not None:
        unit, end = (
            ("kHz", sampling_rate / 2000) if sampling_rate > 2000 else ("Hz", sampling_rate / 2)
        )
    axes = (
        f'<path d="M{LEFT} 8V162H{WIDTH}" class="axis"/>'
        f'<text x="{LEFT - 6}" y="18" text-anchor="end">{high:g} dB</text>'
        f'<text x="{LEFT - 6}" y="160" text-anchor="end">{low:g} dB</text>'
        f'<text x="{LEFT}" y="176">0</text>'
        f'<text x="{WIDTH}" y="176" text-anchor="end">{end:.5g} {unit}</text>'
    )
    return svg("Spectrum of a typical window", 182, axes + "".join(lines))


def _confidence(windows, conditions):
    names = [f"probability of {name}" for name in conditions]
    if names[0] not in windows:
        return np.full(len(windows), np.nan)
    return windows[names].to_numpy(dtype=float).max(axis=1)


def _bar(x, y, width, height, kind, opacity=1.0):
    # Not a number: the diagnoser raises no alarms.
    if opacity == 0 or height == 0 or np.isnan(opacity):
        return ""
    # A little wider than its column, or hairlines show between neighbours.
    size = f'x="{x:.2f}" y="{y:.1f}" width="{width + 0.3:.2f}" height="{height:.1f}"'
    return f'<rect {size} class="{kind}" opacity="{opacity:.2g}"/>'


def svg(title: str, height: float, content: str) -> str:
    """An svg element as wide as every chart.

    Parameters
    ----------
    title : str
        What it shows, for readers who do not see it.
    height : float
        In units of the view box.
    content : str
        Its elements.

    Returns
    -------
    str
        The element.
    """
    return (
        f'<svg viewBox="0 0 {WIDTH + 4} {height}" role="img" aria-label="{escape(title)}">'
        f"{content}</svg>"
    )
