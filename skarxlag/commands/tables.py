"""Tables of ``evaluate``, as text and as CSV."""

from dataclasses import dataclass, replace

import pandas as pd

from ..accuracy_tables import (
    condition_accuracy,
    confusion_table,
    speed_accuracy,
    speed_summary,
)


@dataclass(frozen=True)
class Table:
    """Table with a title, captions and cells as text, and the frame in its csv file.

    `stem` is the name of the file without rig and suffix.
    """

    title: str
    blocks: list[tuple[str, pd.DataFrame]]
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
    """Return all tables of an evaluation: by condition, confusion, pairs of speeds, summary.

    The title of the rig heads every table, and is the first level of every frame.
    """
    tables = [
        _by_condition(trained, train_rpm, conditions)
        for train_rpm, trained in verdicts.groupby("train_rpm")
    ]
    for name, own in verdicts.groupby("diagnoser", sort=False):
        chosen, speeds = confusion_verdicts(own)
        table = confusion_table(chosen, conditions)
        block = "rows: true condition, columns: verdict, corner: accuracy in %", matrix_text(table)
        title = f"confusion matrix, {name}, {speeds}"
        tables.append(Table(title, [block], f"confusion_{file_stem(name)}", table))
    tables += _between_speeds(verdicts)
    return [
        replace(
            table,
            title=f"{rig_title}: {table.title}",
            frame=pd.concat({rig_title: table.frame}, names=["rig"]),
        )
        for table in tables
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
    """Return the name of a diagnoser in the name of a file."""
    return title.lower().replace(" ", "-")


def matrix_text(table: pd.DataFrame, digits: int = 1) -> pd.DataFrame:
    """Return a confusion matrix with margins as text with at most that many decimals."""
    cells = table.map(lambda value: number_text(value, digits) or "-")
    return cells.rename_axis(None).rename_axis(None, axis=1)


def number_text(value: float, digits: int) -> str:
    """Return a number with at most `digits` decimals, and nothing for NaN.

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


def _by_condition(trained, train_rpm, conditions):
    table = condition_accuracy(trained, conditions, ["diagnoser", "test_rpm"])
    title = f"accuracy in %, by speed of the test (rpm), calibrated at {train_rpm:g} rpm"
    shown = table.map("{:.1f}".format).rename(columns="{:g}".format, level="test_rpm")
    flat = table.set_axis([f"{name}, {rpm:g} rpm" for name, rpm in table.columns], axis=1)
    shown = shown.rename_axis(None).rename_axis([None, None], axis=1)
    return Table(title, [("", shown)], f"conditions_{train_rpm:g}rpm", flat)


def _between_speeds(verdicts):
    """Return the tables of all pairs of speeds, and of their means."""
    by_name = {name: speed_accuracy(own) for name, own in verdicts.groupby("diagnoser", sort=False)}
    accuracy = pd.concat(by_name, names=["diagnoser"])
    shown = accuracy.map("{:.1f} ".format)
    for name, train in accuracy.index:
        if train in accuracy:
            shown.loc[(name, train), train] = f"[{accuracy.loc[(name, train), train]:.1f}]"
    shown.index = [f"{name}, {train:g} rpm" for name, train in accuracy.index]
    shown.columns = [f"{test:g} " for test in accuracy.columns]
    caption = "rows: calibrated at, columns: tested at, [same speed]"
    frame = accuracy.set_axis([f"{test:g} rpm" for test in accuracy.columns], axis=1)
    yield Table("accuracy in %, every pair of speeds", [(caption, shown)], "speeds", frame)
    frame = pd.DataFrame({name: speed_summary(own) for name, own in by_name.items()}).T
    frame = frame.rename_axis("diagnoser")
    pairs = [
        f"{row.worst_pair:.1f} ({row.worst_train_rpm:g} -> {row.worst_test_rpm:g})"
        for row in frame.itertuples()
    ]
    means = frame.map("{:.1f}".format)
    shown = pd.DataFrame(
        {
            "other speeds": means["mean_other_speed"],
            "worst pair (rpm)": pairs,
            "same speed": means["mean_same_speed"],
        }
    ).rename_axis(None)
    yield Table(
        "mean accuracy in % over pairs of different speeds", [("", shown)], "summary", frame
    )
