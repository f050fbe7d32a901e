"""Reports of ``skarxlag evaluate``: texts, tables and figures."""

from itertools import product
from pathlib import Path
from typing import Any

import pandas as pd

from ..accuracy_tables import confusion_table, speed_summary
from ..plotting import SpeedAccuracyDisplay
from .evaluation_cases import Case


def report(case: Case, verdicts: pd.DataFrame) -> tuple[str, dict[str, pd.DataFrame]]:
    """Return the report of a case, and its tables by the names of their files."""
    found, names = {}, verdicts["diagnoser"].unique()
    units = {"windows": verdicts} | ({"recordings": _by_recording(verdicts)} if case.is_own else {})
    for (protocol, title), (unit, frame) in product(case.protocols.items(), units.items()):
        own = frame[frame["protocol"] == protocol]
        hits = own.assign(hit=100.0 * (own["true"] == own["predicted"]))
        index = ["diagnoser"] if case.is_own else ["diagnoser", "train_rpm"]
        table = hits.pivot_table("hit", index, "test_rpm", sort=False).sort_index(axis=1)
        if case.is_own:
            table["mean"] = table.mean(axis=1)
        found[f"{protocol}_{unit}"] = f"accuracy of {unit} in %, {title}", table
    if not case.is_own:
        ((_, pairs),) = found.values()
        summary = pd.DataFrame({name: speed_summary(pairs.loc[name]) for name in names}).T
        title = "mean accuracy in % by pair of speeds"
        found["summary"] = title, summary.rename_axis("diagnoser")
    chosen, speeds = confusion_verdicts(frame)
    for name in names:
        title = f"confusion matrix of {unit}, {name}, {speeds}; rows: true condition, "
        title += "columns: verdict, corner: accuracy in %"
        matrix = confusion_table(chosen[chosen["diagnoser"] == name], case.rig.target_names)
        found[f"confusion_{'-'.join(name.lower().split())}"] = title, matrix
    blocks = [_block(f"{case.title}: {title}", table) for title, table in found.values()]
    return "\n".join([case.heading, "", *blocks]), {
        name: table for name, (_, table) in found.items()
    }


def _by_recording(verdicts):
    """Return the verdict of most windows of each recording."""
    keys = ["protocol", "diagnoser", "split", "train_rpm", "test_rpm", "recording", "true"]
    groups = verdicts.groupby(keys, sort=False, dropna=False)["predicted"]
    return groups.agg(lambda each: each.mode().iloc[0]).reset_index()


def confusion_verdicts(verdicts: pd.DataFrame) -> tuple[pd.DataFrame, str]:
    """Return the rows that confusion matrices count, and their speeds in words.

    Tests at the training speed count only if there are no others.
    """
    other = verdicts[verdicts["train_rpm"] != verdicts["test_rpm"]]
    chosen = other if len(other) else verdicts
    trained, tested = (sorted(chosen[f"{role}_rpm"].unique()) for role in ("train", "test"))
    if len(trained) > 1 and len(tested) > 1:
        return chosen, "all tests at other speeds"
    trained, tested = (", ".join(f"{rpm:g}" for rpm in speeds) for speeds in (trained, tested))
    return chosen, f"calibrated at {trained}, tested at {tested} rpm"


def _block(title, table):
    shown = table.round(1).rename(columns=_speed).rename_axis(columns=None).rename(index=_speed)
    return f"{title}\n{shown.to_string(float_format='{:g}'.format, na_rep='-')}\n"


def _speed(name):
    return f"{name:g} rpm" if isinstance(name, float) else name


def save_figure(case: Case, verdicts: pd.DataFrame, folder: Path) -> None:
    """Draw the accuracy across speeds and the confusion matrices of a case, and save them."""
    from sklearn.metrics import ConfusionMatrixDisplay

    names = verdicts["diagnoser"].unique()
    chosen, speeds = confusion_verdicts(verdicts)
    figure = new_figure(f"{case.title}; matrices of windows: {speeds}", 4.6 * len(names), 9.6)
    axes = figure.subplots(2, len(names), sharey="row", squeeze=False)
    style = {"xticks_rotation": "vertical", "cmap": "Blues", "colorbar": False}
    for upper, lower, name in zip(*axes, names, strict=True):
        own = verdicts[verdicts["diagnoser"] == name].dropna(subset="train_rpm")
        upper_speeds = {role: own[role] for role in ("train_rpm", "test_rpm")}
        SpeedAccuracyDisplay(own["true"], own["predicted"], **upper_speeds).plot(ax=upper)
        upper.set_title(name)
        upper.legend(loc="lower right", fontsize="small")
        own = chosen[chosen["diagnoser"] == name]
        labels = {"labels": case.rig.target_names} | style
        ConfusionMatrixDisplay.from_predictions(own["true"], own["predicted"], ax=lower, **labels)
        lower.set_title(f"Accuracy {100 * (own['true'] == own['predicted']).mean():.1f} %")
        lower.set(xlabel="Verdict", ylabel="True condition")
        lower.label_outer()
    figure.savefig(folder / f"{case.stem}.png", dpi=120)


def new_figure(title: str, width: float, height: float) -> Any:
    """Return a figure with a title, made without pyplot."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    figure.suptitle(title, fontsize="medium")
    return figure
