"""Figures of ``evaluate``. They are drawn without pyplot, so no backend is chosen for the user."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from sklearn.pipeline import Pipeline
from sklearn.utils import Bunch

from ..plotting import (
    IdentificationDisplay,
    ResidualDisplay,
    SpeedAccuracyDisplay,
    ThresholdLadderDisplay,
    condition_styles,
)
from .tables import confusion_verdicts

#: Samples of a window that an identification is drawn of, and parts of a raw signal.
_SHOWN_SAMPLES, _BINS = 320, 800


def save_figures(
    verdicts: pd.DataFrame, rig: Bunch, diagnoser: Pipeline, title: str, stem: Path
) -> None:
    """Draw and save all figures of a rig.

    Parameters
    ----------
    verdicts : DataFrame
        As `skarxlag.accuracy_tables` describes it.
    rig : Bunch
        As `skarxlag.datasets` returns it.
    diagnoser : Pipeline
        Diagnoser with observers and a ladder, calibrated at the first training speed.
    title : str
        Title of the rig, which begins the title of every figure.
    stem : Path
        Folder, and first part of the files' names.
    """
    train_rpm = verdicts["train_rpm"].iloc[0]
    test_rpm, tested = _tested_windows(verdicts, rig, train_rpm)
    names = rig.target_names
    windows = {name: rig.data[tested[rig.target[tested] == name][0]] for name in names}
    of = f"{title}, calibrated at {train_rpm:g}, windows at {test_rpm:g} rpm"
    drawn = {
        "speeds": _speed_figure(verdicts, title),
        "confusion": _confusion_figure(verdicts, names, title),
        "raw_signals": raw_signal_figure(rig, train_rpm, title),
        "detection": ladder_figure(diagnoser, rig, tested, of),
        "residuals": residual_figure(diagnoser, rig, windows, of),
    }
    for name, condition in (("healthy", names[0]), ("faulty", names[-1])):
        figure = identification_figure(diagnoser, rig, condition, windows[condition], of)
        drawn[f"identification_{name}"] = figure
    for name, figure in drawn.items():
        figure.savefig(stem.with_name(f"{stem.name}_{name}.png"), dpi=120)


def _tested_windows(verdicts, rig, train_rpm):
    """Return windows that were tested at the training speed, or else at the lowest, and it."""
    tested = verdicts[verdicts["train_rpm"] == train_rpm]
    at = train_rpm if (tested["test_rpm"] == train_rpm).any() else tested["test_rpm"].min()
    tested = tested[tested["test_rpm"] == at]
    keys = pd.MultiIndex.from_frame(tested[["recording", "start"]])
    is_tested = pd.MultiIndex.from_arrays([rig.recording, rig.start]).isin(keys)
    return at, np.flatnonzero(is_tested)


def new_figure(title: str, width: float, height: float) -> Any:
    """Return a figure with a title, made without pyplot."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    figure.suptitle(title, fontsize="medium")
    return figure


def identification_figure(
    diagnoser: Pipeline, rig: Bunch, condition: str, window: Any, title: str
) -> Any:
    """Draw the output of a window, its prediction by the healthy model, and their difference."""
    figure = new_figure(f"{title}, window of {condition}", 9, 4.6)
    display = IdentificationDisplay.from_estimator(
        diagnoser,
        window,
        condition=condition,
        conditions=rig.target_names,
        sampling_rate=rig.sampling_rate,
        axes=figure.subplots(2, sharex=True),
    )
    display.axes_[0].set_xlim(0, _SHOWN_SAMPLES / rig.sampling_rate)
    return figure


def raw_signal_figure(rig: Bunch, rpm: float, title: str) -> Any:
    """Draw the first recording of each condition at one speed.

    A signal is drawn as the area between the smallest and the largest sample of each of 800 parts,
    so that no peak is lost.
    """
    names = rig.target_names
    figure = new_figure(f"{title}, {rpm:g} rpm", 9, 0.9 + 0.85 * len(names))
    styles = condition_styles(names)
    all_axes = figure.subplots(len(names), sharex=True, sharey=True, squeeze=False)[:, 0]
    for ax, name in zip(all_axes, names, strict=True):
        chosen = (rig.target == name) & (rig.rpm == rpm)
        chosen &= rig.recording == rig.recording[chosen][0]
        windows = rig.data[chosen][np.argsort(rig.start[chosen])]
        signal = (windows[:, 0] if windows.ndim == 3 else windows).ravel()
        begins = np.unique(np.linspace(0, len(signal), _BINS, endpoint=False).astype(int))
        low, high = (each.reduceat(signal, begins) for each in (np.minimum, np.maximum))
        color = styles[name]["color"]
        time = begins / rig.sampling_rate
        ax.fill_between(time, low, high, color=color, linewidth=0.5, step="post")
        ax.set_title(name, fontsize="small", loc="left", pad=2)
        ax.set_xlim(0, len(signal) / rig.sampling_rate)
    figure.supylabel("Output", fontsize="medium")
    all_axes[-1].set_xlabel("Time (s)")
    return figure


def ladder_figure(
    diagnoser: Pipeline, rig: Bunch, chosen: Any, title: str, decision: str = "detection"
) -> Any:
    """Draw the levels of many windows with the thresholds of one of the ladder's decisions."""
    figure = new_figure(title, 9, 4.4)
    ThresholdLadderDisplay.from_estimator(
        diagnoser,
        rig.data[chosen],
        rig.target[chosen],
        decision=decision,
        conditions=rig.target_names,
        ax=figure.subplots(),
    )
    return figure


def residual_figure(diagnoser: Pipeline, rig: Bunch, windows: dict[str, Any], title: str) -> Any:
    """Draw the residuals of a window of each condition: healthy model and the condition's own.

    A diagnoser with a single model has one column.
    """
    healthy = rig.target_names[0]
    n_columns = min(len(diagnoser[0].classes_), 2)
    figure = new_figure(title, 1.5 + 7 * n_columns, 0.6 + 2.6 * len(windows))
    all_axes = figure.subplots(len(windows), n_columns, sharex=True, squeeze=False)
    for row, (condition, window) in zip(all_axes, windows.items(), strict=True):
        for ax, model in zip(row, (healthy, condition), strict=False):
            if ax is not row[0] and condition == healthy:
                ax.set_axis_off()
                continue
            ResidualDisplay.from_estimator(
                diagnoser,
                window,
                model=model if n_columns > 1 else None,
                condition=condition,
                conditions=rig.target_names,
                ax=ax,
            )
    for ax in all_axes[:-1].ravel():
        ax.set_xlabel("")
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
        accuracy = 100 * np.mean(own["true"] == own["predicted"])
        ax.set_title(f"{ax.get_title()}: accuracy {accuracy:.1f} %")
        ax.set(xlabel="Verdict", ylabel="True condition")
        ax.label_outer()
    return figure
