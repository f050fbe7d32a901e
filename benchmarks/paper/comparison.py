"""Verdicts in the layout of Tables 2-9 of Piltan and Kim (2019), next to the printed values.

The verdicts come from `run_protocol`, with the method names in `METHODS`.
"""

import numpy as np
import pandas as pd

from benchmarks.paper.confusion import confusion_margins, confusion_table
from benchmarks.paper.printed_tables import load_tables

#: Methods in the order of the paper's columns; the last is not in the paper.
METHODS = ("proposed", "ALPIO", "Diagnoser")
AVERAGE = "Average"
#: Heads of columns from verdicts and of printed columns.
OWN = "simulated rig"
PAPER = "paper"
PRINTED_AVERAGE = "Average, as printed"
_BY_SPEED = (2, 3, 4, 5)
_BY_CRACK = (8, 9)


def condition_accuracy(verdicts, conditions, columns):
    """Compute the accuracy for each condition, as Tables 2-5, 8 and 9 of Piltan and Kim (2019).

    Parameters
    ----------
    verdicts : DataFrame
        Verdicts of the protocol.
    conditions : iterable of str
        Rows, in this order.
    columns : list of str
        Columns of `verdicts` whose values are the columns of the table, outermost
        first; the values are in order of appearance.

    Returns
    -------
    DataFrame
        Recall of each condition in percent; the last row, "Average", is the mean of the
        rows above.

    Examples
    --------
    >>> verdicts = pd.DataFrame({
    ...     "diagnoser": ["A"] * 4,
    ...     "true": ["ball", "ball", "good", "good"],
    ...     "predicted": ["ball", "good", "good", "good"],
    ... })
    >>> condition_accuracy(verdicts, ["good", "ball"], ["diagnoser"])["A"].to_dict()
    {'good': 100.0, 'ball': 50.0, 'Average': 75.0}
    """
    right = 100.0 * (verdicts["true"] == verdicts["predicted"])
    table = (
        right.groupby([verdicts[name] for name in ["true", *columns]])
        .mean()
        .unstack(columns)
    )
    # In order of appearance; pandas 2.2 mislabels columns if unstack is told not to
    # sort.
    appearance = {
        name: rank
        for column in columns
        for rank, name in enumerate(verdicts[column].unique())
    }
    table = table.reindex(conditions).sort_index(
        axis=1, key=lambda names: names.map(appearance)
    )
    table.loc[AVERAGE] = table.mean()
    return table.rename_axis(index="condition")


def accuracy_with_paper(verdicts: pd.DataFrame, number: int) -> pd.DataFrame:
    """Return one of Tables 2-5, 8 and 9: accuracy by condition, next to the paper's values.

    Parameters
    ----------
    verdicts : DataFrame
        Verdicts of the protocol. Verdicts for other speeds or cracks than the table's
        are ignored.
    number : {2, 3, 4, 5, 8, 9}
        Number of the table.

    Returns
    -------
    DataFrame
        Accuracies in percent. The rows are the conditions, the "Average" of these rows,
        and the average that the paper prints. The columns are (source, method, crack
        size in mm or speed in rpm). The source is "simulated rig" or "paper".

    Raises
    ------
    ValueError
        If the table does not contain accuracies, or a method is not in `METHODS`.
    """
    _check_methods(verdicts)
    if number not in _BY_SPEED + _BY_CRACK:
        raise ValueError(
            f"number={number!r}, expected one of {[*_BY_SPEED, *_BY_CRACK]}."
        )
    table = load_tables().tables[number]
    if number in _BY_SPEED:
        chosen = verdicts[verdicts["test_rpm"] == table.rpm]
        inner = "crack_mm"
    else:
        chosen = verdicts[verdicts["crack_mm"] == table.crack_mm]
        inner = "test_rpm"
    simulated = condition_accuracy(
        chosen, table.frame.index, ["diagnoser", inner]
    ).sort_index(axis=1)
    simulated = simulated[
        [name for name in METHODS if name in simulated.columns.levels[0]]
    ]
    paper = table.frame.copy()
    paper.loc[AVERAGE] = paper.mean()
    paper.loc[PRINTED_AVERAGE] = table.average
    return pd.concat(
        {OWN: simulated, PAPER: paper}, axis=1, names=["source", "method", inner]
    )


def confusion_with_paper(
    verdicts: pd.DataFrame, number: int
) -> dict[tuple[str, str], pd.DataFrame]:
    """Return Table 6 or 7: confusion matrices at 400 rpm, that of the paper first.

    The last column is the recall and the last row the precision. Both are recomputed
    from the counts. The paper has them the other way round.

    Parameters
    ----------
    verdicts : DataFrame
        Verdicts of the protocol. Verdicts for other speeds or cracks than the table's
        are ignored.
    number : {6, 7}
        Number of the table.

    Returns
    -------
    dict of (source, method) to DataFrame
        First ("paper", "proposed"), then one matrix for each method in `verdicts`, as
        `confusion_table` returns it. The paper's matrix has
        one more column and one more row, which are the printed margins with their
        printed names.

    Raises
    ------
    ValueError
        If the table is not a confusion matrix, or a method is not in `METHODS`.
    """
    _check_methods(verdicts)
    if number not in (6, 7):
        raise ValueError(f"number={number!r}, expected one of [6, 7].")
    table = load_tables().tables[number]
    paper = confusion_margins(table.frame)
    paper[f'printed as "{table.right_label}"'] = table.right_margin
    paper.loc[f'printed as "{table.bottom_label}"'] = table.bottom_margin
    paper.iloc[-1, -1] = table.accuracy
    matrices = {(PAPER, METHODS[0]): paper}
    chosen = verdicts[
        (verdicts["test_rpm"] == table.rpm) & (verdicts["crack_mm"] == table.crack_mm)
    ]
    for name in METHODS:
        of_method = chosen[chosen["diagnoser"] == name]
        if len(of_method):
            matrices[OWN, name] = confusion_table(of_method, table.frame.index.tolist())
    return matrices


