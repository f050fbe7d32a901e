"""Tables and figures of one case of `evaluate`, and the summary of all cases."""

from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd

from ...model_selection.accuracy_tables import confusion_table, speed_summary
from ...plotting import SpeedAccuracyDisplay
from . import evaluation_summary
from .evaluation_cases import Case
from .messages import counted, listed

_QUESTION = (
    "How often does each method name the right condition and the right fault location\n"
    "at a speed, on a bearing or under a load that its training did not have?"
)
#: Explanations of the columns of the summary.
_LEGEND = (
    "bearings: how many were tested; condition, location: windows with the right one, in %;\n"
    "*: the best of a test."
)
_LEGEND_OF_STATED = (
    f"stated: windows whose location has a probability of {evaluation_summary.STATED:g} "
    "or more, in %; of these: right ones."
)


def case_tables(
    case: Case, verdicts: pd.DataFrame
) -> dict[str, tuple[str, pd.DataFrame]]:
    """Return titles and tables of the protocols across speeds, by the names of their files.

    Parameters
    ----------
    case : Case
        The case.
    verdicts : DataFrame
        Of these protocols, as `case_verdicts` returns them.
    """
    tables = {}
    units = {"windows": verdicts}
    if not case.is_rig:
        units["recordings"] = _verdicts_of_recordings(verdicts)
    for (protocol, title), (unit, frame) in product(
        case.protocols.items(), units.items()
    ):
        accuracy = _accuracy(case, frame[frame["protocol"] == protocol])
        tables[f"{protocol}_{unit}"] = f"accuracy of {unit} in %, {title}", accuracy
    names = list(case.methods)
    if case.is_rig:
        summaries = {name: speed_summary(accuracy.loc[name]) for name in names}
        summary = pd.DataFrame(summaries).T.rename_axis("diagnoser")
        tables["summary"] = "mean accuracy in % by pair of speeds", summary
    shown, title = _verdicts_of_matrices(case, frame)
    for name in names:
        matrix = confusion_table(
            shown[shown["diagnoser"] == name], case.rig.target_names
        )
        tables[f"confusion_{'-'.join(name.lower().split())}"] = (
            f"confusion matrix of {unit}, {name}, {title}; rows: true condition, "
            "columns: verdict, corner: accuracy in %",
            matrix,
        )
    return tables


def _verdicts_of_recordings(verdicts):
    """Return the verdict of most windows of each recording."""
    facts = ["protocol", "diagnoser", "split", "train_rpm", "test_rpm", "recording"]
    groups = verdicts.groupby([*facts, "true"], sort=False, dropna=False)["predicted"]
    return groups.agg(lambda group: group.mode().iloc[0]).reset_index()


def _accuracy(case, tests):
    """Return percent by diagnoser, on a rig also by training speed, and by test speed."""
    rows = ["diagnoser", "train_rpm"] if case.is_rig else ["diagnoser"]
    hits = tests.assign(hit=100.0 * (tests["true"] == tests["predicted"]))
    table = hits.pivot_table("hit", rows, "test_rpm", sort=False).sort_index(axis=1)
    return table if case.is_rig else table.assign(mean=table.mean(axis=1))


def _verdicts_of_matrices(case, verdicts):
    """Return the rows of one protocol at other speeds than that of the training, and their title.

    The last protocol trains on most recordings. If there are no other speeds, all rows
    count.
    """
    protocol, title = list(case.protocols.items())[-1]
    verdicts = verdicts[verdicts["protocol"] == protocol]
    if not case.is_rig:
        return verdicts, title.removesuffix(" (columns)")
    is_other = verdicts["train_rpm"] != verdicts["test_rpm"]
    if is_other.any():
        return verdicts[is_other], "tests at other speeds"
    return verdicts, "tests at the same speed"


