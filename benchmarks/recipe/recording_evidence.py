"""How much do the windows of a recording count together? Choose their correlation.

Run ``python -m benchmarks.recipe recording-evidence`` from the root of the repository.

`make_diagnoser` is fitted on the first halves at one speed and asked for the second halves at all
others. Each correlation of `skarxlag.verdicts.effective_number` gives every recording a
probability. It is chosen by the log loss of all rigs and lengths of windows but one rig, and
reported for that rig.
"""

import warnings
from itertools import product

import numpy as np
import pandas as pd
from scipy.special import softmax

from benchmarks.cross_speed.protocol import first_and_second_half
from benchmarks.recipe.confidence import expected_calibration_error
from benchmarks.recipe.options import options, rigs
from skarxlag import make_diagnoser
from skarxlag.verdicts import SMALLEST_PROBABILITY

CORRELATIONS = (0.05, 0.07, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.7, 1.0)


def recording_logs(rig, window_length):
    """Mean log probabilities of the recordings at all ordered pairs of different speeds.

    Returns
    -------
    list of tuple
        Log probabilities of shape (n_conditions,), place of the true condition, number of windows.
    """
    first, second = first_and_second_half(rig.recording, rig.start, window_length)
    found = []
    for train_rpm in np.unique(rig.rpm):
        train, test = first & (rig.rpm == train_rpm), second & (rig.rpm != train_rpm)
        with warnings.catch_warnings(action="ignore"):
            diagnoser = make_diagnoser().fit(rig.data[train], rig.target[train], rpm=rig.rpm[train])
            probability = diagnoser.predict_proba(rig.data[test], rpm=rig.rpm[test])
        logs = np.log(np.maximum(probability, SMALLEST_PROBABILITY))
        for name in np.unique(rig.recording[test]):
            own = rig.recording[test] == name
            true = np.searchsorted(diagnoser.classes_, rig.target[test][own][0])
            found.append((logs[own].mean(axis=0), true, np.count_nonzero(own)))
    return found


def scored(recordings, correlation):
    """Probability of the verdict, whether it is right, and log loss of each recording."""
    rows = []
    for logs, true, n in recordings:
        p = softmax(n / (1 + (n - 1) * correlation) * logs)
        rows.append((p.max(), p.argmax() == true, -np.log(max(p[true], SMALLEST_PROBABILITY))))
    return np.array(rows, dtype=float).T


def chosen_correlation(recordings):
    """Correlation of the least log loss."""
    losses = [scored(recordings, each)[2].mean() for each in CORRELATIONS]
    return CORRELATIONS[int(np.argmin(losses))]


def table(by_rig):
    """Choice without each rig, and what it gives on that rig; then the choice on all of them."""
    rows, pooled = [], []
    for rig, recordings in by_rig.items():
        others = [r for other, rows in by_rig.items() if other != rig for r in rows]
        correlation = chosen_correlation(others)
        result = scored(recordings, correlation)
        pooled.append(result)
        rows.append((rig, correlation, *summary(result)))
    rows.append(("all, each left out", np.nan, *summary(np.concatenate(pooled, axis=1))))
    every = [r for rows in by_rig.values() for r in rows]
    correlation = chosen_correlation(every)
    rows.append(("all", correlation, *summary(scored(every, correlation))))
    names = ["rig", "correlation", "recordings", "accuracy", "mean probability", "error"]
    return pd.DataFrame(rows, columns=names)


def summary(result):
    probability, right, _ = result
    error = expected_calibration_error(probability, right.astype(bool))
    return len(right), right.mean(), probability.mean(), error


def main(arguments=None):
    chosen = options(__doc__, "recording-evidence", arguments)
    by_rig = {}
    for name, length in product(chosen.rig, (chosen.window_length, 4 * chosen.window_length)):
        chosen.rig, chosen.window_length, kept = [name], length, (chosen.rig, chosen.window_length)
        for label, rig in rigs(chosen):
            by_rig.setdefault(label, []).extend(recording_logs(rig, length))
        chosen.rig, chosen.window_length = kept
    print(table(by_rig).to_string(index=False, float_format="{:.3g}".format))
