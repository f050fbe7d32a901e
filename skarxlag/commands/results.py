"""Files of results: rows of recordings and of windows in several formats, and a report to read."""

import io
import json
from base64 import b64encode
from collections import Counter
from contextlib import suppress
from datetime import UTC, datetime
from functools import partial
from importlib.util import find_spec
from itertools import chain, islice
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from .._version import __version__
from ..core.files import write_atomically
from ..decisions.fault_locations import location_of_label
from ..recordings.formats._fields import distinct
from ..recordings.listing import ListedRecording
from ..verdicts.names import NO_SIGNAL, NO_VERDICT
from .diagnosis import Diagnosis
from .files import MARK, result_paths
from .messages import CommandError, percent, printable, require

_FIRST = [
    "recording",
    "verdict",
    "probability",
    "alarm",
    "p-value",
    "windows",
    "no signal",
]
_FIRST_OF_WINDOWS = ["start", "verdict", "alarm", "quality"]
#: First characters of a text that a spreadsheet would run as a formula, also in full
#: width.
_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\uff1d", "\uff0b", "\uff0d", "\uff20")
#: Recordings with figures, the worst first.
MOST_DRAWN = 50
#: CSS classes of verdicts, the worst first.
_SEVERITIES = ("fault", "unclear", "healthy")


def recording_rows(
    recordings: Any, diagnoses: list[Diagnosis], healthy: Any
) -> pd.DataFrame:
    """Return a row for each recording: verdict, healthy condition, remarks, error, stated facts."""
    rows = []
    for recording, diagnosis in zip(recordings, diagnoses, strict=True):
        row = dict.fromkeys(_FIRST) | diagnosis.verdict
        row |= {"recording": printable(recording.name), "healthy": healthy}
        # A recording that was not diagnosed has an error, such as an implausible speed.
        reason = str(row["verdict"]).partition(f"{NO_VERDICT}: ")[2]
        row |= {"remark": " ".join(diagnosis.remarks), "error": printable(reason)}
        row |= {"condition": recording.condition, "rpm": recording.rpm}
        facts = {
            "specimen": recording.specimen,
            "load": recording.load,
        } | recording.further
        stated = {name: text for name, text in facts.items() if text is not None}
        rows.append(row | {f"stated {name}": text for name, text in stated.items()})
    table = pd.DataFrame(rows).astype({"windows": "Int64", "no signal": "Int64"})
    return machine_names(table.assign(alarm=table["alarm"].fillna("-")))


def agreement(rows: pd.DataFrame, model: Any) -> tuple[int, int]:
    """Count the verdicts that agree with the stated condition, and those that could.

    A model of places takes the place that the name of a condition says, if it does not
    know the name itself. A model of the healthy condition alone agrees by its alarm.
    """
    rows = rows[rows["condition"].notna() & (rows["error"] == "")]
    stated, known = rows["condition"], set(map(str, model.conditions))
    if len(known) == 1:
        right = rows["alarm"] == np.where(stated == str(model.healthy), "no", "yes")
        return int(right.sum()), len(rows)
    named = stated.map(lambda name: name if name in known else location_of_label(name))
    return int((rows["verdict"].astype(str) == named).sum()), int(
        named.isin(known).sum()
    )


def window_rows(
    recordings: list[ListedRecording], diagnoses: list[Diagnosis]
) -> pd.DataFrame:
    """Return a row for each window; the index is the position of its recording."""
    frames = {
        n: each.windows for n, each in enumerate(diagnoses) if each.windows is not None
    }
    frames = frames or {0: pd.DataFrame(columns=_FIRST_OF_WINDOWS)}
    windows, names = (
        pd.concat(frames).droplevel(1),
        [printable(each.name) for each in recordings],
    )
    windows.insert(0, "recording", [names[place] for place in windows.index])
    return machine_names(windows)


def machine_names(table: pd.DataFrame) -> pd.DataFrame:
    """Return a table whose column names have no blanks and are unique.

    >>> list(machine_names(pd.DataFrame(columns=["p-value", "share of a b", "share of a_b"])))
    ['p_value', 'share_of_a_b', 'share_of_a_b.1']
    """
    plain = [
        "_".join(str(name).replace("p-value", "p_value").split()) for name in table
    ]
    return table.set_axis(distinct(plain), axis=1)


