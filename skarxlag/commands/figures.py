"""The figures of ``evaluate``; drawn without pyplot, so no backend is chosen for the user."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd

from ..plotting import SpeedAccuracyDisplay
from .diagnosers import DIAGNOSERS
from .paper_figures import (
    RESIDUAL_FIGURES,
    detection_figure,
    identification_figure,
    new_figure,
    raw_signal_figure,
    residual_figure,
)
from .report import confusion_verdicts, of_part
from .rigs import TITLES

#: The diagnoser with one observer for each model, whose residual can be drawn as the paper does.
_RESIDUALS_OF = DIAGNOSERS["alpio"][0]


def why_missing() -> str | None:
    """A sentence that tells why no figures can be drawn, or None if they can."""
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        return "No figures: they need matplotlib, pip install 'skarxlag[plot]'."
    return None


def save_figures(
    verdicts: pd.DataFrame,
    parts: list[Any],
    fitted: dict[str, Any],
    rig_title: str,
    confusion_rpm: float | None,
    path: Callable[..., Any],
) -> None:
    """Draw and save everything.

    Accuracy by speed, confusion matrices, and what the paper shows in its Figures 7, 8, 10, 11
    and 12-19; on the simulated rig, which has the paper's conditions, files say which.

    Parameters
    ----------
    verdicts : DataFrame
        As `skarxlag.accuracy_tables` describes it.
    parts : list of Part
        Of the rig.
    fitted : dict
        Fitted diagnosers of the first training speed, by crack size and title.
    rig_title : str
        Stands over every figure.
    confusion_rpm : float or None
        Test speed of the confusion matrices; None for all.
    path : callable
        From stem and suffix to the path of a file.
    """
    for part in parts:
        own = of_part(verdicts, part)
        title = f"{rig_title}{part.title}"
        drawn = {
            "speeds": _speed_figure(own, title),
            "confusion": _confusion_figure(own, part.rig.target_names, title, confusion_rpm),
        }
        diagnoser = fitted[part.crack_mm, _RESIDUALS_OF]
        of_paper = _figures_of_paper(own, part.rig, diagnoser, title)
        prefixed = rig_title == TITLES["simulated"]
        drawn |= {f"{number}_{s}" if prefixed else s: f for (number, s), f in of_paper.items()}
        for stem, figure in drawn.items():
            figure.savefig(path(f"{stem}{part.stem}", ".png"), dpi=120)


def _figures_of_paper(verdicts, rig, diagnoser, title):
    """Figures by their number in the paper and what they show."""
    train_rpm = verdicts["train_rpm"].min()
    test_rpm, tested = _tested_windows(verdicts, rig, train_rpm)
    # The first tested window of each condition, in the paper's order where it has them.
    names = sorted(rig.target_names, key=lambda name: RESIDUAL_FIGURES.get(name, 0))
    windows = {name: rig.data[tested[rig.target[tested] == name][0]] for name in names}
    healthy, faulty = rig.target_names[0], rig.target_names[-1]
    of = f"{title}, {_RESIDUALS_OF} calibrated at {train_rpm:g}, windows at {test_rpm:g} rpm"
    return {
        ("figure_07", "identification_healthy"): identification_figure(
            diagnoser, rig, healthy, windows[healthy], of
        ),
        ("figure_08", "identification_faulty"): identification_figure(
            diagnoser, rig, faulty, windows[faulty], of
        ),
        ("figure_10", "raw_signals"): raw_signal_figure(rig, train_rpm, title),
        ("figure_11", "detection"): detection_figure(diagnoser, rig, tested, of),
        ("figures_12-19", "residuals"): residual_figure(diagnoser, rig, windows, of),
    }


def _tested_windows(verdicts, rig, train_rpm):
    """Windows tested at the training speed, which the paper shows; if none, at the lowest."""
    tested = verdicts[verdicts["train_rpm"] == train_rpm]
    at = train_rpm if (tested["test_rpm"] == train_rpm).any() else tested["test_rpm"].min()
    tested = tested[tested["test_rpm"] == at]
    keys = set(zip(tested["recording"], tested["start"], strict=True))
    chosen = [key in keys for key in zip(rig.recording, rig.start, strict=True)]
    return at, np.flatnonzero(chosen)


def _speed_figure(verdicts, title):
    by_diagnoser = list(verdicts.groupby("diagnoser", sort=False))
    train_speeds = verdicts["train_rpm"].unique()
    if len(train_speeds) == 1:
        figure = new_figure(f"{title}, calibrated at {train_speeds[0]:g} rpm", 6.4, 4.8)
        axes = [figure.subplots()] * len(by_diagnoser)
    else:
        figure = new_figure(title, 4.6 * len(by_diagnoser), 4.6)
        axes = figure.subplots(1, len(by_diagnoser), sharey=True, squeeze=False)[0]
    for ax, (name, own) in zip(axes, by_diagnoser, strict=True):
        display = SpeedAccuracyDisplay.from_predictions(
            own["true"],
            own["predicted"],
            train_rpm=own["train_rpm"],
            test_rpm=own["test_rpm"],
            ax=ax,
        )
        if len(train_speeds) == 1:
            display.lines_[0].set_label(name)
        else:
            ax.set_title(name)
        ax.legend(loc="lower right", fontsize="small")
    return figure


def _confusion_figure(verdicts, conditions, title, confusion_rpm):
    from sklearn.metrics import ConfusionMatrixDisplay

    by_diagnoser = list(verdicts.groupby("diagnoser", sort=False))
    _, speeds = confusion_verdicts(verdicts, confusion_rpm)
    side = 1.6 + 0.46 * len(conditions)
    figure = new_figure(f"{title}, {speeds}", side * len(by_diagnoser), side + 1.4)
    axes = figure.subplots(1, len(by_diagnoser), sharey=True, squeeze=False)[0]
    for ax, (name, own) in zip(axes, by_diagnoser, strict=True):
        chosen, _ = confusion_verdicts(own, confusion_rpm)
        right = np.mean(chosen["true"] == chosen["predicted"])
        ConfusionMatrixDisplay.from_predictions(
            chosen["true"],
            chosen["predicted"],
            labels=conditions,
            xticks_rotation="vertical",
            cmap="Blues",
            colorbar=False,
            ax=ax,
        )
        ax.set_title(f"{name}: accuracy {100 * right:.1f} %")
        ax.set(xlabel="Verdict", ylabel="True condition")
        ax.label_outer()
    return figure
