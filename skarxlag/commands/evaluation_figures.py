"""Figures of ``evaluate``. They are drawn without pyplot, so no backend is chosen for the user."""

from pathlib import Path
from typing import Any

import pandas as pd

from ..plotting import SpeedAccuracyDisplay
from .evaluation_cases import Case
from .evaluation_reports import confusion_verdicts


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
