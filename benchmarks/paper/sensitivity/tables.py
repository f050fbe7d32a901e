"""Tables of the sensitivity studies: means and standard deviations over draws of the rig."""

import numpy as np
import pandas as pd

from benchmarks.pages.blocks import markdown
from benchmarks.paper.sensitivity.compound import COMPOUND, KNOWN


def spread(values):
    """Mean and standard deviation over draws as text; "refused" where there is no number.

    Examples
    --------
    >>> spread([90.0, 92.0]), spread([90.0]), spread([float("nan")] * 2)
    ('91.0 ± 1.4', '90.0', 'refused')
    """
    values = np.asarray(values, dtype=float)
    if np.isnan(values).all():
        return "refused"
    if len(values) == 1:
        return f"{values[0]:.1f}"
    return f"{values.mean():.1f} ± {values.std(ddof=1):.1f}"


def pivot(frame, rows, columns, value="accuracy"):
    """Text of :func:`spread` by rows and columns, averaged within a draw over all else.

    Parameters
    ----------
    frame : DataFrame
        With ``seed``, `value` and the columns named below.
    rows : list of str
        Columns that identify the rows; they become the first columns.
    columns : list of str
        Column whose values become the heads of the other columns.

    Returns
    -------
    table : DataFrame
        In the order of appearance.
    """
    within = frame.groupby([*rows, *columns, "seed"], sort=False)[value].mean()
    cells = within.groupby([*rows, *columns], sort=False).agg(spread)
    # pandas 2.2 puts values into the wrong cells if `unstack` does not sort.
    table = cells.unstack(columns)
    row_order = frame[rows].drop_duplicates()
    column_order = frame[columns].drop_duplicates()
    table = table.loc[_keys(row_order), _keys(column_order)]
    if len(columns) > 1:
        table.columns = [", ".join(map(_head, key)) for key in table.columns]
    table.columns = [_head(name) for name in table.columns]
    return table.reset_index()


def _keys(distinct):
    """Labels of an index of one level or of several."""
    return (
        list(distinct.itertuples(index=False, name=None))
        if distinct.shape[1] > 1
        else list(distinct.iloc[:, 0])
    )


def _head(name):
    return f"{name:g} mm" if isinstance(name, float) else str(name)


def accuracy_table(frame, rows):
    """Accuracy by setting: a column for each crack size and diagnoser."""
    return markdown(pivot(frame, rows, ["crack_mm", "diagnoser"]), digits=1)


def noise_table(frame):
    ratio = (
        frame.groupby("noise (mV)")["SNR (dB)"].transform("mean").round().astype(int)
    )
    return accuracy_table(
        frame.assign(**{"SNR (dB)": ratio}),
        ["noise (mV)", "SNR (dB)", "calibrated with"],
    )


def crack_table(frame):
    ordered = frame.sort_values("tested at", ascending=False, kind="stable")
    return markdown(
        pivot(ordered, ["tested at", "calibrated on", "tested on"], ["diagnoser"])
    )


def varied(grid):
    """The two parameters that a grid of gains varies, rows first."""
    fixed = ("grid", "seed", "crack_mm", "accuracy")
    return [
        name for name in grid.columns if name not in fixed and grid[name].notna().all()
    ]


def gains_table(frame):
    """A table for each grid, with the number of cells that are refused."""
    parts = []
    for name, grid in frame.groupby("grid", sort=False):
        rows, columns = varied(grid)
        text = grid.assign(**{each: grid[each].map(_plain) for each in (rows, columns)})
        table = pivot(text, [rows], [columns])
        cells = grid.groupby([rows, columns]).accuracy.count()
        refused = (
            f"; {int((cells == 0).sum())} of {len(cells)} cells refused as unstable"
        )
        corner = table.rename(columns={rows: f"{rows} \\ {columns}"})
        parts.append(
            f"**{name}**{refused if name != 'evaluation' else ''}\n\n{markdown(corner)}"
        )
    return "\n\n".join(parts)


def _plain(value):
    return f"{value:g}" if isinstance(value, float) else str(value)


#: Columns of the summary of compound faults: group of conditions, rate, head.
SUMMARY = (
    ("single", "named", "single: right"),
    ("compound", "named", "compound: names one of its faults"),
    ("compound", "as Normal", "compound: Normal"),
    ("Normal", "alarm", "alarms, Normal"),
    ("single", "alarm", "alarms, single"),
    ("compound", "alarm", "alarms, compound"),
    ("single", "confidence", "confidence, single"),
    ("compound", "confidence", "confidence, compound"),
)


def compound_table(frame):
    """Format the verdicts on known and unseen conditions, then those on each unseen one."""
    groups = {
        **dict.fromkeys(KNOWN[1:], "single"),
        **dict.fromkeys(COMPOUND, "compound"),
    }
    group = frame.condition.map(groups).fillna("Normal")
    text = frame.assign(crack=frame.crack_mm.map("{:g} mm".format))
    keys = ["tested at", "crack", "diagnoser"]
    columns = []
    for name, rate, head in SUMMARY:
        table = pivot(text[group == name].assign(head=head), keys, ["head"], rate)
        columns.append(table.set_index(keys))
    summary = pd.concat(columns, axis=1).replace("refused", "").reset_index()
    unseen = text[text.condition.isin(COMPOUND) & (text["tested at"] != "500 rpm")]
    unseen = unseen.dropna(subset="named")
    shares = [f"as {each}" for each in KNOWN]
    detail = unseen.groupby(["crack", "diagnoser", "condition"], sort=False)
    verdicts = detail[[*shares, "confidence", "AUC"]].mean().reset_index()
    for name in (*shares, "confidence"):
        verdicts[name] = verdicts[name].round().astype(int)
    return (
        f"{markdown(summary)}\n\nVerdicts on the unseen conditions at 300 to 450 rpm in %, mean "
        "over the draws; AUC: how often a window of the condition has less confidence than one of "
        f"the conditions that were calibrated.\n\n{markdown(verdicts, digits=2)}"
    )