def paper_averages() -> pd.DataFrame:
    """Return the averages of the paper as claimed, as printed, and recomputed from its rows.

    Returns
    -------
    DataFrame
        Averages in percent. The rows are the sources of the averages, and the columns
        are (method, "3 mm" | "6 mm" | "both").

    Examples
    --------
    >>> paper_averages().loc["rows of Tables 2-5", ("proposed", "both")].item()
    97.59375
    """
    printed = load_tables()
    tables = printed.tables
    by_crack = {tables[n].crack_mm: tables[n].frame.mean() for n in _BY_CRACK}
    means = {
        "printed averages of Tables 2-5": pd.DataFrame(
            [tables[n].average for n in _BY_SPEED]
        ),
        "rows of Tables 2-5": pd.concat([tables[n].frame for n in _BY_SPEED]),
        "rows of Tables 2-4, the test sets": pd.concat(
            [tables[n].frame for n in (2, 3, 4)]
        ),
        "rows of Tables 8 and 9": pd.concat(by_crack, names=["crack_mm"])
        .groupby(["method", "crack_mm"])
        .mean()
        .to_frame()
        .T,
    }
    rows = {basis: _with_both(frame.mean()) for basis, frame in means.items()}
    recomputed = pd.DataFrame(rows).T[list(METHODS[:2])]
    claimed = pd.DataFrame(np.nan, ["claimed in section 5"], recomputed.columns)
    for method in METHODS[:2]:
        claim = printed.claims[f"average_identification_{method}_tables2_5"]
        claimed[method, "both"] = claim
    return pd.concat([claimed, recomputed])


def averages(verdicts: pd.DataFrame, halves: pd.DataFrame) -> pd.DataFrame:
    """Average the accuracy over conditions and speeds, in the layout of `paper_averages`.

    Parameters
    ----------
    verdicts : DataFrame
        Verdicts of the protocol.
    halves : DataFrame
        Verdicts of the second halves at the speed of calibration.

    Returns
    -------
    DataFrame
        Averages in percent. The first row is over all tables and the second over the
        test sets alone. The third is over the test sets and, for the speed of
        calibration, the second halves. The columns are (method, "3 mm" | "6 mm" |
        "both").
    """
    _check_methods(verdicts)
    tested = verdicts[verdicts["train_rpm"] != verdicts["test_rpm"]]
    sets = {
        "rows of Tables 2-5": verdicts,
        "rows of Tables 2-4, the test sets": tested,
        "rows of Tables 2-4, and of 5 by halves": pd.concat([tested, halves]),
    }
    rows = {}
    for basis, of_basis in sets.items():
        right = 100.0 * (of_basis["true"] == of_basis["predicted"])
        keys = [
            of_basis[name] for name in ("diagnoser", "crack_mm", "test_rpm", "true")
        ]
        rows[basis] = _with_both(
            right.groupby(keys).mean().groupby(level=[0, 1]).mean()
        )
    frame = pd.DataFrame(rows).T
    return frame[[name for name in METHODS if name in frame.columns.levels[0]]]


def paper_improvements() -> pd.DataFrame:
    """Return the improvement of the proposed method on ALPIO, as claimed and recomputed.

    Returns
    -------
    DataFrame
        Improvement in percentage points, which the paper calls percent. The rows are
        the sources of the values, and the columns are "3 mm" and "6 mm".

    Examples
    --------
    >>> paper_improvements().loc["rows of Tables 2-5"].tolist()
    [17.3125, 16.375]
    """
    claims = load_tables().claims
    claimed = {
        basis: {
            f"{crack} mm": claims[f"{part}_improvement_{crack}mm"] for crack in (3, 6)
        }
        for basis, part in {
            "claimed in the abstract": "abstract",
            "claimed in section 5": "section5",
            "claimed in the conclusion": "conclusion",
        }.items()
    }
    recomputed = improvements(paper_averages().iloc[1:])
    return pd.concat([pd.DataFrame(claimed).T, recomputed])


def improvements(averages: pd.DataFrame) -> pd.DataFrame:
    """Compute the improvement of the proposed method on ALPIO, by crack size.

    Parameters
    ----------
    averages : DataFrame
        Averages, as `averages` or `paper_averages` returns them.

    Returns
    -------
    DataFrame
        "proposed" minus "ALPIO" in percentage points. The rows are those of `averages`,
        and the columns are "3 mm" and "6 mm".
    """
    return (averages["proposed"] - averages["ALPIO"])[["3 mm", "6 mm"]]


def _with_both(means):
    """Rename the crack sizes of means by (method, crack size), and add the mean of both sizes."""
    means = means.unstack().rename(columns="{:g} mm".format)
    means["both"] = means.mean(axis=1)
    return means.rename_axis(columns="crack").T.unstack()


def _check_methods(verdicts):
    unknown = np.setdiff1d(verdicts["diagnoser"].unique(), METHODS).tolist()
    if unknown:
        raise ValueError(
            f"The column diagnoser holds {unknown}, expected only {list(METHODS)}."
        )
