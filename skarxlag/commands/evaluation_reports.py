"""Reports of ``skarxlag evaluate``: texts, tables and figures."""

from itertools import product
from pathlib import Path
from typing import Any

import pandas as pd

from ..accuracy_tables import (
    condition_accuracy,
    confusion_table,
    speed_accuracy,
    speed_summary,
)
from ..plotting import SpeedAccuracyDisplay
from .evaluation_cases import Case

_PROTOCOLS = {
    "in": "trained at one speed, tested at all others",
    "out": "trained at all speeds but one, tested at that",
}
_MATRIX = "rows: true condition, columns: verdict, corner: accuracy in %"


def rig_report(case: Case, verdicts: pd.DataFrame) -> tuple[str, dict[str, pd.DataFrame]]:
    """Return the report of a rig, and its tables by the names of their files."""
    conditions, by_name = case.rig.target_names, verdicts.groupby("diagnoser", sort=False)
    pairs = {name: speed_accuracy(own) for name, own in by_name}
    by_condition = {
        key: condition_accuracy(own, conditions, ["test_rpm"])
        for key, own in verdicts.groupby(["diagnoser", "train_rpm"], sort=False)
    }
    tables = [pd.concat(by_condition, names=["diagnoser", "train_rpm"])]
    tables.append(pd.concat(pairs, names=["diagnoser"]))
    conditions_table, speeds_table = (each.rename(columns="{:g} rpm".format) for each in tables)
    summary = pd.DataFrame({name: speed_summary(table) for name, table in pairs.items()}).T
    axes = "rows: calibrated at, columns: tested at"
    found = [
        ("conditions", f"accuracy in % by condition; {axes}", conditions_table),
        ("speeds", f"accuracy in %; {axes}", speeds_table),
        ("summary", "mean accuracy in % by pair of speeds", summary.rename_axis("diagnoser")),
    ]
    for name, own in by_name:
        chosen, speeds = confusion_verdicts(own)
        file = f"confusion_{name.lower().replace(' ', '-')}"
        title = f"confusion matrix, {name}, {speeds}; {_MATRIX}"
        found.append((file, title, confusion_table(chosen, conditions)))
    protocol = "Calibrated on first halves of recordings at one speed, tested on second halves.\n"
    blocks = [_block(f"{case.title}: {title}", table) for _, title, table in found]
    return "\n".join([case.heading, protocol, *blocks]), {file: table for file, _, table in found}


def confusion_verdicts(verdicts: pd.DataFrame) -> tuple[pd.DataFrame, str]:
    """Return the rows that confusion matrices count, and their speeds in words.

    Tests at the training speed count only if there are no others.
    """
    other = verdicts[verdicts["train_rpm"] != verdicts["test_rpm"]]
    chosen = other if len(other) else verdicts
    trained, tested = (sorted(chosen[f"{role}_rpm"].unique()) for role in ("train", "test"))
    if len(trained) > 1 and len(tested) > 1:
        return chosen, "all pairs of different speeds"
    trained, tested = (", ".join(f"{rpm:g}" for rpm in speeds) for speeds in (trained, tested))
    return chosen, f"calibrated at {trained}, tested at {tested} rpm"


def own_report(case: Case, verdicts: pd.DataFrame) -> tuple[str, dict[str, pd.DataFrame]]:
    """Return the report of the recordings of a table, and no further tables."""
    has_campaigns = "campaign" in case.rig.further
    lines = [
        f"{case.heading} Training and test differ in "
        f"recording{' and campaign' if has_campaigns else ''}."
    ]
    if not has_campaigns:
        lines.append(
            "The table has no column campaign. If the test was measured without remounting after "
            "the training, the accuracy may be too high."
        )
    # The verdict on a recording is that of most of its windows.
    keys = ["protocol", "diagnoser", "left", "test_rpm", "recording", "true"]
    most = verdicts.groupby(keys, sort=False)["predicted"].agg(lambda each: each.mode().iloc[0])
    recordings = most.reset_index()
    for protocol, (name, frame) in product(
        verdicts["protocol"].unique(), {"windows": verdicts, "recordings": recordings}.items()
    ):
        own = frame[frame["protocol"] == protocol]
        hits = own.assign(hit=100.0 * (own["true"] == own["predicted"]))
        table = hits.pivot_table("hit", "diagnoser", "test_rpm").rename(columns="{:g} rpm".format)
        title = f"\nAccuracy of {name} in %, {_PROTOCOLS[protocol]}, by speed of the test"
        lines.append(_block(title, table.assign(mean=table.mean(axis=1))))
    own = recordings[recordings["diagnoser"] == "make_diagnoser"]
    title = f"\nConfusion matrix of recordings, make_diagnoser, all tests; {_MATRIX}"
    return "\n".join([*lines, _block(title, confusion_table(own, case.rig.target_names))]), {}


def _block(title, table):
    shown = table.round(1).rename_axis(columns=None)
    shown = shown.rename(index=lambda name: f"{name:g}" if isinstance(name, float) else name)
    return f"{title}\n{shown.to_string(float_format='{:g}'.format, na_rep='-')}\n"


def save_figures(case: Case, verdicts: pd.DataFrame, folder: Path) -> None:
    """Draw the accuracy across speeds and the confusion matrices of a rig, and save them."""
    drawn = {
        "speeds": _speed_figure(verdicts, case.title),
        "confusion": _confusion_figure(verdicts, case.rig.target_names, case.title),
    }
    for name, figure in drawn.items():
        figure.savefig(folder / f"{case.stem}_{name}.png", dpi=120)


def new_figure(title: str, width: float, height: float) -> Any:
    """Return a figure with a title, made without pyplot."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    figure.suptitle(title, fontsize="medium")
    return figure


def _panels(verdicts, title, width, height):
    """Figure with a panel for each diagnoser; its axes, and the verdicts of the diagnoser."""
    by_diagnoser = list(verdicts.groupby("diagnoser", sort=False))
    figure = new_figure(title, width * len(by_diagnoser), height)
    axes = figure.subplots(1, len(by_diagnoser), sharey=True, squeeze=False)[0]
    for ax, (name, _) in zip(axes, by_diagnoser, strict=True):
        ax.set_title(name)
    return figure, zip(axes, (own for _, own in by_diagnoser), strict=True)


def _speed_figure(verdicts, title):
    figure, panels = _panels(verdicts, title, 4.6, 4.6)
    for ax, own in panels:
        speeds = {"train_rpm": own["train_rpm"], "test_rpm": own["test_rpm"]}
        SpeedAccuracyDisplay(own["true"], own["predicted"], **speeds).plot(ax=ax)
        ax.legend(loc="lower right", fontsize="small")
    return figure


def _confusion_figure(verdicts, conditions, title):
    from sklearn.metrics import ConfusionMatrixDisplay

    chosen, speeds = confusion_verdicts(verdicts)
    side = 1.6 + 0.46 * len(conditions)
    figure, panels = _panels(chosen, f"{title}, {speeds}", side, side + 1.4)
    style = {"xticks_rotation": "vertical", "cmap": "Blues", "colorbar": False}
    for ax, own in panels:
        ConfusionMatrixDisplay.from_predictions(
            own["true"], own["predicted"], labels=conditions, ax=ax, **style
        )
        accuracy = 100 * (own["true"] == own["predicted"]).mean()
        ax.set_title(f"{ax.get_title()}: accuracy {accuracy:.1f} %")
        ax.set(xlabel="Verdict", ylabel="True condition")
        ax.label_outer()
    return figure
