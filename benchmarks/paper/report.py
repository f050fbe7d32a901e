"""Tables 2-9 of the paper, filled on the simulated rig, as text and as CSV."""

from dataclasses import dataclass
from functools import partial

import pandas as pd

from benchmarks.paper.comparison import (
    accuracy_with_paper,
    averages,
    confusion_with_paper,
    improvements,
    paper_averages,
    paper_improvements,
)
from benchmarks.paper.ladders import DIAGNOSERS
from benchmarks.paper.printed_tables import load_tables

_IN_PAPER = {DIAGNOSERS["extended-state"][0]: "proposed"}
#: Figures of the paper are shown with all decimals that they have, or come to.
_DIGITS = {"paper": 3, "simulated rig": 1}
_INNER_UNITS = {"crack_mm": "{:g} mm", "test_rpm": "{:g} rpm"}
_SAME_WINDOWS = (
    "At 500 rpm the same windows are calibrated and scored, as in the paper's Table 5."
)


@dataclass(frozen=True)
class Table:
    """Table with a title, captions and cells as text, and the frame in its csv file `stem`."""

    title: str
    blocks: list[tuple[str, pd.DataFrame]]
    stem: str
    frame: pd.DataFrame


def paper_report(outcome):
    """Return Tables 2-9, averages and improvements, in the paper's order, next to the paper's.

    Table 5 by halves follows Table 5.

    Parameters
    ----------
    outcome : Bunch
        Of `benchmarks.paper.protocol.run_protocol` with the titles in
        `benchmarks.paper.ladders`.

    Returns
    -------
    list of Table
        The tables.
    """
    verdicts, halves = (
        frame.assign(diagnoser=frame["diagnoser"].replace(_IN_PAPER))
        for frame in (outcome.verdicts, outcome.halves)
    )
    about = load_tables().tables
    tables = [
        _by_speed(verdicts, number, f"at {about[number].rpm} rpm")
        for number in (2, 3, 4)
    ]
    tables.append(_by_speed(verdicts, 5, "at 500 rpm", note=_SAME_WINDOWS))
    honest = (
        "at 500 rpm, calibrated on first halves of recordings, scored on second halves"
    )
    tables.append(_by_speed(halves, 5, honest, suffix=" by halves"))
    tables += [_confusion(verdicts, number, about[number]) for number in (6, 7)]
    tables += [_by_crack(verdicts, number, about[number]) for number in (8, 9)]
    simulated = averages(verdicts, halves)
    title = "Average accuracy in %, recomputed from rows where not claimed or printed"
    tables.append(_both_sources(title, "averages", paper_averages(), simulated))
    title = "Improvement of the proposed method on ALPIO, in percentage points"
    tables.append(
        _both_sources(
            title, "improvements", paper_improvements(), improvements(simulated)
        )
    )
    return tables


def _by_speed(verdicts, number, about, *, suffix="", note=""):
    frame = accuracy_with_paper(verdicts, number)
    title = f"Table {number}{suffix}: accuracy in %, {about}"
    stem = f"table{number}{suffix.replace(' ', '_')}"
    return Table(title, [(note, _accuracy_text(frame))], stem, _flat(frame))


def _by_crack(verdicts, number, about):
    frame = accuracy_with_paper(verdicts, number)
    blocks = []
    note = _SAME_WINDOWS
    for method in frame["simulated rig"].columns.unique("method"):
        of_method = frame.loc[:, frame.columns.get_level_values("method") == method]
        blocks.append((note, _accuracy_text(of_method.dropna(axis=0, how="all"))))
        note = ""
    title = f"Table {number}: accuracy in % by speed, crack {about.crack_mm} mm"
    return Table(title, blocks, f"table{number}", _flat(frame))


def _accuracy_text(frame):
    unit = _INNER_UNITS[frame.columns.names[-1]]
    cells = {
        (source, method, unit.format(value)): _numbers(column, _DIGITS[source])
        for (source, method, value), column in frame.items()
    }
    return pd.DataFrame(cells).rename_axis(None)


def _numbers(values, digits):
    return values.map(partial(number_text, digits=digits))


def _confusion(verdicts, number, about):
    matrices = confusion_with_paper(verdicts, number)
    # The paper has none of other methods; those are in the file.
    blocks = [
        (
            f"{source}, {method}; corner: accuracy in %",
            matrix_text(matrix, _DIGITS[source]),
        )
        for (source, method), matrix in matrices.items()
        if method == "proposed"
    ]
    title = (
        f"Table {number}: confusion matrices at {about.rpm} rpm, crack {about.crack_mm} mm; "
        "rows: true condition, columns: verdict"
    )
    frame = pd.concat(
        {
            (source, file_stem(method)): matrix
            for (source, method), matrix in matrices.items()
        },
        names=["source", "method"],
    )
    return Table(title, blocks, f"table{number}", frame)


def _both_sources(title, stem, paper, simulated):
    frame = pd.concat(
        {"paper": paper, "simulated rig": simulated}, names=["source", "basis"]
    )
    cells = pd.concat(
        [
            rows.apply(_numbers, digits=_DIGITS[source]).set_axis(
                [f"{source}, {basis}" for basis in rows.index]
            )
            for source, rows in (("paper", paper), ("simulated rig", simulated))
        ]
    )[simulated.columns].fillna("")
    if isinstance(simulated.columns, pd.MultiIndex):
        cells.columns = pd.MultiIndex.from_tuples(simulated.columns.tolist())
    return Table(title, [("", cells)], stem, _flat(frame[simulated.columns]))


def _flat(frame):
    if not isinstance(frame.columns, pd.MultiIndex):
        return frame
    units = [_INNER_UNITS.get(name, "{}") for name in frame.columns.names]
    heads = [
        ", ".join(unit.format(value) for unit, value in zip(units, key, strict=True))
        for key in frame.columns
    ]
    return frame.set_axis(heads, axis=1)


def file_stem(title):
    """Return the name of a diagnoser in the name of a file."""
    return title.lower().replace(" ", "-")


def matrix_text(table, digits=1):
    """Return a confusion matrix with margins as text with at most that many decimals."""
    cells = table.map(lambda value: number_text(value, digits) or "-")
    return cells.rename_axis(None).rename_axis(None, axis=1)


def number_text(value, digits):
    """Return a number with at most `digits` decimals, and nothing for NaN.

    Examples
    --------
    >>> [number_text(value, 1) for value in (97.0, 0.25, 100.0, float("nan"))]
    ['97', '0.2', '100', '']
    """
    if pd.isna(value):
        return ""
    return f"{round(value, digits) + 0.0:.{digits}f}".rstrip("0").rstrip(".")
