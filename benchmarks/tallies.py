"""Counts of verdicts, one line for each method, rig and pair of training and test.

A line has the columns of `COUNTS`. Sums of lines are lines, so the tables of the pages
are sums of stored lines, and any line can be computed again by itself.
"""

import numpy as np
import pandas as pd

#: Probability from which on a verdict counts as stated.
STATED = 0.9
#: Rows; right verdicts; sum of the probabilities of the verdicts; stated verdicts, and
#: how many of them are right. The last three are missing if there is no probability.
COUNTS = ("rows", "right", "confidence", "stated", "stated right")
_N_DRAWS = 1000


def tally(verdict, truth, confidence=None):
    """Count the verdicts on some rows.

    Examples
    --------
    >>> tally(np.array(["a", "b"]), np.array(["a", "a"]), np.array([0.95, 0.5]))
    {'rows': 2, 'right': 1, 'confidence': 1.45, 'stated': 1, 'stated right': 1}
    """
    right = np.asarray(verdict) == np.asarray(truth)
    counts = {"rows": len(right), "right": int(right.sum())}
    if confidence is None:
        return counts
    is_stated = np.asarray(confidence) >= STATED
    return counts | {
        "confidence": round(float(np.sum(confidence)), 3),
        "stated": int(is_stated.sum()),
        "stated right": int((right & is_stated).sum()),
    }


def tally_probability(probability, classes, truth):
    """Count the most probable classes."""
    verdict = np.asarray(classes)[probability.argmax(axis=1)]
    return tally(verdict, truth, probability.max(axis=1))


def shares(lines, by):
    """Return the share of right verdicts of each group of lines: the mean over the lines."""
    right = (lines["right"] / lines["rows"]).rename("right")
    return right.groupby([lines[name] for name in by], sort=False).mean()


def calibration(lines, by):
    """Return what was stated in each group of lines, beside what was right.

    Returns
    -------
    DataFrame
        ``right`` and ``stated on average``, the share of right verdicts and the mean
        probability; ``stated >= .9`` and ``of these right``.
    """
    total = lines.groupby(list(by), sort=False)[list(COUNTS)].sum()
    table = pd.DataFrame(
        {
            "right": total["right"] / total["rows"],
            "stated on average": total["confidence"] / total["rows"],
            "stated >= .9": total["stated"] / total["rows"],
            "of these right": total["stated right"] / total["stated"],
        }
    )
    return table.reset_index()


def bootstrap(values):
    """Return the limits of 90 % of 1000 means of values drawn with replacement.

    Examples
    --------
    >>> bootstrap([0.5, 0.5])
    '.500 to .500'
    """
    values = np.asarray(values, dtype=float)
    drawn = np.random.default_rng(0).integers(len(values), size=(_N_DRAWS, len(values)))
    limits = np.quantile(values[drawn].mean(axis=1), [0.05, 0.95])
    return " to ".join(f"{limit:.3f}".removeprefix("0") for limit in limits)


def by_rig(lines, rigs):
    """Return the table of methods: mean of rigs, its interval, worst rig, worst pair, rigs.

    Parameters
    ----------
    lines : DataFrame
        Lines with the columns ``method``, ``rig`` and those of `COUNTS`.
    rigs : sequence of str
        The rigs that count.

    Returns
    -------
    DataFrame
        Methods that have all rigs, in descending order of the mean.
    """
    lines = lines[lines["rig"].isin(rigs)]
    table = shares(lines, ["method", "rig"]).unstack("rig")
    # A mean over some of the rigs is not comparable.
    table = table[[rig for rig in rigs if rig in table]].dropna()
    pairs = lines["right"] / lines["rows"]
    summary = pd.DataFrame(
        {
            "mean": table.mean(axis=1),
            "90 % interval": [bootstrap(row) for row in table.to_numpy()],
            "worst rig": table.min(axis=1),
            "worst pair": pairs.groupby(lines["method"]).min(),
        },
        index=table.index,
    )
    joined = summary.join(table).sort_values("mean", ascending=False)
    return joined.reset_index()
