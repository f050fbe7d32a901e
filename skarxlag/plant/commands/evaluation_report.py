"""Results of `evaluate`: a summary in a few lines, and tables."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ...core.files import write_atomically
from ...model_selection.protocols import PROTOCOLS
from .results import csv_of

#: Columns of the printed table: share of right conditions, or of right locations where
#: the training had none of the conditions.
_NEW_BEARING = ("bearing", "bearing and speed")
#: Points by which another method has to be better to be named.
_LEAST_LEAD = 1.0

Result = tuple[Any, pd.DataFrame, pd.DataFrame]


def _shares(results):
    """Return the share of right verdicts of each method, in percent, one column a test."""
    columns = {}
    for case, _, summary in results:
        for protocol in summary.index.unique("protocol"):
            kind = "location" if protocol in _NEW_BEARING else "condition"
            of_methods = summary.xs(protocol, level="protocol")
            is_only = protocol == "speed" and case.part
            name = case.part if is_only else " ".join([PROTOCOLS[protocol], case.part])
            columns[name.strip()] = of_methods[kind]
    return pd.DataFrame(columns).loc[list(results[0][0].methods)]


def summary_text(results: list[Result], recommended: str) -> str:
    """Return the question, the data, one table, and the sentence that reads it.

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
    conditions = list(dict.fromkeys(case.y.tolist()))
    shares = _shares(results)
    table = shares.map(lambda share: "-" if np.isnan(share) else f"{share:.1f} %")
    rate = case.sampling_rate
    n_samples = case.X.shape[-1]
    lines = [
        _question(results),
        f"{case.title}: {len(conditions)} conditions at {speeds} rpm, trained at "
        f"{', '.join(f'{speed:g}' for speed in trained) or 'several'} rpm.",
        f"A row has {n_samples} samples, {1e3 * n_samples / rate:.4g} ms. Chance is "
        f"{100 / len(conditions):.1f} %.",
        "",
        table.rename_axis(None).to_string(),
        "",
        _advice(shares, recommended),
        *_error_rates(results, recommended),
        *dict.fromkeys(text for each, _, _ in results for text in each.sentences),
    ]
    return "\n".join(lines)


def _question(results):
    protocols = {name for *_, summary in results for name in summary.index.unique(0)}
    news = {
        "speed": "at a new speed",
        "bearing": "on a new bearing",
        "load": "under a new load",
    }
    asked = [news[name] for name in news if name in protocols]
    return f"How often is each method right {', or '.join(asked)}?"


def _advice(shares, recommended):
    """Return a sentence that says which method to take."""
    means = shares.mean(axis=1)
    best = means.idxmax()
    if means[best] <= means[recommended] + _LEAST_LEAD:
        return (
            f"Take {recommended}: it is right in {means[recommended]:.1f} % on average."
        )
    return (
        f"Here, {best} is right most often: in {means[best]:.1f} % on average, against "
        f"{means[recommended]:.1f} % for {recommended}."
    )


def _error_rates(results, recommended):
    """Yield the false alarms and the missed faults of a method in each protocol."""
    for case, _, summary in results:
        hours = case.X.shape[-1] / case.sampling_rate / 3600
        for protocol in summary.index.unique("protocol"):
            rates = summary.loc[(protocol, recommended), ["false alarms", "missed"]]
            if rates.isna().any():
                continue
            false, missed = rates
            test = ", ".join(filter(None, [PROTOCOLS[protocol], case.part]))
            yield (
                f"{test}: {recommended} calls {false:.1f} % of healthy rows faulty "
                f"({false / 100 / hours:.3g} an hour), and misses {missed:.1f} % of the "
                "rows of faults."
            )


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
        stem = _stem(case)
        tables = {"verdicts": verdicts.set_index("row"), "summary": summary}
        for name, matrix in _matrices(case, verdicts):
            tables[f"confusion_{_plain(name)}"] = matrix
        for name, table in tables.items():
            content = csv_of(table, index=True, float_format="%.6g").encode()
            write_atomically(folder / f"{stem}_{name}.csv", content)
    write_atomically(folder / "report.txt", (text + "\n").encode())
    return f"Tables are in {folder.resolve()}."


def _stem(case):
    return _plain(f"{Path(case.title).stem} {case.part}")


def _plain(name):
    """Return a name for a file, of lower-case letters, digits and underscores."""
    return re.sub(r"[^a-z0-9]+", "_", name.partition(",")[0].lower()).strip("_")


def _matrices(case, verdicts):
    """Return the confusion matrix of each method, in the first protocol."""
    conditions = list(dict.fromkeys(case.y.tolist()))
    shown = verdicts[verdicts["protocol"] == verdicts["protocol"].iloc[0]]
    for name, of_method in shown.groupby("estimator"):
        counts = pd.crosstab(of_method["true"], of_method["predicted"])
        yield name, counts.reindex(conditions, columns=conditions, fill_value=0)
