"""Results of `evaluate`: a summary in a few lines, and tables."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ...core.files import write_atomically
from ...model_selection.protocols import PROTOCOLS
from .results import csv_of

#: Printed columns, in percent of rows.
_COLUMNS = ["condition", "location", "recordings", "false alarms", "missed"]

#: Points by which another method has to be better to be named.
_LEAST_LEAD = 1.0

Result = tuple[Any, pd.DataFrame, pd.DataFrame]


def summary_text(results: list[Result], recommended: str) -> str:
    """Return the data, a table for each protocol, and what its figures mean.

    Parameters
    ----------
    results : list of (Case, DataFrame, DataFrame)
        Cases with their verdicts and summaries.
    recommended : str
        Name of the recommended method.
    """
    case = results[0][0]
    speeds = ", ".join(f"{speed:g}" for speed in np.unique(case.facts["rpm"]))
    trained = sorted({split.train_rpm for split in case.splits if split.train_rpm > 0})
    n_conditions = len(set(case.y.tolist()))
    seconds = case.X.shape[-1] / case.sampling_rate
    lines = [
        f"{case.title}: {n_conditions} conditions at {speeds} rpm, trained at "
        f"{', '.join(f'{speed:g}' for speed in trained) or 'several'} rpm.",
        f"A row has {case.X.shape[-1]} samples, {1e3 * seconds:.4g} ms, so 1 % of false "
        f"alarms are {36 / seconds:.3g} an hour. Chance is {100 / n_conditions:.1f} %.",
        "Percent of rows with the right condition and the right location, of recordings "
        "with the right location, of healthy rows called faulty, and of faults missed:",
    ]
    best = []
    for each, _, summary in results:
        for protocol in summary.index.unique("protocol"):
            table = summary.loc[protocol].reindex(columns=_COLUMNS)
            title = ", ".join(filter(None, [PROTOCOLS[protocol], each.part]))
            table = table.loc[list(each.methods)].rename_axis(None)
            lines += [
                "",
                title,
                table.to_string(float_format="{:.1f}".format, na_rep="-"),
            ]
            best.append(table["location"])
    means = pd.concat(best, axis=1).mean(axis=1)
    if means.max() > means[recommended] + _LEAST_LEAD:
        lines += ["", f"Here, {means.idxmax()} is right more often than {recommended}."]
    lines += [
        "",
        *dict.fromkeys(text for each, _, _ in results for text in each.sentences),
    ]
    return "\n".join(lines)


def save_results(results: list[Result], text: str, folder: Path) -> str:
    """Write verdicts, summaries and matrices of all cases, and return a sentence on them.

    Parameters
    ----------
    results, text
        As in `summary_text`, and what it returned.
    folder : Path
        Folder of the results.
    """
    for case, verdicts, summary in results:
        tables = {"verdicts": verdicts.set_index("row"), "summary": summary}
        conditions = list(dict.fromkeys(case.y.tolist()))
        shown = verdicts[verdicts["protocol"] == verdicts["protocol"].iloc[0]]
        for name, of_method in shown.groupby("estimator"):
            counts = pd.crosstab(of_method["true"], of_method["predicted"])
            tables[f"confusion_{_plain(name)}"] = counts.reindex(
                conditions, columns=conditions, fill_value=0
            )
        stem = _plain(f"{Path(case.title).stem} {case.part}")
        for name, table in tables.items():
            content = csv_of(table, index=True, float_format="%.6g").encode()
            write_atomically(folder / f"{stem}_{name}.csv", content)
    write_atomically(folder / "report.txt", (text + "\n").encode())
    return f"Tables are in {folder.resolve()}."


def _plain(name):
    """Return a name for a file, of lower-case letters, digits and underscores."""
    return re.sub(r"[^a-z0-9]+", "_", name.partition(",")[0].lower()).strip("_")
