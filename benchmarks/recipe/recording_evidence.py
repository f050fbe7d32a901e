"""Choose how much the rows of a recording count together, by their correlation.

Run ``python -m benchmarks.recipe recording-evidence`` from the root of the repository;
the folder of the rigs is ``$SKARXLAG_DATA``.

`make_diagnoser` is fitted on the first halves at one speed, or at all speeds but one,
and predicts the second halves at the others. Each correlation of
`skarxlag.kernels.evidence.effective_number` gives every recording a probability. Only
real rigs choose: the correlation is the one with the least expected calibration error
on all rigs and kinds of rows but one rig, and it is reported for that rig.
"""

import os
import warnings

import numpy as np
import pandas as pd
from scipy.special import softmax

from benchmarks.pages.blocks import markdown, page_parser, publish
from benchmarks.recipe.calibration import expected_calibration_error
from benchmarks.recipe.rigs import real_rigs
from benchmarks.recipe.targets import ROWS, folds, rows_of
from skarxlag import make_diagnoser
from skarxlag.kernels.evidence import SMALLEST_PROBABILITY, effective_number

CORRELATIONS = (0.05, 0.07, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.7, 1.0)


def recording_logs(rig, kind):
    """Compute mean log probabilities of the recordings at speeds that were not fitted at.

    Parameters
    ----------
    rig : Rig
        As `real_rigs` yields it.
    kind : str
        A name in `ROWS`.

    Returns
    -------
    list of tuple
        Log probabilities of shape (n_conditions,), place of the true condition, number
        of rows.
    """
    length = ROWS[kind] or int(rig.sampling_rate)
    sampling_rate = rig.sampling_rate if ROWS[kind] is None else None
    found = []
    for _, trained, tested in folds(rig):
        X, y, rpm = rows_of(rig, length, 0, trained)
        with warnings.catch_warnings(action="ignore"):
            diagnoser = make_diagnoser(sampling_rate=sampling_rate).fit(X, y, rpm=rpm)
        for recording in rig.recordings:
            if recording.rpm not in tested:
                continue
            one = rig._replace(recordings=[recording])
            X, y, rpm = rows_of(one, length, 1, tested)
            with warnings.catch_warnings(action="ignore"):
                probability = diagnoser.predict_proba(X, rpm=rpm)
            logs = np.log(np.maximum(probability, SMALLEST_PROBABILITY))
            true = np.searchsorted(diagnoser.classes_, recording.condition)
            found.append((logs.mean(axis=0), true, len(X)))
    return found


def scored(recordings, correlation):
    """Probability of the verdict, and whether it is right, for each recording."""
    logs, true, n = (np.array(each) for each in zip(*recordings, strict=True))
    probability = softmax(
        effective_number(n, correlation)[:, np.newaxis] * logs, axis=1
    )
    return probability.max(axis=1), probability.argmax(axis=1) == true


def chosen_correlation(by_rig):
    """Correlation of the least calibration error over the recordings of all rigs."""
    errors = [
        expected_calibration_error(*_pooled(by_rig, each)) for each in CORRELATIONS
    ]
    return CORRELATIONS[int(np.argmin(errors))]


def _pooled(by_rig, correlation):
    # Rigs differ in their number of conditions.
    every = zip(*(scored(each, correlation) for each in by_rig.values()), strict=True)
    return tuple(map(np.concatenate, every))


def table(by_rig):
    """Tabulate the choice without each rig and its score on that rig; then the choice of all."""
    rows, pooled = [], []
    for rig, recordings in by_rig.items():
        correlation = chosen_correlation({k: v for k, v in by_rig.items() if k != rig})
        result = scored(recordings, correlation)
        pooled.append(result)
        rows.append((rig, correlation, *summary(*result)))
    left_out = map(np.concatenate, zip(*pooled, strict=True))
    rows.append(("all, each left out", np.nan, *summary(*left_out)))
    correlation = chosen_correlation(by_rig)
    rows.append(("all", correlation, *summary(*_pooled(by_rig, correlation))))
    names = [
        "rig",
        "correlation",
        "recordings",
        "accuracy",
        "mean probability",
        "error",
    ]
    return pd.DataFrame(rows, columns=names)


def summary(probability, right):
    """Number of recordings, accuracy, mean probability and calibration error."""
    error = expected_calibration_error(probability, right)
    return len(right), right.mean(), probability.mean(), error


def main(arguments=None):
    """Run the command."""
    parser = page_parser(__doc__, "recording-evidence")
    parser.add_argument("--data-home", default=os.environ.get("SKARXLAG_DATA"))
    options = parser.parse_args(arguments)
    by_rig = {
        rig.name: [each for kind in ROWS for each in recording_logs(rig, kind)]
        for rig in real_rigs(home=options.data_home)
    }
    text = (
        f"{len(CORRELATIONS)} correlations were scored. Recordings: second halves at the speeds "
        "that were not fitted at, with rows of 1200 samples, 4800 samples and 1 s. Training and "
        "test share the specimen and its mounting. The correlation in a row is the choice of the "
        "other rigs; the last row has the choice of all. Error: expected calibration error, 10 "
        "bins."
    )
    publish(options, {"recording evidence": f"{text}\n\n{markdown(table(by_rig))}"})
