"""Confusion matrices with margins, as Tables 6 and 7 of Piltan and Kim (2019)."""

import numpy as np
import pandas as pd
from sklearn.metrics import confusion_matrix


def confusion_table(verdicts: pd.DataFrame, conditions: list[str]) -> pd.DataFrame:
    """Compute a confusion matrix with margins.

    Rows are true conditions, so the right margin is the recall and the lower one the
    precision; the paper transposes them.

    Parameters
    ----------
    verdicts : DataFrame
        With the columns ``true`` and ``predicted``.
    conditions : list of str
        Rows and columns, in this order.

    Returns
    -------
    DataFrame
        Counts; the last column "recall %", the last row "precision %", and in their
        corner the accuracy. Precision is NaN for a condition that was never predicted.

    Examples
    --------
    >>> verdicts = pd.DataFrame({"true": ["a", "a", "b"], "predicted": ["a", "b", "b"]})
    >>> confusion_table(verdicts, ["a", "b"])
    predicted       a     b  recall %
    true
    a             1.0   1.0  50.00...
    b             0.0   1.0  100.00...
    precision % 100.0  50.0  66.66...
    """
    counts = confusion_matrix(
        verdicts["true"], verdicts["predicted"], labels=conditions
    )
    table = pd.DataFrame(counts.astype(float), index=conditions, columns=conditions)
    return confusion_margins(table.rename_axis(index="true", columns="predicted"))


def confusion_margins(counts: pd.DataFrame) -> pd.DataFrame:
    """Add recall and precision to counts, as in `confusion_table`.

    Parameters
    ----------
    counts : DataFrame
        Rows are true conditions, columns predictions, in the same order.

    Returns
    -------
    DataFrame
        See `confusion_table`.
    """
    right = np.diag(counts)
    with np.errstate(invalid="ignore"):
        recall = 100 * right / counts.sum(axis=1).to_numpy()
        precision = 100 * right / counts.sum(axis=0).to_numpy()
    table = counts.copy()
    table["recall %"] = recall
    table.loc["precision %"] = [*precision, 100 * right.sum() / counts.to_numpy().sum()]
    return table