def write_tables(
    output: Path, recordings: Any, windows: Any, summary: dict[str, Any]
) -> None:
    """Write csv, json or parquet, as the suffix says; json holds the summary of the model, too."""
    suffix, tables = output.suffix.lower(), [recordings, windows]
    if suffix == ".json":
        rows = [row | {"window_rows": []} for row in records(recordings)]
        of_windows = records(windows.drop(columns="recording"))
        for place, row in zip(windows.index, of_windows, strict=True):
            rows[place]["window_rows"].append(row)
        content = json.dumps({"format": MARK, "model": summary, "recordings": rows})
        contents = [f"{content}\n".encode()]
    elif suffix == ".csv":
        texts = [
            frame.select_dtypes(["object", "string"]).map(_inert) for frame in tables
        ]
        tables = [frame.assign(**own) for frame, own in zip(tables, texts, strict=True)]
        contents = [
            each.rename(columns=_inert).to_csv(index=False).encode() for each in tables
        ]
    else:
        for frame in tables:
            # pandas writes the attributes into the metadata of the file.
            frame.attrs["format"] = MARK
        contents = [frame.to_parquet(engine="pyarrow", index=False) for frame in tables]
    for path, content in zip(result_paths(output), contents, strict=True):
        write_atomically(path, content)


def _inert(value):
    """Put an apostrophe before a text that a spreadsheet would run as a formula."""
    is_formula = (
        isinstance(value, str) and len(value) > 1 and value.startswith(_FORMULA)
    )
    return f"'{value}" if is_formula else value


