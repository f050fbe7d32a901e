"""The report of `diagnose` as one HTML file, without network, to read on a telephone and print."""

from html import escape

import numpy as np
import pandas as pd

from ..bearings import fault_lines
from ..verdicts import FAULTY, NO_SIGNAL
from .html_charts import COLOURS, NO_SIGNAL_COLOUR, spectrum_chart, timeline
from .models import SavedModel
from .order_chart import found_speed, order_chart
from .recording_task import Diagnosis
from .report import number_text
from .results import MARK

_STYLE = """
:root { color-scheme: light; --line: #d9dce1; --soft: #5d626b; }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 60rem; padding: 1rem; color: #1b1d21; background: #fff;
  font: 16px/1.45 system-ui, "Segoe UI", Roboto, "DejaVu Sans", sans-serif; }
h1 { font-size: 1.5rem; margin: .2em 0; } h2 { font-size: 1.15rem; margin: 1.6em 0 .4em;
  break-after: avoid; }
h3 { font-size: 1rem; margin: 0; overflow-wrap: anywhere; }
p { margin: .4em 0; } .soft { color: var(--soft); font-size: .9rem; overflow-wrap: anywhere; }
.counts { display: flex; flex-wrap: wrap; gap: .5rem; padding: 0; list-style: none; }
.counts li { border: 1px solid var(--line); border-left: .5rem solid var(--c); padding: .3rem .7rem;
  border-radius: .3rem; } .counts b { font-size: 1.3rem; margin-right: .3rem; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-size: .92rem; }
th, td { text-align: left; padding: .3rem .6rem; border-bottom: 1px solid var(--line); }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; }
td.name { overflow-wrap: anywhere; min-width: 9rem; } a { color: inherit; }
.short { white-space: nowrap; }
table.matrix { width: auto; } table.matrix td.hit { background: #dcefe9; font-weight: 600; }
.mark { display: inline-block; width: .8em; height: .8em; border-radius: .15em;
  background: var(--c); margin-right: .35em; }
section { border: 1px solid var(--line); border-radius: .4rem; padding: .8rem; margin: .9rem 0;
  break-inside: avoid; }
.remark { border-left: .3rem solid #b8860b; padding-left: .6rem; } .error { border-color: #b3261e; }
svg { display: block; width: 100%; max-width: 52rem; height: auto; margin-top: .5rem; }
svg text { font-size: 8px; fill: var(--soft); } .axis { stroke: var(--line); }
@media (max-width: 34rem) { body { padding: .6rem; } svg text { font-size: 12.5px; }
  .wide { display: none; } table { font-size: .85rem; } th, td { padding: .3rem .25rem; }
  td.name { min-width: 5rem; } }
@media print { body { max-width: none; padding: 0; font-size: 11pt; }
  * { print-color-adjust: exact; -webkit-print-color-adjust: exact; } a { text-decoration: none; } }
"""


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
    rows = rows.assign(verdict=rows["verdict"].map(str, na_action="ignore"))
    names = [str(name) for name in model.conditions]
    names += [FAULTY] if FAULTY not in names and len(names) == 1 else []
    colour_of = {name: COLOURS[i % len(COLOURS)] for i, name in enumerate(names)}
    colour_of[NO_SIGNAL] = NO_SIGNAL_COLOUR
    sections = [
        _section(number, row, diagnosis, model, colour_of, faults)
        for number, (row, diagnosis) in enumerate(zip(_dicts(rows), diagnoses, strict=True))
    ]
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        f'<meta name="generator" content="{MARK}">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>Diagnosis of {len(rows)} recordings</title><style>{_STYLE}</style></head><body>"
        f"<h1>Diagnosis of {len(rows)} recordings</h1>"
        f'<p class="soft">{escape(heading)}</p>'
        f"{_counts(rows, colour_of)}{_accuracy(rows, colour_of)}"
        f"<h2>Recordings</h2>{_overview(rows, colour_of)}"
        f"<h2>Each recording</h2>{''.join(sections)}"
        "</body></html>\n"
    )


