"""Tables of ``evaluate``, as text and as CSV."""

from dataclasses import dataclass, replace
from typing import Any

import pandas as pd

from ..accuracy_tables import (
    condition_accuracy,
    confusion_table,
    speed_accuracy,
    speed_summary,
)


@dataclass(frozen=True)
class Table:
    """One table: a title, what is shown of it, and the frame that goes into its file.

    Parameters
    ----------
    title : str
        What it is about.
    blocks : list of (str, DataFrame)
        Captions, empty for none, and cells as text, in the order in which they are shown.
    stem : str
        Name of its CSV without rig and suffix.
    frame : DataFrame
        What the CSV holds.
    """

    title: str
    blocks: list[Any]
    stem: str
    frame: pd.DataFrame

    @property
    def text(self) -> str:
        """Title, captions and cells, for a terminal."""
        lines = [self.title]
        for caption, cells in self.blocks:
            lines += [caption] if caption else []
            lines.append(cells.to_string())
        return "\n".join(lines) + "\n"


def evaluation_report(verdicts: pd.DataFrame, conditions: list[str], rig_title: str) -> list[Table]:
    """All tables of an evaluation.

    Parameters
    ----------
    verdicts : DataFrame
        As `skarxlag.accuracy_tables` describes it.
    conditions : list of str
        Of the rig.
    rig_title : str
        Heads every table.

    Returns
    -------
    list of Table
        By condition, confusion matrices, pairs of speeds, summary. Frames have the title of the
        rig as their first level.
    """
    tables = [
        _by_condition(trained, train_rpm, conditions, rig_title)
        for train_rpm, trained in verdicts.groupby("train_rpm")
    ]
    for name, own in verdicts.groupby("diagnoser", sort=False):
        chosen, speeds = confusion_verdicts(own)
        title = f"{rig_title}: confusion matrix, {name}, {speeds}"
        table = confusion_table(chosen, conditions)
        block = "rows: true condition, columns: verdict, corner: accuracy in %", matrix_text(table)
        tables.append(Table(title, [block], f"confusion_{file_stem(name)}", table))
    tables += [_speeds(verdicts, rig_title), _summary(verdicts, rig_title)]
    return [
        replace(table, frame=pd.concat({rig_title: table.frame}, names=["rig"])) for table in tables
    ]


def confusion_verdicts(verdicts: pd.DataFrame) -> tuple[pd.DataFrame, str]:
    """Return the rows that confusion matrices count, and their speeds in words.

    Tests at the training speed count only if there are no others.
    """
    other = verdicts[verdicts["train_rpm"] != verdicts["test_rpm"]]
    chosen = other if len(other) else verdicts
    trained, tested = (chosen[f"{role}_rpm"].unique() for role in ("train", "test"))
    if len(trained) > 1 and len(tested) > 1:
        return chosen, "all pairs of different speeds"
    return chosen, f"calibrated at {_speed_list(trained)}, tested at {_speed_list(tested)} rpm"


def file_stem(title: str) -> str:
    """Name of a diagnoser in a file's name."""
    return title.lower().replace(" ", "-")


def matrix_text(table: pd.DataFrame, digits: int = 1) -> pd.DataFrame:
    """Cells of a confusion matrix with margins, as text with at most that many decimals."""
    cells = table.map(lambda value: number_text(value, digits) or "-")
    return cells.rename_axis(None).rename_axis(None, axis=1)


def number_text(value: float, digits: int) -> str:
    """A number with at most `digits` decimals; nothing for NaN.

    Examples
    --------
    >>> [number_text(value, 1) for value in (97.0, 0.25, 100.0, float("nan"))]
    ['97', '0.2', '100', '']
    """
    if pd.isna(value):
        return ""
    return f"{round(value, digits) + 0.0:.{digits}f}".rstrip("0").rstrip(".")


def _speed_list(speeds):
    return ", ".join(f"{speed:g}" for speed in sorted(speeds))


def _by_condition(trained, train_rpm, conditions, rig_title):
    table = condition_accuracy(trained, conditions, ["diagnoser", "test_rpm"])
    title = f"{rig_title}: accuracy in %, by speed of the test (rpm), calibrated at {train_rpm:g}"
    shown = table.map("{:.1f}".format).rename(columns="{:g}".format, level="test_rpm")
    flat = table.set_axis([f"{name}, {rpm:g} rpm" for name, rpm in table.columns], axis=1)
    blocks = [("", shown.rename_axis(None).rename_axis([None, None], axis=1))]
    return Table(f"{title} rpm", blocks, f"conditions_{train_rpm:g}rpm", flat)


def _speeds(verdicts, rig_title):
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
    title = f"{rig_title}: accuracy in %, every pair of speeds"
    caption = "rows: calibrated at, columns: tested at, [same speed]"
    frame = accuracy.set_axis([f"{test:g} rpm" for test in accuracy.columns], axis=1)
    return Table(title, [(caption, shown)], "speeds", frame)


def _pair_text(accuracy, same_speed):
    return f"[{accuracy:.1f}]" if same_speed else f"{accuracy:.1f} "


def _summary(verdicts, rig_title):
    frame = pd.DataFrame(
        {"diagnoser": name} | speed_summary(speed_accuracy(own))
        for name, own in verdicts.groupby("diagnoser", sort=False)
    ).set_index("diagnoser")
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
    title = f"{rig_title}: mean accuracy in % over pairs of different speeds"
    return Table(title, [("", shown.rename_axis(None))], "summary", frame)
