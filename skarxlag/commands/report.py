"""The report of `diagnose` as one HTML file, which loads nothing from elsewhere."""

import io
from base64 import b64encode
from contextlib import suppress
from datetime import date
from typing import Any

import numpy as np
import pandas as pd

from .._answers import answers, unfolded_steps
from .._version import __version__
from ..identification import ARXLaguerre
from ..recordings.listing import ListedRecording
from ..stretches import order_comparison
from ..verdicts import NO_SIGNAL, NO_VERDICT
from .diagnosis import Diagnosis, recording_windows
from .messages import CommandError, below_common_folder, counted
from .models import SavedModel, model_heading
from .results import MARK
from .tables import number_text

#: Recordings of which figures are drawn, the worst first.
MOST_DRAWN = 50
#: CSS classes of verdicts, the worst first.
_SEVERITIES = ("fault", "unclear", "healthy")


def template() -> Any:
    """Return the template of the report."""
    try:
        from jinja2 import Environment, PackageLoader
    except ImportError as error:
        raise CommandError("a report needs jinja2: pip install 'skarxlag[io]'") from error
    loader = PackageLoader("skarxlag.commands", "")
    environment = Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    return environment.get_template("report.html.j2")


def html_report(
    model: SavedModel,
    recordings: list[ListedRecording],
    diagnoses: list[Diagnosis],
    rows: pd.DataFrame,
    *,
    resample: bool = False,
    faults: dict[str, float] | None = None,
) -> str:
    """Write the report.

    Parameters
    ----------
    model : SavedModel
        The diagnoser.
    recordings : list of ListedRecording
        The recordings that were diagnosed.
    diagnoses : list of Diagnosis
        Their results, in the same order.
    rows : DataFrame
        Of `recording_rows`.
    resample : bool, default=False
        Whether recordings were brought to the model's sampling rate.
    faults : dict of str to float or None, default=None
        Orders of the bearing's faults, as `bearing_orders` returns them.

    Returns
    -------
    str
        An HTML document. The worst recordings come first. Recordings that are not healthy have a
        section with details, and the worst 50 of them have figures.
    """
    page, missing = template(), why_no_figures()
    folder, names = below_common_folder(rows["recording"])
    rows = rows.assign(recording=names, verdict=rows["verdict"].astype(str))
    rows["severity"] = [_severity(verdict, model) for verdict in rows["verdict"]]
    entries = []
    for row, recording, diagnosis in zip(
        rows.to_dict("records"), recordings, diagnoses, strict=True
    ):
        entries.append(_entry(row, diagnosis) | {"source": (recording, diagnosis)})
    entries.sort(key=lambda each: (_SEVERITIES.index(each["severity"]), -each["certainty"]))
    detailed = [each for each in entries if each["severity"] != "healthy"]
    if missing is None:
        for each in detailed[:MOST_DRAWN]:
            each["figures"] = _figures(*each["source"], model, resample, faults)
    return page.render(
        title=f"Diagnosis of {counted(len(rows), 'recordings')}",
        mark=MARK,
        saved=f"{date.today().isoformat()}, skarxlag {__version__}",
        heading=model_heading(model),
        healthy=model.healthy,
        folder=folder,
        counts=_counts(entries),
        accuracy=_accuracy(rows, [*map(str, model.conditions)]),
        entries=entries,
        detailed=detailed,
        missing=missing if detailed else None,
        n_drawn=min(len(detailed), MOST_DRAWN),
    )


def why_no_figures() -> str | None:
    """Return why no figures can be drawn, or None if they can."""
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        return "No figures: they need matplotlib, pip install 'skarxlag[plot]'."
    return None


def _severity(verdict, model):
    if verdict == NO_SIGNAL or verdict.startswith(NO_VERDICT):
        return "unclear"
    return "healthy" if verdict == str(model.healthy) else "fault"


def _entry(row, diagnosis):
    """Return what the template shows of a recording."""
    shown = {"probability": "{:.1%}", "p_value": "{:.2g}", "rpm": "{:g}", "windows": "{}"}
    shown = {
        name: "" if pd.isna(row.get(name)) else text.format(row[name])
        for name, text in shown.items()
    }
    stated = {
        name.removeprefix("stated_"): f"{value:g}" if isinstance(value, float) else value
        for name, value in row.items()
        if (name == "condition" or name.startswith("stated_")) and not pd.isna(value)
    }
    return shown | {
        "name": row["recording"],
        "verdict": row["verdict"],
        "severity": row["severity"],
        "certainty": np.nan_to_num(row["probability"], nan=1.0),
        "alarm": row["alarm"],
        "stated": stated,
        "remarks": list(diagnosis.remarks),
        "figures": [],
    }


def _counts(entries):
    """Verdicts, how often each is, and how severe."""
    verdicts = pd.DataFrame(entries, columns=["verdict", "severity"])
    return [(*key, number) for key, number in verdicts.value_counts(sort=False).items()]