def as_text(title: str, table: pd.DataFrame) -> str:
    """Return a table with its title; numbers among its row and column names are speeds."""
    shown = table.round(1).rename(columns=_speed, index=_speed)
    text = shown.rename_axis(columns=None).to_string(
        float_format="{:g}".format, na_rep="-"
    )
    return f"{title}\n{text}\n"


def _speed(name):
    return f"{name:g} rpm" if isinstance(name, float) else name


def summary_text(cases: list[Case], summaries: list[pd.DataFrame]) -> str:
    """Return the question, the data, one table of all cases, and sentences that read it.

    Parameters
    ----------
    cases : list of Case
        Of one rig or table.
    summaries : list of DataFrame
        As `evaluation_summary.summary` returns them.
    """
    first = cases[0]
    names = first.rig.target_names
    windows = f"{first.rig.data.shape[-1]} samples at {first.rig.sampling_rate:g} Hz"
    parts = [case.part for case in cases]
    table = summaries[0] if parts == [""] else pd.concat(summaries, keys=parts)
    legend = [_LEGEND, _LEGEND_OF_STATED]
    if table["of these"].isna().all():
        table = table.drop(columns=["stated", "of these"])
        legend = [_LEGEND]
    sentences = []
    for case, summary in zip(cases, summaries, strict=True):
        start = f"{case.part.capitalize()}: " if case.part else ""
        read = [
            evaluation_summary.reading(summary, case.recommended),
            *evaluation_summary.better_ones(summary, case.recommended),
        ]
        sentences += [f"{start}{sentence}" for sentence in read]
    not_measured = dict.fromkeys(
        sentence for case in cases for sentence in case.sentences
    )
    lines = [
        _QUESTION,
        "",
        f"{first.title.removesuffix(f', {first.part}')}: "
        f"{counted(len(names), 'condition')} ({', '.join(names)})",
        f"at {listed(np.unique(first.rig.rpm))} rpm, windows of {windows}.{first.note}",
        "",
        evaluation_summary.with_marks(table),
        *legend,
        "",
        *sentences,
        *not_measured,
        "",
    ]
    return "\n".join(lines)


def save_figure(case: Case, verdicts: pd.DataFrame, folder: Path) -> None:
    """Draw the accuracy across speeds and the confusion matrices of a case, and save them.

    Parameters
    ----------
    case, verdicts
        As in `case_tables`.
    folder : Path
        Where the figure is saved.
    """
    from matplotlib.figure import Figure
    from sklearn.metrics import ConfusionMatrixDisplay

    shown, title = _verdicts_of_matrices(case, verdicts)
    n_methods = len(case.methods)
    figure = Figure(figsize=(4.6 * n_methods, 9.6), layout="constrained")
    figure.suptitle(f"{case.title}; matrices of windows: {title}", fontsize="medium")
    axes = figure.subplots(2, n_methods, sharey="row", squeeze=False)
    for upper, lower, name in zip(*axes, case.methods, strict=True):
        at_speeds = verdicts[verdicts["diagnoser"] == name].dropna(subset="train_rpm")
        display = SpeedAccuracyDisplay(
            at_speeds["true"],
            at_speeds["predicted"],
            train_rpm=at_speeds["train_rpm"],
            test_rpm=at_speeds["test_rpm"],
        )
        display.plot(ax=upper)
        upper.set_title(name)
        upper.legend(loc="lower right", fontsize="small")
        of_method = shown[shown["diagnoser"] == name]
        ConfusionMatrixDisplay.from_predictions(
            of_method["true"],
            of_method["predicted"],
            ax=lower,
            labels=case.rig.target_names,
            xticks_rotation="vertical",
            cmap="Blues",
            colorbar=False,
        )
        accuracy = 100 * (of_method["true"] == of_method["predicted"]).mean()
        lower.set_title(f"Accuracy {accuracy:.1f} %")
        lower.set(xlabel="Verdict", ylabel="True condition")
        lower.label_outer()
    figure.savefig(folder / f"{case.stem}.png", dpi=120)
