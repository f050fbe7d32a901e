"""Tables of accuracy in percent, from predictions on windows.

The predictions are a DataFrame with one row for each test window and the columns
``diagnoser``, ``train_rpm``, ``test_rpm``, ``recording``, ``start``, ``true`` and
``predicted``; a rig with cracks adds ``crack_mm``.
"""

from typing import Any

import numpy as np
import pandas as pd
from sklearn.metrics import confusion_matrix


def speed_accuracy(verdicts: pd.DataFrame) -> pd.DataFrame:
    """Compute the accuracy for each pair of speeds.

    Parameters
    ----------
    verdicts : DataFrame
        Of one diagnoser.

    Returns
    -------
    DataFrame
        Percent of windows with the right condition; rows are training speeds, columns
        test speeds, both ascending.
    """
    right = 100.0 * (verdicts["true"] == verdicts["predicted"])
    return (
        right.groupby([verdicts["train_rpm"], verdicts["test_rpm"]])
        .mean()
        .unstack("test_rpm")
    )


def speed_summary(accuracy: pd.DataFrame) -> dict[str, Any]:
    """Summarize a table of speed pairs.

    Parameters
    ----------
    accuracy : DataFrame
        As `speed_accuracy` returns it.

    Returns
    -------
    dict
        ``mean_other_speed`` over ordered pairs of different speeds; ``worst_pair``, the
        smallest of them; ``mean_same_speed``. NaN if there is no such pair.

    Examples
    --------
    >>> accuracy = pd.DataFrame([[99.0, 80.0], [90.0, 97.0]], index=[300.0, 500.0],
    ...                         columns=[300.0, 500.0])
    >>> speed_summary(accuracy)["mean_other_speed"], speed_summary(accuracy)["worst_pair"]
    (85.0, 80.0)
    """
    is_same = np.equal.outer(accuracy.index, accuracy.columns)
    other_speed = pd.Series(accuracy.to_numpy()[~is_same])
    same_speed = pd.Series(accuracy.to_numpy()[is_same])
    return {
        "mean_other_speed": float(other_speed.mean()),
        "worst_pair": float(other_speed.min()),
        "mean_same_speed": float(same_speed.mean()),
    }


def confusion_table(verdicts: pd.DataFrame, conditions: list[str]) -> pd.DataFrame:
    """Compute a confusion matrix with margins, as Tables 6 and 7 of Piltan and Kim (2019).

    Rows are true conditions, so the right margin is the recall and the lower one the
    precision; the paper transposes them.

    Parameters
    ----------
    verdicts : DataFrame
        See above.
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
