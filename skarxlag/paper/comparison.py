"""Verdicts in the layout of Tables 2-9 of Piltan and Kim (2019), beside what the paper prints.

Verdicts are those of `skarxlag.paper.run_protocol` with the names in `METHODS`.
"""

from typing import Any

import numpy as np
import pandas as pd

from ..accuracy_tables import AVERAGE, condition_accuracy, confusion_margins, confusion_table
from .tables import load_tables

#: Methods in the order of the paper's columns; the last is not in the paper.
METHODS = ("proposed", "ALPIO", "Diagnoser")
#: Heads of what comes from verdicts and of what the paper prints.
OWN, PAPER = "simulated rig", "paper"
PRINTED_AVERAGE = "Average, as printed"
_BY_SPEED, _BY_CRACK = (2, 3, 4, 5), (8, 9)


def accuracy_beside_paper(verdicts: pd.DataFrame, number: str) -> pd.DataFrame:
    """One of Tables 2-5, 8 and 9: accuracy by condition, verdicts beside the paper.

    Parameters
    ----------
    verdicts : DataFrame
        Of the protocol; those of other speeds, or other cracks, than the table's are left out.
    number : {2, 3, 4, 5, 8, 9}
        Of the table.

    Returns
    -------
    DataFrame
        Percent. Rows: the conditions; "Average" of these rows; the average that the paper prints.
        Columns: (source, method, crack size in mm or speed in rpm), the source being "simulated
        rig" or "paper".

    Raises
    ------
    ValueError
        If that table does not hold accuracies, or a method is not in `METHODS`.
    """
    _check_methods(verdicts)
    if number not in _BY_SPEED + _BY_CRACK:
        raise ValueError(f"number={number!r}, expected one of {[*_BY_SPEED, *_BY_CRACK]}.")
    table = load_tables().tables[number]
    if number in _BY_SPEED:
        chosen, inner = verdicts[verdicts["test_rpm"] == table.rpm], "crack_mm"
    else:
        chosen, inner = verdicts[verdicts["crack_mm"] == table.crack_mm], "test_rpm"
    own = condition_accuracy(chosen, table.frame.index, ["diagnoser", inner]).sort_index(axis=1)
    own = own[[name for name in METHODS if name in own.columns.levels[0]]]
    paper = table.frame.copy()
    paper.loc[AVERAGE] = paper.mean()
    paper.loc[PRINTED_AVERAGE] = table.average
    return pd.concat({OWN: own, PAPER: paper}, axis=1, names=["source", "method", inner])


def confusion_beside_paper(verdicts: pd.DataFrame, number: str) -> dict[str, Any]:
    """Table 6 or 7: confusion matrices at 400 rpm, the paper's first.

    Recall stands on the right, precision below, both recomputed from the counts; the paper has
    them the other way round.

    Parameters
    ----------
    verdicts : DataFrame
        Of the protocol; those of other speeds and cracks than the table's are left out.
    number : {6, 7}
        Of the table.

    Returns
    -------
    dict of (source, method) to DataFrame
        First ("paper", "proposed"), then one for each method in `verdicts`; each as
        `skarxlag.accuracy_tables.confusion_table` returns it. The paper's has one more column
        and one more row, the margins as printed under the names that are printed.

    Raises
    ------
    ValueError
        If that table is no confusion matrix, or a method is not in `METHODS`.
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
        own = chosen[chosen["diagnoser"] == name]
        if len(own):
            matrices[OWN, name] = confusion_table(own, table.frame.index.tolist())
    return matrices


def paper_averages() -> pd.DataFrame:
    """Averages of the paper: claimed, printed, and recomputed from its rows.

    Returns
    -------
    DataFrame
        Percent. Rows: where the average comes from. Columns: (method, "3 mm" | "6 mm" | "both").

    Examples
    --------
    >>> paper_averages().loc["rows of Tables 2-5", ("proposed", "both")].item()
    97.59375
    """
    printed = load_tables()
    tables = printed.tables
    by_crack = {tables[n].crack_mm: tables[n].frame.mean() for n in _BY_CRACK}
    means = {
        "printed averages of Tables 2-5": pd.DataFrame([tables[n].average for n in _BY_SPEED]),
        "rows of Tables 2-5": pd.concat([tables[n].frame for n in _BY_SPEED]),
        "rows of Tables 2-4, the test sets": pd.concat([tables[n].frame for n in (2, 3, 4)]),
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
    """Averages over conditions and speeds, as `paper_averages` has them.

    Parameters
    ----------
    verdicts : DataFrame
        Of the protocol.
    halves : DataFrame
        Of the second halves at the speed of calibration.

    Returns
    -------
    DataFrame
        Percent. Rows: all tables; the test sets alone; the test sets and, for the speed of
        calibration, the second halves. Columns: (method, "3 mm" | "6 mm" | "both").
    """
    _check_methods(verdicts)
    tested = verdicts[verdicts["train_rpm"] != verdicts["test_rpm"]]
    sets = {
        "rows of Tables 2-5": verdicts,
        "rows of Tables 2-4, the test sets": tested,
        "rows of Tables 2-4, and of 5 by halves": pd.concat([tested, halves]),
    }
    rows = {}
    for basis, own in sets.items():
        right = 100.0 * (own["true"] == own["predicted"])
        keys = [own[name] for name in ("diagnoser", "crack_mm", "test_rpm", "true")]
        rows[basis] = _with_both(right.groupby(keys).mean().groupby(level=[0, 1]).mean())
    frame = pd.DataFrame(rows).T
    return frame[[name for name in METHODS if name in frame.columns.levels[0]]]


def paper_improvements() -> pd.DataFrame:
    """Improvement of the proposed method on ALPIO: as claimed, and recomputed.

    Returns
    -------
    DataFrame
        Percentage points, though the paper calls them percent. Rows: where the figure comes from.
        Columns: "3 mm", "6 mm".

    Examples
    --------
    >>> paper_improvements().loc["rows of Tables 2-5"].tolist()
    [17.3125, 16.375]
    """
    claims = load_tables().claims
    claimed = {
        basis: {f"{crack} mm": claims[f"{part}_improvement_{crack}mm"] for crack in (3, 6)}
        for basis, part in {
            "claimed in the abstract": "abstract",
            "claimed in section 5": "section5",
            "claimed in the conclusion": "conclusion",
        }.items()
    }
    recomputed = improvements(paper_averages().iloc[1:])
    return pd.concat([pd.DataFrame(claimed).T, recomputed])


def improvements(averages: pd.DataFrame) -> pd.DataFrame:
    """Improvement of the proposed method on ALPIO, by crack size.

    Parameters
    ----------
    averages : DataFrame
        As `averages` or `paper_averages` returns it.

    Returns
    -------
    DataFrame
        Percentage points, "proposed" minus "ALPIO". Rows as in `averages`, columns "3 mm" and
        "6 mm".
    """
    return (averages["proposed"] - averages["ALPIO"])[["3 mm", "6 mm"]]


def _with_both(means):
    """From means by (method, crack size) to means by (method, name), with that of both sizes."""
    means = means.unstack().rename(columns="{:g} mm".format)
    means["both"] = means.mean(axis=1)
    return means.rename_axis(columns="crack").T.unstack()


def _check_methods(verdicts):
    unknown = np.setdiff1d(verdicts["diagnoser"].unique(), METHODS).tolist()
    if unknown:
        raise ValueError(f"The column diagnoser holds {unknown}, expected only {list(METHODS)}.")
