"""The tables of ``evaluate``, as text and as CSV."""

from dataclasses import dataclass

import pandas as pd

from ..evaluation_tables import (
    condition_accuracy,
    confusion_table,
    speed_accuracy,
    speed_summary,
)

#: How values that head a column are written in a file.
_UNITS = {"crack_mm": "{:g} mm", "test_rpm": "{:g} rpm"}


@dataclass(frozen=True)
class Table:
    """One table: a title, its text, and the frame that goes into its file.

    Parameters
    ----------
    title : str
        With the name of the rig.
    text : str
        Rows and columns, for a terminal.
    stem : str
        Name of its CSV without rig and suffix.
    frame : DataFrame
        What the CSV holds.
    """

    title: str
    text: str
    stem: str
    frame: pd.DataFrame


def evaluation_report(verdicts, parts, rig_title, confusion_rpm):
    """All tables of an evaluation.

    Parameters
    ----------
    verdicts : DataFrame
        As `skarxlag.evaluation_tables` describes it.
    parts : list of Part
        Of the rig.
    rig_title : str
        Heads every table.
    confusion_rpm : float or None
        Test speed of the confusion matrices; None for all.

    Returns
    -------
    list of Table
        By condition, confusion matrices, pairs of speeds, summary.
    """
    tables = []
    for train_rpm, trained in verdicts.groupby("train_rpm"):
        tables += _by_condition(trained, train_rpm, parts, rig_title)
    for part in parts:
        tables += _confusion(of_part(verdicts, part), part, rig_title, confusion_rpm)
    for part in parts:
        tables += _speeds(of_part(verdicts, part), part, rig_title)
    return [*tables, _summary(verdicts, parts, rig_title)]


def of_part(verdicts, part):
    """Rows of one part."""
    return verdicts if part.crack_mm is None else verdicts[verdicts["crack_mm"] == part.crack_mm]


def confusion_verdicts(verdicts, confusion_rpm):
    """Rows that confusion matrices count, and what to call them.

    Tests at the training speed count only where there is no other.

    Parameters
    ----------
    verdicts : DataFrame
        Of one part.
    confusion_rpm : float or None
        Test speed; None for all.

    Returns
    -------
    DataFrame, str
        The rows, and their speeds in words.
    """
    if confusion_rpm is not None:
        verdicts = verdicts[verdicts["test_rpm"] == confusion_rpm]
    other = verdicts[verdicts["train_rpm"] != verdicts["test_rpm"]]
    chosen = other if len(other) else verdicts
    trained, tested = (chosen[f"{role}_rpm"].unique() for role in ("train", "test"))
    if len(trained) > 1 and len(tested) > 1:
        return chosen, "all pairs of different speeds"
    return chosen, f"calibrated at {_speed_list(trained)}, tested at {_speed_list(tested)} rpm"


def _speed_list(speeds):
    return ", ".join(f"{speed:g}" for speed in sorted(speeds))


def _by_condition(trained, train_rpm, parts, rig_title):
    conditions = parts[0].rig.target_names
    tables = []
    if len(parts) > 1:
        for test_rpm, tested in trained.groupby("test_rpm"):
            table = condition_accuracy(tested, conditions, ["diagnoser", "crack_mm"])
            title = f"tested at {test_rpm:g} rpm, calibrated at {train_rpm:g} rpm"
            stem = f"conditions_{train_rpm:g}rpm_{test_rpm:g}rpm"
            tables.append(_accuracy_table(f"{rig_title}: accuracy in %, {title}", table, stem))
    for part in parts:
        table = condition_accuracy(of_part(trained, part), conditions, ["diagnoser", "test_rpm"])
        title = f"by speed of the test (rpm), calibrated at {train_rpm:g} rpm{part.title}"
        stem = f"conditions{part.stem}_{train_rpm:g}rpm"
        tables.append(_accuracy_table(f"{rig_title}: accuracy in %, {title}", table, stem))
    return tables