def records(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """Return rows as JSON has them: missing values are None."""
    return frame.astype(object).where(frame.notna(), None).to_dict("records")


def verdict_table(rows: pd.DataFrame) -> str:
    """Return a line of text for each recording: stated facts, verdict, probability, alarm.

    >>> rows = pd.DataFrame({
    ...     "recording": ["run_1.npy"], "verdict": ["good"], "probability": [0.5],
    ...     "alarm": ["no"], "p_value": [0.25],
    ... })
    >>> print(verdict_table(rows))
              verdict probability        alarm
    run_1.npy    good       50.0%  no (p 0.25)
    """
    table = rows.set_index("recording").rename_axis(None)
    table["alarm"] += (
        table["p_value"].map(" (p {:.2g})".format, na_action="ignore").fillna("")
    )
    forms = {
        "condition": str,
        "rpm": "{:g}".format,
        "verdict": str,
        "probability": percent,
    }
    forms = {
        name: form for name, form in (forms | {"alarm": str}).items() if name in table
    }
    texts = {
        name: table[name].map(form, na_action="ignore") for name, form in forms.items()
    }
    return (
        pd.DataFrame(texts)
        .dropna(axis=1, how="all")
        .astype(object)
        .fillna("-")
        .to_string()
    )


def template() -> Any:
    """Return the template of the report."""
    require("jinja2", "a report", "io")
    from jinja2 import Environment, PackageLoader

    loader = PackageLoader("skarxlag.commands", "")
    environment = Environment(
        loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    return environment.get_template("report.html.j2")


def html_report(model, recordings, diagnoses, rows, resample=False, faults=None) -> str:
    """Return the report of `diagnoses` of `recordings`; their `rows` are those of `recording_rows`.

    The worst recordings come first. Recordings that are not healthy have a section with
    details, and the worst 50 of them have figures, in which the orders of `faults` are
    marked.
    """
    missing, page = why_no_figures(), template()
    verdicts = rows["verdict"].astype(str)
    is_unclear = (verdicts == NO_SIGNAL) | (rows["error"] != "")
    is_healthy = verdicts == str(model.healthy)
    severity = np.select([is_unclear, is_healthy], ["unclear", "healthy"], "fault")
    severity = pd.Categorical(severity, _SEVERITIES, ordered=True)
    remarks = [each.remarks for each in diagnoses]
    rows = rows.assign(verdict=verdicts, severity=severity, remarks=remarks)
    by = ["severity", "probability"]
    ranked = rows.sort_values(by, ascending=[True, False], na_position="first")
    entries = records(ranked)
    detailed = [each for each in entries if each["severity"] != "healthy"]
    n_drawn = 0 if missing else min(len(detailed), MOST_DRAWN)
    for place, entry in zip(ranked.index[:n_drawn], entries, strict=False):
        entry["figures"] = _figures(
            recordings[place], diagnoses[place], model, resample, faults
        )
    counts = Counter((each["verdict"], each["severity"]) for each in entries).items()
    facts = {"mark": MARK, "percent": percent, "model": model, "counts": counts}
    facts["saved"] = f"{datetime.now(UTC):%Y-%m-%d}, skarxlag {__version__}"
    facts |= {
        "accuracy": _accuracy(rows, model.conditions),
        "agreement": agreement(rows, model),
    }
    return page.render(
        facts, entries=entries, detailed=detailed, missing=missing, n_drawn=n_drawn
    )


def why_no_figures() -> str | None:
    """Return why no figures can be drawn, or None if they can."""
    if find_spec("matplotlib") is None:
        return "No figures: they need matplotlib, pip install 'skarxlag[plot]'."
    return None


def _accuracy(rows, conditions):
    """Return counts of verdicts (columns) by stated condition (rows)."""
    known = rows[rows["condition"].notna() & (rows["error"] == "")]
    names = dict.fromkeys(
        [*map(str, conditions), *known["condition"], *known["verdict"]]
    )
    in_order = pd.CategoricalDtype([*names])
    return pd.crosstab(
        known["condition"].astype(in_order), known["verdict"].astype(in_order)
    )


def _figures(recording, diagnosis, model, resample, faults):
    """Return captions and figures of a recording; none if it failed or cannot be read again."""
    windows, verdict = diagnosis.windows, str(diagnosis.verdict["verdict"])
    if windows is None:
        return []
    rate, found = diagnosis.sampling_rate or model.sampling_rate, []
    # Equal verdicts would give straight lines.
    if len(windows[["verdict", "alarm"]].drop_duplicates()) > 1:
        found.append(
            ("Windows of the recording", _drawn(partial(_timeline, windows, rate)))
        )
    chosen = np.flatnonzero(windows["verdict"].astype(str) == verdict)
    if verdict != NO_SIGNAL and len(chosen) > 0:
        place = chosen[len(chosen) // 2]
        with suppress(OSError, ValueError, ImportError, CommandError):
            found += _typical_row(recording, model, resample, faults, place, rate)
    return found


def _typical_row(recording, model, resample, faults, place, rate):
    """Yield caption and figure of a row, if there is a display for the model."""
    from ..plotting import (
        EnvelopeSpectrumDisplay,
        IdentificationDisplay,
        OrderSpectrumDisplay,
    )

    rows = chain.from_iterable(model.windows(recording, resample)[0])
    row = next(islice(rows, place, None))
    estimator, rpm = model.fitted(row, rate), None
    if model.takes_rpm:
        start = [place * row.shape[-1]]
        rpm = np.atleast_1d(recording.with_speed().speeds(start, row.shape[-1], rate))[
            0
        ]
    displays = [
        (EnvelopeSpectrumDisplay, {"rpm": rpm}, "contrast of its envelope spectra"),
        (
            OrderSpectrumDisplay,
            {"rpm": rpm, "fault_orders": faults},
            "order spectrum, references",
        ),
        (
            IdentificationDisplay,
            {"sampling_rate": rate},
            "measured and predicted signal",
        ),
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

    names = [name for name in windows if name.startswith("probability of ")] or [
        "score"
    ]
    time, unit = windows["start"] / (rate or 1), "samples" if rate is None else "s"
    _, ax = pyplot.subplots(figsize=(6.4, 2.2), layout="constrained")
    for name, style in condition_styles(names).items():
        few = {} if len(windows) < 40 else {"marker": ""}
        ax.plot(
            time,
            windows[name],
            label=name.removeprefix("probability of "),
            **style | few,
        )
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
    with pyplot.rc_context(
        ANY_PAGE | {"svg.fonttype": "none", "svg.hashsalt": "skarxlag"}
    ):
        draw()
        figure = pyplot.gcf()
        figure.savefig(file, format="svg", metadata={"Date": None})
        pyplot.close(figure)
    return "data:image/svg+xml;base64," + b64encode(file.getvalue()).decode()