def _accuracy(rows, order):
    """Numbers of verdicts that are right, and the confusion matrix, or None."""
    if "condition" not in rows:
        return None
    known = rows[rows["condition"].notna() & (rows["error"] == "")]
    if known.empty:
        return None
    table = pd.crosstab(known["condition"], known["verdict"])
    place = {name: number for number, name in enumerate(order)}

    def in_order(names):
        return sorted(names, key=lambda name: (place.get(name, len(place)), name))

    table = table.reindex(index=in_order(table.index), columns=in_order(table.columns))
    right = int((known["condition"] == known["verdict"]).sum())
    share = number_text(100 * right / len(known), 1)
    return {
        "right": right,
        "total": len(known),
        "share": share,
        "columns": table.columns.tolist(),
        "rows": [(name, counts.to_dict()) for name, counts in table.iterrows()],
    }


def _figures(recording, diagnosis, model, resample, faults):
    """Captions and figures of a recording; none if it failed or cannot be read once more."""
    if diagnosis.windows is None:
        return []
    rate = diagnosis.sampling_rate or model.sampling_rate
    found = [_timeline(diagnosis.windows, rate)]
    place = _typical_place(diagnosis.windows, diagnosis.verdict["verdict"])
    if place is not None:
        with suppress(OSError, ValueError, ImportError, CommandError):
            found += _typical_row(recording, model, resample, faults, place, rate)
    return found


def _typical_place(windows, verdict):
    """Position of the window whose probability is the median of those with that verdict."""
    chosen = windows.index[windows["verdict"].astype(str) == str(verdict)]
    columns = [name for name in (f"probability of {verdict}", "score") if name in windows]
    if verdict == NO_SIGNAL or chosen.empty or not columns:
        return None
    ranked = windows.loc[chosen, columns[0]].sort_values()
    return int(ranked.index[len(ranked) // 2])


def _typical_row(recording, model, resample, faults, place, rate):
    from ..plotting import IdentificationDisplay, OrderSpectrumDisplay

    n_seen = 0
    for X, _ in recording_windows(recording, model, resample):
        n_seen += len(X)
        if n_seen > place:
            row = X[place - n_seen]
            break
    rpm = recording.rpm if answers(model.diagnoser).takes_rpm else None
    try:
        order_comparison(model.diagnoser)
    except ValueError:
        if not isinstance(unfolded_steps(model.diagnoser)[0][1], ARXLaguerre):
            return []
        caption = f"Window {place}: measured and predicted signal, and what the model leaves"
        display, options = IdentificationDisplay, {"sampling_rate": rate}
    else:
        caption = (
            f"Stretch {place}: spectrum of its envelope over the orders of the shaft, and the "
            "references of the nearest conditions"
        )
        display, options = OrderSpectrumDisplay, {"rpm": rpm, "fault_orders": faults}
    figure = _drawn(lambda: display.from_estimator(model.diagnoser, row, **options).figure_)
    return [(caption, figure)]


def _timeline(windows, rate):
    """Probability of each condition over the recording."""
    columns = [name for name in windows if name.startswith("probability of ")]
    columns = columns or ["score"]
    time, unit = windows["start"], "samples"
    if rate is not None:
        time, unit = time / rate, "s"

    def draw():
        from matplotlib.figure import Figure

        from ..plotting import condition_styles

        figure = Figure(figsize=(6.4, 2.2), layout="constrained")
        ax = figure.subplots()
        names = [name.removeprefix("probability of ") for name in columns]
        styles = condition_styles(names)
        for column, name in zip(columns, names, strict=True):
            style = styles[name] | ({} if len(windows) < 40 else {"marker": ""})
            ax.plot(time, windows[column], label=name, **style)
        alarm = windows["alarm"] == 1
        ax.plot(time[alarm], np.ones(alarm.sum()), "|", label="alarm", clip_on=False, color="gray")
        dead = windows["quality"] != "good"
        ax.plot(time[dead], np.zeros(dead.sum()), "x", label=NO_SIGNAL, color="gray")
        ax.set(xlabel=f"Time ({unit})", ylabel="Probability" if len(columns) > 1 else "Score")
        ax.legend(loc="upper left", bbox_to_anchor=(1, 1), fontsize="small", frameon=False)
        return figure

    return "Windows of the recording", _drawn(draw)


def _drawn(draw):
    """Return a figure as the address of an svg image that holds all of it."""
    import matplotlib
    from matplotlib import pyplot

    from ..plotting._style import ANY_PAGE

    file = io.BytesIO()
    # Without a date and with fixed ids, equal results give equal files.
    with matplotlib.rc_context(ANY_PAGE | {"svg.fonttype": "none", "svg.hashsalt": "skarxlag"}):
        figure = draw()
        figure.savefig(file, format="svg", metadata={"Date": None})
        pyplot.close(figure)
    return "data:image/svg+xml;base64," + b64encode(file.getvalue()).decode()