def _sorted(names, order):
    places = {name: place for place, name in enumerate(order)}
    return sorted(names, key=lambda name: places.get(name, len(places)))


def _counts(rows, colour_of):
    counts = rows["verdict"].value_counts(dropna=True)
    items = [_count(colour_of[name], counts[name], name) for name in colour_of if name in counts]
    n_failed = int((rows["error"] != "").sum())
    if n_failed:
        items.append(_count("#b3261e", n_failed, "failed"))
    return f'<ul class="counts">{"".join(items)}</ul>'


def _count(colour, count, name):
    return f'<li style="--c:{colour}"><b>{count}</b>{escape(name)}</li>'


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


def _overview(rows, colour_of):
    lines, has_p_values = [], "p-value" in rows
    for number, row in enumerate(_dicts(rows)):
        cells = [
            f'<td class="name"><a href="#r{number}">{escape(row["recording"])}</a></td>',
            f"<td>{_verdict(row, colour_of)}</td>",
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


def _section(number, row, diagnosis, model, colour_of, faults):
    title = f'<section id="r{number}"><h3>{escape(row["recording"])}</h3>'
    if diagnosis.error is not None:
        return f'{title}<p class="remark error">{escape(row["error"])}</p></section>'
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
        f"<p><b>{_verdict(row, colour_of)}</b>{certain}; {alarms}"
        f"{f'; p-value {_p_value(row)}' if _p_value(row) else ''}</p>",
        f'<p class="soft">{escape("; ".join(stated))}</p>' if stated else "",
        *(f'<p class="remark">{escape(remark)}</p>' for remark in diagnosis.remarks),
        timeline(diagnosis.windows, model.conditions, colour_of, seconds),
    ]
    if diagnosis.spectrum is not None:
        parts += [
            spectrum_chart(diagnosis.spectrum, colour_of, rate),
            _legend(diagnosis, colour_of),
        ]
    if diagnosis.orders is not None:
        parts += [
            order_chart(diagnosis.orders, colour_of, faults or {}),
            _order_legend(diagnosis.orders, colour_of, faults),
        ]
    return "".join(parts) + "</section>"


def _legend(diagnosis, colour_of):
    names = list(diagnosis.spectrum["references"])
    row = "window" if diagnosis.orders is None else "stretch"
    marks = ", ".join(
        f'<span class="mark" style="--c:{colour_of[name]}"></span>{escape(name)}{dashed}'
        for name, dashed in zip(names, ("", " (dashed)"), strict=False)
    )
    return (
        f'<p class="soft"><span class="mark" style="--c:#1b1d21"></span>{row} '
        f"{diagnosis.spectrum['place']}, a typical one, over the references of the nearest "
        f"conditions: {marks}. What the model of the signal leaves, smoothed, without the gain.</p>"
    )


def _order_legend(view, colour_of, faults):
    found = "; ".join(
        f'<span class="mark" style="--c:{colour_of[name]}"></span>{escape(name)}, '
        f"residual {each['residual']:.2f}, {found_speed(each['factor'], view['rpm'])}"
        for name, each in view["conditions"].items()
    )
    marks = ""
    if faults is not None:
        lines = fault_lines(faults, view["orders"][-1])
        listed = ", ".join(f"{name} {order:.4g}" for name, k, order in lines if k == 1)
        marks = f" Lines at the orders of the bearing's faults and their multiples: {listed}."
    return (
        f'<p class="soft"><span class="mark" style="--c:#1b1d21"></span>stretch {view["place"]}, '
        "spectrum of its envelope over orders, the multiples of the shaft's speed, at the speed "
        f"that suits each condition best: {found}.{marks}</p>"
    )


def _verdict(row, colour_of):
    if pd.isna(row["verdict"]):
        return "failed"
    colour = colour_of[row["verdict"]]
    name = str(row["verdict"])
    said = f'<span class="mark" style="--c:{colour}"></span>{escape(name)}'
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
