"""Measures of stated probabilities of locations, with intervals over specimens."""

import numpy as np
import pandas as pd
from sklearn.metrics import roc_auc_score

from benchmarks.recipe.calibration import expected_calibration_error
from skarxlag.core.fault_locations import FAULT_LOCATIONS

#: Probability from which on a verdict counts as stated, and the fewest such rows for a
#: share.
STATED = 0.9
FEWEST = 30
_LEAST = 1e-6
_RESAMPLES = 1000


def labelled(probability, rows, facts):
    """Return a table of location probabilities with the labels of the rows, for `table`."""
    part = pd.DataFrame(probability, columns=list(FAULT_LOCATIONS))
    return part.assign(location=rows.location, specimen=rows.specimen, **facts)


def measured(rows):
    """Measure the verdicts on the rows of one rig, protocol and method.

    Parameters
    ----------
    rows : DataFrame
        Columns ``location``, ``specimen`` and the probability of each of `FAULT_LOCATIONS`. What is
        missing to 1 is the probability of an unknown condition.

    Returns
    -------
    dict
        ``rows``; ``right``, the share of right locations, with an interval of 90 % over
        specimens; ``log loss``; ``error``, the expected calibration error; ``stated``,
        the share of rows stated with at least .9; ``of these``, how many of them are
        right, empty below 30 rows; and ``AUROC``, the mean over locations.
    """
    probability = rows[list(FAULT_LOCATIONS)].to_numpy()
    true = rows["location"].map(FAULT_LOCATIONS.index).to_numpy()
    stated = probability.max(axis=1)
    right = probability.argmax(axis=1) == true
    of_true = np.maximum(probability[np.arange(len(rows)), true], _LEAST)
    is_stated = stated >= STATED
    low, high = interval(right, rows["specimen"].to_numpy())
    return {
        "rows": len(rows),
        "right": f"{right.mean():.3f} ({low:.2f} to {high:.2f})",
        "log loss": -np.log(of_true).mean(),
        "error": expected_calibration_error(stated, right),
        "stated": is_stated.mean(),
        "of these": right[is_stated].mean() if is_stated.sum() >= FEWEST else np.nan,
        "AUROC": macro_auroc(probability, true),
    }


def interval(right, specimen):
    """Return the 5 % and 95 % quantiles of the share of right rows, by a bootstrap of specimens.

    Examples
    --------
    >>> interval(np.array([True, True, False, False]), np.array(["a", "a", "b", "b"]))
    (0.0, 1.0)
    """
    names, of_row = np.unique(specimen, return_inverse=True)
    hits = np.bincount(of_row, weights=right)
    counts = np.bincount(of_row)
    drawn = np.random.default_rng(0).integers(len(names), size=(_RESAMPLES, len(names)))
    shares = hits[drawn].sum(axis=1) / counts[drawn].sum(axis=1)
    low, high = np.quantile(shares, [0.05, 0.95])
    return float(low), float(high)


def macro_auroc(probability, true):
    """Return the mean area under the ROC curve of the locations that only some rows have.

    Examples
    --------
    >>> macro_auroc(np.array([[0.9, 0.1, 0, 0], [0.2, 0.8, 0, 0]]), np.array([0, 1]))
    1.0
    """
    areas = [
        roc_auc_score(true == location, probability[:, location])
        for location in np.unique(true)
        if (true != location).any()
    ]
    return float(np.mean(areas)) if areas else np.nan


def table(rows):
    """Return a row of measures for each rig, protocol and method."""
    groups = rows.groupby(["protocol", "rig", "method"], sort=False)
    return pd.DataFrame(
        dict(zip(groups.keys, key, strict=True)) | measured(group)
        for key, group in groups
    )
