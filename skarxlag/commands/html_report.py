"""The report of `diagnose` as one HTML file, without network, to read on a telephone and print."""

from html import escape

import numpy as np
import pandas as pd

from ..bearings import fault_lines
from ..verdicts import FAULTY, NO_SIGNAL
from .html_charts import spectrum_chart, timeline
from .html_style import NO_SIGNAL as NO_SIGNAL_CLASS
from .html_style import STYLE, condition_class
from .models import SavedModel
from .names import below_common_folder, counted
from .order_chart import found_speed, order_chart
from .recording_task import Diagnosis
from .report import number_text
from .results import MARK

#: Letters of a condition that are kept on the line of its colour.
_SHORT = 16


def html_report(
    heading: str,
    model: SavedModel,
    rows: pd.DataFrame,
    diagnoses: list[Diagnosis],
    faults: dict[str, float] | None = None,
) -> str:
    """The report.

    Parameters
    ----------
    heading : str
        What the model is, in a sentence.
    model : SavedModel
        The diagnoser.
    rows : DataFrame
        Of `recording_rows`.
    diagnoses : list of Diagnosis
        What came of each recording, in the same order.
    faults : dict of str to float or None, default=None
        Orders of the bearing's faults, as `fault_orders` gives them.

    Returns
    -------
    str
        A document of HTML.
    """
    folder, shown = below_common_folder(rows["recording"])
    rows = rows.assign(recording=shown, verdict=rows["verdict"].map(str, na_action="ignore"))
    names = [str(name) for name in model.conditions]
    names += [FAULTY] if FAULTY not in names and len(names) == 1 else []
    class_of = {name: condition_class(place) for place, name in enumerate(names)}
    class_of[NO_SIGNAL] = NO_SIGNAL_CLASS
    sections = [
        _section(number, row, diagnosis, model, class_of, faults)
        for number, (row, diagnosis) in enumerate(zip(_dicts(rows), diagnoses, strict=True))
    ]
    title = f"Diagnosis of {counted(len(rows), 'recordings')}"
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        f'<meta name="generator" content="{MARK}">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{title}</title><style>{STYLE}</style></head><body>"
        f"<h1>{title}</h1>"
        f'<p class="small">{escape(heading)}</p>'
        f"{_counts(rows, class_of)}{_accuracy(rows, class_of)}"
        f"<h2>Recordings</h2>{_place(folder)}{_overview(rows, class_of)}"
        f"<h2>Each recording</h2>{''.join(sections)}"
        "</body></html>\n"
    )


def _sorted(names, order):
    places = {name: place for place, name in enumerate(order)}
    return sorted(names, key=lambda name: places.get(name, len(places)))


def _counts(rows, class_of):
    counts = rows["verdict"].value_counts(dropna=True)
    items = [_count(class_of[name], counts[name], name) for name in class_of if name in counts]
    n_failed = int((rows["error"] != "").sum())
    if n_failed:
        items.append(_count("loud", n_failed, "failed"))
    return f'<ul class="counts">{"".join(items)}</ul>'


def _count(kind, count, name):
    return f'<li class="{kind}"><b>{count}</b>{escape(name)}</li>'


def _accuracy(rows, order):
    """Share of right verdicts and confusion matrix, where conditions are stated."""
    if "condition" not in rows:
        return ""
    known = rows[rows["condition"].notna() & rows["verdict"].notna()]
    known = known[known["verdict"] != NO_SIGNAL]
    if known.empty:
        return ""
    right = int((known["condition"] == known["verdict"]).sum())
    table = pd.crosstab(known["condition"], known["verdict"])
    # As the model lists its conditions: the healthy one first.
    table = table.reindex(index=_sorted(table.index, order), columns=_sorted(table.columns, order))
    head = "".join(f'<th class="n">{escape(str(name))}</th>' for name in table.columns)
    body = "".join(
        f"<tr><th>{escape(str(true))}</th>"
        + "".join(_cell(count, true == name) for name, count in counts.items())
        + "</tr>"
        for true, counts in table.iterrows()
    )
    share = number_text(100 * right / len(known), 1)
    return (
        f"<h2>Where the condition is stated</h2><p><b>{right} of {len(known)}</b> verdicts "
        f"({share} %) are the stated condition. Rows: stated, columns: verdict.</p>"
        f'<div class="scroll"><table class="matrix"><tr><td></td>{head}</tr>{body}</table></div>'
    )


def _cell(count, is_hit):
    return f'<td class="n{" hit" if is_hit else ""}">{count or "·"}</td>'


def _place(folder):
    return f'<p class="small">All of them are below {escape(folder)}</p>' if folder else ""


