"""The figures of ``evaluate``; drawn without pyplot, so no backend is chosen for the user."""

import numpy as np

from ..plotting import ResidualDisplay, SpeedAccuracyDisplay, TrajectoryDisplay
from .diagnosers import COMPARED
from .report import confusion_verdicts, of_part

_RESIDUALS_OF = COMPARED["extended-state"][0]
_SHOWN_SAMPLES = 300


def why_missing():
    """A sentence that tells why no figures can be drawn, or None if they can."""
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        return "No figures: they need matplotlib, pip install 'skarxlag[plot]'."
    return None


def save_figures(verdicts, parts, fitted, rig_title, confusion_rpm, path):
    """Draw and save everything.

    Parameters
    ----------
    verdicts : DataFrame
        As `skarxlag.evaluation_tables` describes it.
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
        train_rpm = own["train_rpm"].min()
        shown = _example_windows(own, part.rig, train_rpm)
        title = f"{title}, {_RESIDUALS_OF}, calibrated at {train_rpm:g} rpm"
        drawn["residuals"] = _residual_figure(diagnoser, part.rig, shown, title)
        drawn["trajectories"] = _trajectory_figure(diagnoser, part.rig, shown, title)
        for stem, figure in drawn.items():
            figure.savefig(path(f"{stem}{part.stem}", ".png"), dpi=120)


def _new_figure(title, width, height):
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    figure.suptitle(title)
    return figure


def _speed_figure(verdicts, title):
    by_diagnoser = list(verdicts.groupby("diagnoser", sort=False))
    train_speeds = verdicts["train_rpm"].unique()
    if len(train_speeds) == 1:
        figure = _new_figure(f"{title}, calibrated at {train_speeds[0]:g} rpm", 6.4, 4.8)
        axes = [figure.subplots()] * len(by_diagnoser)
    else:
        figure = _new_figure(title, 4.6 * len(by_diagnoser), 4.6)
        axes = figure.subplots(1, len(by_diagnoser), sharey=True)
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
    figure = _new_figure(f"{title}, {speeds}", side * len(by_diagnoser), side + 1.4)
    for ax, (name, own) in zip(
        figure.subplots(1, len(by_diagnoser), sharey=True), by_diagnoser, strict=True
    ):
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


def _example_windows(verdicts, rig, train_rpm):
    """The first tested window of each condition at the lowest other speed."""
    tested = verdicts[(verdicts["train_rpm"] == train_rpm) & (verdicts["test_rpm"] != train_rpm)]
    at = (verdicts if tested.empty else tested)["test_rpm"].min()
    tested = verdicts[(verdicts["train_rpm"] == train_rpm) & (verdicts["test_rpm"] == at)]
    windows = {}
    for condition in rig.target_names:
        row = tested[tested["true"] == condition].iloc[0]
        (number,) = np.flatnonzero(
            (rig.recording == row["recording"]) & (rig.start == row["start"])
        )
        windows[condition] = rig.data[number]
    return at, windows


def _residual_figure(diagnoser, rig, shown, title):
    test_rpm, windows = shown
    healthy = rig.target_names[0]
    figure = _new_figure(f"{title}, windows at {test_rpm:g} rpm", 11, 0.6 + 1.9 * len(windows))
    axes = figure.subplots(len(windows), 2, sharex=True, squeeze=False)
    for row, (condition, window) in zip(axes, windows.items(), strict=True):
        for ax, model in zip(row, (healthy, condition), strict=True):
            if model == healthy and ax is row[1]:
                ax.set_axis_off()
                continue
            ResidualDisplay.from_estimator(diagnoser, window, model=model, ax=ax)
            ax.set_title(f"true condition {condition}, model of {model}", fontsize="medium")
            ax.label_outer()
    return figure


def _trajectory_figure(diagnoser, rig, shown, title):
    test_rpm, windows = shown
    pair = rig.target_names[0], rig.target_names[-1]
    figure = _new_figure(f"{title}, windows at {test_rpm:g} rpm", 11, 7)
    columns = figure.subplots(3, 2, sharex=True)
    for axes, condition in zip(columns.T, pair, strict=True):
        TrajectoryDisplay.from_estimator(diagnoser, windows[condition], axes=axes)
        axes[0].set_title(f"true condition {condition}, model of {rig.target_names[0]}")
        axes[2].set_xlim(0, _SHOWN_SAMPLES)
    return figure