def _accuracy_table(title, table, stem):
    units = [_UNITS.get(name, "{}") for name in table.columns.names]
    heads = [[unit.format(v) for unit, v in zip(units, key, strict=True)] for key in table.columns]
    narrow = [tuple(head[:1] + [last.removesuffix(" rpm") for last in head[1:]]) for head in heads]
    shown = table.set_axis(pd.MultiIndex.from_tuples(narrow), axis=1)
    flat = table.set_axis([", ".join(head) for head in heads], axis=1)
    return Table(title, _text(shown.rename_axis(None)), stem, flat)


def _confusion(verdicts, part, rig_title, confusion_rpm):
    tables = []
    for name, own in verdicts.groupby("diagnoser", sort=False):
        chosen, speeds = confusion_verdicts(own, confusion_rpm)
        table = confusion_table(chosen, part.rig.target_names)
        counts = table.map(lambda value: f"{value:.0f}")
        margins = table.map(lambda value: "-" if pd.isna(value) else f"{value:.1f}")
        counts["recall %"] = margins["recall %"]
        counts.loc["precision %"] = margins.loc["precision %"]
        title = f"{rig_title}: confusion matrix, {name}{part.title}, {speeds}"
        stem = f"confusion{part.stem}_{name.lower().replace(' ', '-')}"
        text = "rows: true condition, columns: verdict, corner: accuracy in %\n" + _text(
            counts.rename_axis(None).rename_axis(None, axis=1)
        )
        tables.append(Table(title, text, stem, table))
    return tables


def _speeds(verdicts, part, rig_title):
    accuracy = pd.concat(
        {name: speed_accuracy(own) for name, own in verdicts.groupby("diagnoser", sort=False)},
        names=["diagnoser"],
    )
    shown = pd.DataFrame(
        [
            [_pair_text(value, train == test) for test, value in row.items()]
            for (_, train), row in accuracy.iterrows()
        ],
        index=[f"{name}, {train:g} rpm" for name, train in accuracy.index],
        columns=[f"{test:g} " for test in accuracy.columns],
    )
    title = f"{rig_title}: accuracy in %, every pair of speeds{part.title}"
    text = "rows: calibrated at, columns: tested at, [same speed]\n" + _text(shown)
    frame = accuracy.set_axis([f"{test:g} rpm" for test in accuracy.columns], axis=1)
    return [Table(title, text, f"speeds{part.stem}", frame)]


def _pair_text(accuracy, same_speed):
    return f"[{accuracy:.1f}]" if same_speed else f"{accuracy:.1f} "


def _summary(verdicts, parts, rig_title):
    rows = []
    for part in parts:
        for name, own in of_part(verdicts, part).groupby("diagnoser", sort=False):
            crack = {} if part.crack_mm is None else {"crack_mm": part.crack_mm}
            rows.append({"diagnoser": name} | crack | speed_summary(speed_accuracy(own)))
    frame = pd.DataFrame(rows)
    pair = [
        f"{row.worst_pair:.1f} ({row.worst_train_rpm:g} -> {row.worst_test_rpm:g})"
        for row in frame.itertuples()
    ]
    shown = pd.DataFrame(
        {
            "other speeds": frame["mean_other_speed"].map("{:.1f}".format),
            "worst pair (rpm)": pair,
            "same speed": frame["mean_same_speed"].map("{:.1f}".format),
        }
    )
    labels = frame["diagnoser"]
    if "crack_mm" in frame:
        labels = labels + frame["crack_mm"].map(", {:g} mm".format)
    title = f"{rig_title}: mean accuracy in % over pairs of different speeds"
    indexed = frame.set_index([name for name in ("diagnoser", "crack_mm") if name in frame])
    return Table(title, _text(shown.set_axis(labels.tolist())), "summary", indexed)


def _text(table):
    return table.to_string(float_format="{:.1f}".format, na_rep="-")
