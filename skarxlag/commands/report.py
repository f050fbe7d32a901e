"""The report of `diagnose` as one HTML file, which loads nothing from elsewhere."""

import io
from base64 import b64encode
from collections import Counter
from contextlib import suppress
from datetime import UTC, datetime
from functools import partial
from importlib.util import find_spec
from itertools import chain, islice
from typing import Any

import numpy as np
import pandas as pd

from .._version import __version__
from ..verdicts import NO_SIGNAL, NO_VERDICT
from .messages import CommandError, percent, require
from .results import MARK, agreement, records

#: Recordings with figures, the worst first.
MOST_DRAWN = 50
#: CSS classes of verdicts, the worst first.
_SEVERITIES = ("fault", "unclear", "healthy")


def template() -> Any:
    """Return the template of the report."""
    require("jinja2", "a report", "io")
    from jinja2 import Environment, PackageLoader

    loader = PackageLoader("skarxlag.commands", "")
    environment = Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    return environment.get_template("report.html.j2")


def html_report(model, recordings, diagnoses, rows, resample=False, faults=None) -> str:
    """Return the report of `diagnoses` of `recordings`; their `rows` are those of `recording_rows`.

    The worst recordings come first. Recordings that are not healthy have a section with details,
    and the worst 50 of them have figures, in which the orders of `faults` are marked.
    """
    missing, page = why_no_figures(), template()
    verdicts = rows["verdict"].astype(str)
    severity = [_severity(verdict, model) for verdict in verdicts]
    severity = pd.Categorical(severity, _SEVERITIES, ordered=True)
    rows = rows.assign(verdict=verdicts, severity=severity)
    by = {"severity": True, "probability": False}
    ranked = rows.sort_values([*by], ascending=[*by.values()], na_position="first")
    entries = records(ranked)
    detailed = [each for each in entries if each["severity"] != "healthy"]
    n_drawn = 0 if missing else min(len(detailed), MOST_DRAWN)
    for place, entry in zip(ranked.index, entries, strict=True):
        entry["remarks"] = diagnoses[place].remarks
    for place, entry in zip(ranked.index[:n_drawn], entries, strict=False):
        entry["figures"] = _figures(recordings[place], diagnoses[place], model, resample, faults)
    return page.render(
        mark=MARK,
        percent=percent,
        saved=f"{datetime.now(UTC):%Y-%m-%d}, skarxlag {__version__}",
        model=model,
        counts=Counter((each["verdict"], each["severity"]) for each in entries).items(),
        accuracy=_accuracy(rows, model.conditions),
        agreement=agreement(rows, model),
        entries=entries,
        detailed=detailed,
        missing=missing,
        n_drawn=n_drawn,
    )


def why_no_figures() -> str | None:
    """Return why no figures can be drawn, or None if they can."""
    if find_spec("matplotlib") is None:
        return "No figures: they need matplotlib, pip install 'skarxlag[plot]'."
    return None


def _severity(verdict, model):
    if verdict == NO_SIGNAL or verdict.startswith(NO_VERDICT):
        return "unclear"
    return "healthy" if verdict == str(model.healthy) else "fault"


def _accuracy(rows, conditions):
    """Return counts of verdicts (columns) by stated condition (rows)."""
    known = rows[rows["condition"].notna() & (rows["error"] == "")]
    counts = pd.crosstab(known["condition"], known["verdict"])
    names = dict.fromkeys([*map(str, conditions), *counts.index, *counts.columns])
    every = counts.reindex(index=names, columns=names, fill_value=0)
    return every.loc[every.any(axis=1), every.any()]


def _figures(recording, diagnosis, model, resample, faults):
    """Return captions and figures of a recording; none if it failed or cannot be read again."""
    windows, verdict = diagnosis.windows, str(diagnosis.verdict["verdict"])
    if windows is None:
        return []
    rate, found = diagnosis.sampling_rate or model.sampling_rate, []
    # Equal verdicts would give straight lines.
    if len(windows[["verdict", "alarm"]].drop_duplicates()) > 1:
        found.append(("Windows of the recording", _drawn(partial(_timeline, windows, rate))))
    chosen = np.flatnonzero(windows["verdict"].astype(str) == verdict)
    if verdict != NO_SIGNAL and len(chosen) > 0:
        place = chosen[len(chosen) // 2]
        with suppress(OSError, ValueError, ImportError, CommandError):
            found += _typical_row(recording, model, resample, faults, place, rate)
    return found


def _typical_row(recording, model, resample, faults, place, rate):
    """Yield caption and figure of a row, if there is a display for the model."""
    from ..plotting import EnvelopeSpectrumDisplay, IdentificationDisplay, OrderSpectrumDisplay

    rows = chain.from_iterable(model.windows(recording, resample)[0])
    row = next(islice(rows, place, None))
    estimator, rpm = model.fitted(row, rate), None
    if model.takes_rpm:
        start = [place * row.shape[-1]]
        rpm = np.atleast_1d(recording.with_speed().speeds(start, row.shape[-1], rate))[0]
    displays = [
        (EnvelopeSpectrumDisplay, {"rpm": rpm}, "contrast of its envelope spectra"),
        (OrderSpectrumDisplay, {"rpm": rpm, "fault_orders": faults}, "order spectrum, references"),
        (IdentificationDisplay, {"sampling_rate": rate}, "measured and predicted signal"),
    ]
    for display, options, caption in displays:
        # The displays refuse estimators that they cannot draw.
        with suppress(ValueError, AttributeError):
            image = _drawn(partial(display.from_estimator, estimator, row, **options))
            yield f"Row {place}: {caption}", image
            return


def _timeline(windows, rate):
    """Draw the probability of each condition over the recording."""
    from matplotlib import pyplot

    from ..plotting import condition_styles

    names = [name for name in windows if name.startswith("probability of ")] or ["score"]
    time, unit = windows["start"] / (rate or 1), "samples" if rate is None else "s"
    _, ax = pyplot.subplots(figsize=(6.4, 2.2), layout="constrained")
    for name, style in condition_styles(names).items():
        few = {} if len(windows) < 40 else {"marker": ""}
        ax.plot(time, windows[name], label=name.removeprefix("probability of "), **style | few)
    alarm, dead = time[windows["alarm"] == 1], time[windows["quality"] != "good"]
    ax.plot(alarm, 0 * alarm + 1, "|", label="alarm", color="gray", clip_on=False)
    ax.plot(dead, 0 * dead, "x", label=NO_SIGNAL, color="gray")
    ax.set(xlabel=f"Time ({unit})", ylabel=names[0].split()[0].capitalize())
    ax.legend(loc="upper left", bbox_to_anchor=(1, 1), fontsize="small", frameon=False)


def _drawn(draw):
    """Return the figure that a function draws as the address of an svg image of all of it."""
    from matplotlib import pyplot

    from ..plotting._style import ANY_PAGE

    file = io.BytesIO()
    # Without a date and with fixed ids, equal results give equal files.
    with pyplot.rc_context(ANY_PAGE | {"svg.fonttype": "none", "svg.hashsalt": "skarxlag"}):
        draw()
        figure = pyplot.gcf()
        figure.savefig(file, format="svg", metadata={"Date": None})
        pyplot.close(figure)
    return "data:image/svg+xml;base64," + b64encode(file.getvalue()).decode()