def _overview(rows, class_of):
    lines, has_p_values = [], "p-value" in rows
    for number, row in enumerate(_dicts(rows)):
        cells = [
            f'<td class="name"><a href="#r{number}">{escape(row["recording"])}</a></td>',
            f"<td>{_verdict(row, class_of)}</td>",
            f'<td class="n">{_percent(row["confidence"])}</td>',
            f'<td class="n">{_percent(row["alarms"])}</td>',
            *([f'<td class="n">{_p_value(row)}</td>'] if has_p_values else []),
            f'<td class="n wide">{_number(row["windows"])}</td>',
            f'<td class="n wide">{_number(row["no signal"])}</td>',
        ]
        lines.append(f"<tr>{''.join(cells)}</tr>")
    head = (
        '<th>recording</th><th>verdict</th><th class="n">confidence</th><th class="n">alarms</th>'
        + ('<th class="n">p-value</th>' if has_p_values else "")
        + '<th class="n wide">windows</th><th class="n wide">no signal</th>'
    )
    return f'<div class="scroll"><table><tr>{head}</tr>{"".join(lines)}</table></div>'


def _section(number, row, diagnosis, model, class_of, faults):
    title = f'<section id="r{number}"><h3>{escape(row["recording"])}</h3>'
    if diagnosis.error is not None:
        return f'{title}<p class="remark loud">{escape(row["error"])}</p></section>'
    own = (
        "recording",
        "verdict",
        "confidence",
        "windows",
        "no signal",
        "alarms",
        "p-value",
        "none of these",
        "remark",
        "error",
    )
    stated = [
        f"{name.removeprefix('stated ')}: {f'{value:g}' if isinstance(value, float) else value}"
        for name, value in row.items()
        if name not in own and not name.startswith("share of ") and not pd.isna(value)
    ]
    confidence = _percent(row["confidence"])
    certain = f", confidence {confidence}" if confidence else ""
    usable = f"{row['windows'] - row['no signal']} windows"
    alarms = usable if pd.isna(row["alarms"]) else f"alarm in {row['alarms']:.0%} of {usable}"
    rate = diagnosis.sampling_rate or model.sampling_rate
    seconds = None if rate is None else model.window_length / rate
    parts = [
        title,
        f"<p><b>{_verdict(row, class_of)}</b>{certain}; {alarms}"
        f"{f'; p-value {_p_value(row)}' if _p_value(row) else ''}</p>",
        f'<p class="small">{escape("; ".join(stated))}</p>' if stated else "",
        *(f'<p class="remark note">{escape(remark)}</p>' for remark in diagnosis.remarks),
        timeline(diagnosis.windows, model.conditions, class_of, seconds),
    ]
    if diagnosis.spectrum is not None:
        parts += [
            spectrum_chart(diagnosis.spectrum, class_of, rate),
            _legend(diagnosis, class_of),
        ]
    if diagnosis.orders is not None:
        parts += [
            order_chart(diagnosis.orders, class_of, faults or {}),
            _order_legend(diagnosis.orders, class_of, faults),
        ]
    return "".join(parts) + "</section>"


def _legend(diagnosis, class_of):
    names = list(diagnosis.spectrum["references"])
    row = "window" if diagnosis.orders is None else "stretch"
    marks = ", ".join(
        f'<span class="mark {class_of[name]}"></span>{escape(name)}{dashed}'
        for name, dashed in zip(names, ("", " (dashed)"), strict=False)
    )
    return (
        f'<p class="small"><span class="mark ink"></span>{row} '
        f"{diagnosis.spectrum['place']}, a typical one, over the references of the nearest "
        f"conditions: {marks}. What the model of the signal leaves, smoothed, without the gain.</p>"
    )


def _order_legend(view, class_of, faults):
    found = "; ".join(
        f'<span class="mark {class_of[name]}"></span>{escape(name)}, '
        f"residual {each['residual']:.2f}, {found_speed(each['factor'], view['rpm'])}"
        for name, each in view["conditions"].items()
    )
    marks = ""
    if faults is not None:
        lines = fault_lines(faults, view["orders"][-1])
        listed = ", ".join(f"{name} {order:.4g}" for name, k, order in lines if k == 1)
        marks = f" Lines at the orders of the bearing's faults and their multiples: {listed}."
    return (
        f'<p class="small"><span class="mark ink"></span>stretch {view["place"]}, '
        "spectrum of its envelope over orders, the multiples of the shaft's speed, at the speed "
        f"that suits each condition best: {found}.{marks}</p>"
    )


def _verdict(row, class_of):
    if pd.isna(row["verdict"]):
        return "failed"
    name = str(row["verdict"])
    said = f'<span class="mark {class_of[row["verdict"]]}"></span>{escape(name)}'
    return f'<span class="short">{said}</span>' if len(name) < _SHORT else said


def _p_value(row):
    """The p-value of the nearest condition, and what it says."""
    value = row.get("p-value", np.nan)
    if pd.isna(value):
        return ""
    text = f"{value:.2g}"
    return f"{text} <b>none of these</b>" if row["none of these"] else text


def _dicts(rows):
    return rows.to_dict("records")


def _percent(value):
    return "" if pd.isna(value) else f"{value:.0%}"


def _number(value):
    return "" if pd.isna(value) else str(value)
