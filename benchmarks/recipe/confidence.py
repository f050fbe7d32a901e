"""Do stated confidences hold, at the training speed and at the others?

Run ``python -m benchmarks.recipe confidence`` from the root of the repository.
First halves calibrate and second halves are scored, as in `benchmarks.cross_speed`.
"""

from itertools import pairwise

import numpy as np
import pandas as pd
from scipy.optimize import minimize_scalar
from scipy.special import log_softmax

from benchmarks.cross_speed.protocol import (
    GROUP_SIZE,
    SMALLEST_PROBABILITY,
    check_rig,
    consecutive_groups,
    first_and_second_half,
)
from benchmarks.pages.blocks import markdown, publish
from benchmarks.recipe.options import options, rigs
from skarxlag import make_diagnoser

N_BLOCKS = 4
BINS = np.array([0.0, 0.5, 0.7, 0.9, 0.95, 0.99, 1.0])
KINDS = ["window", f"{GROUP_SIZE} windows, sum", f"{GROUP_SIZE} windows, mean"]


def expected_calibration_error(confidence, correct, n_bins=10):
    """Mean distance of confidence and accuracy over equal bins, weighted by their verdicts.

    Naeini, Cooper and Hauskrecht (2015), AAAI, 2901-2907.

    Parameters
    ----------
    confidence : array of shape (n_verdicts,)
        Stated probability of the verdict, in [0, 1].
    correct : array of bool of shape (n_verdicts,)
    n_bins : int, default=10

    Returns
    -------
    error : float

    Examples
    --------
    >>> expected_calibration_error(np.array([0.9, 0.9, 0.6]), np.array([True, True, False]))
    0.267
    """
    where = np.minimum((np.asarray(confidence) * n_bins).astype(int), n_bins - 1)
    excess = np.bincount(where, weights=np.asarray(confidence) - np.asarray(correct, dtype=float))
    return round(float(np.abs(excess).sum() / len(where)), 3)


def held_out_scale(X, y, recording, start):
    """Confidence scale from windows that the references were not fitted on.

    Each recording is cut into four blocks in time; each block is scored by a diagnoser that was
    fitted on the other three.
    """
    block = np.empty(len(y), dtype=int)
    for name in np.unique(recording):
        rows = np.flatnonzero(recording == name)
        for number, part in enumerate(np.array_split(rows[np.argsort(start[rows])], N_BLOCKS)):
            block[part] = number
    scores, targets = [], []
    for number in range(N_BLOCKS):
        diagnoser = make_diagnoser().fit(X[block != number], y[block != number])
        scores.append(scores_of(diagnoser, X[block == number]))
        targets.append(np.searchsorted(diagnoser.classes_, y[block == number]))
    return scale_of_least_log_loss(np.concatenate(scores), np.concatenate(targets))


def scale_of_least_log_loss(scores, target):
    """Factor on the scores under which their softmax gives the targets the highest likelihood.

    Without the smoothing of `confidence_scale_`: where no score errs it ends at the bound.
    """
    rows = np.arange(len(target))

    def loss(log_factor):
        return -np.mean(log_softmax(np.exp(log_factor) * scores, axis=1)[rows, target])

    return float(np.exp(minimize_scalar(loss, bounds=(-10, 10), method="bounded").x))


def scores_of(diagnoser, X):
    """Scores of all conditions, with any constant for each window, in nepers of the residual."""
    log_probability = np.log(np.maximum(diagnoser.predict_proba(X), np.finfo(float).tiny))
    return log_probability / diagnoser["decide"].confidence_scale_


def stated(log_probability, target, recording, start):
    """Confidence, correctness and log probability of the truth, of windows and of groups.

    The logarithms of ten consecutive windows are added up, which takes the windows for
    independent, or averaged, which takes them for one window seen ten times.
    """
    floored = np.maximum(log_probability, np.log(SMALLEST_PROBABILITY))
    groups = consecutive_groups(recording, start)
    evidence = dict.fromkeys(KINDS)
    evidence[KINDS[0]] = floored, target
    evidence[KINDS[1]] = floored[groups].sum(axis=1), target[groups[:, 0]]
    evidence[KINDS[2]] = floored[groups].mean(axis=1), target[groups[:, 0]]
    for kind, (logs, truth) in evidence.items():
        logs = log_softmax(logs, axis=1)
        yield pd.DataFrame(
            {
                "verdict": kind,
                "confidence": np.exp(logs.max(axis=1)),
                "correct": logs.argmax(axis=1) == truth,
                "log_probability": logs[np.arange(len(truth)), truth],
            }
        )


def all_verdicts(rig, window_length):
    """Every verdict of `make_diagnoser` at every pair of speeds, with two confidence scales."""
    check_rig(rig, window_length)
    first, second = first_and_second_half(rig.recording, rig.start, window_length)
    frames = []
    for train_rpm in np.unique(rig.rpm):
        train = first & (rig.rpm == train_rpm)
        fitted = rig.data[train], rig.target[train]
        diagnoser = make_diagnoser().fit(*fitted)
        scales = {
            "training windows": diagnoser["decide"].confidence_scale_,
            "held-out blocks": held_out_scale(*fitted, rig.recording[train], rig.start[train]),
        }
        for test_rpm in np.unique(rig.rpm):
            test = second & (rig.rpm == test_rpm)
            scores = scores_of(diagnoser, rig.data[test])
            target = np.searchsorted(diagnoser.classes_, rig.target[test])
            for name, scale in scales.items():
                logs = log_softmax(scale * scores, axis=1)
                for frame in stated(logs, target, rig.recording[test], rig.start[test]):
                    frames.append(
                        frame.assign(
                            scale=name,
                            factor=scale,
                            speed="same" if train_rpm == test_rpm else "other",
                        )
                    )
    return pd.concat(frames, ignore_index=True)


def calibration_table(verdicts):
    """Accuracy, mean confidence, expected calibration error and log loss of each kind."""
    rows = []
    keys = ["rig", "speed", "verdict", "scale"]
    for key, group in verdicts.groupby(keys, sort=False):
        rows.append(
            {
                **dict(zip(keys, key, strict=True)),
                "factor": group.factor.mean(),
                "accuracy": group.correct.mean(),
                "mean confidence": group.confidence.mean(),
                "calibration error": expected_calibration_error(group.confidence, group.correct),
                "log loss": -group.log_probability.mean(),
            }
        )
    return pd.DataFrame(rows)


def reliability_table(verdicts):
    """Share of the verdicts in each bin of confidence and how many of them are right."""
    windows = verdicts[(verdicts.verdict == KINDS[0]) & (verdicts.scale == "training windows")]
    labels = [f"{low:g} to {high:g}" for low, high in pairwise(BINS)]
    where = np.digitize(windows.confidence, BINS[1:-1], right=False)
    rows = []
    for (rig, speed), group in windows.assign(bin=where).groupby(["rig", "speed"], sort=False):
        for number, verdict in group.groupby("bin"):
            rows.append(
                {
                    "rig": rig,
                    "speed": speed,
                    "confidence": labels[number],
                    "share of verdicts": len(verdict) / len(group),
                    "mean confidence": verdict.confidence.mean(),
                    "accuracy": verdict.correct.mean(),
                }
            )
    return pd.DataFrame(rows)


def wide_calibration(calibration):
    """A row for each rig, speed and scale, columns for windows and for groups."""
    index = ["rig", "speed", "scale"]
    measures = {
        "accuracy": "accuracy",
        "mean confidence": "confidence",
        "calibration error": "error",
        "log loss": "log loss",
    }
    kinds = {}
    for verdict, rows in calibration.groupby("verdict", sort=False):
        names = {old: f"{verdict}: {new}" for old, new in measures.items()}
        kinds[verdict] = rows.set_index(index)[list(measures)].rename(columns=names)
    return pd.concat(kinds.values(), axis=1).reset_index()


def wide_reliability(reliability):
    """A row for each bin, a column for each rig and speed: accuracy (share of the verdicts)."""
    cells = [
        f"{row.accuracy:.3f} ({row.share:.3f})"
        for row in reliability.rename(columns={"share of verdicts": "share"}).itertuples()
    ]
    heads = reliability.rig + ", " + reliability.speed + " speed"
    heads = heads.str.replace("other speed", "other speeds")
    frame = pd.DataFrame({"confidence": reliability.confidence, "head": heads, "cell": cells})
    wide = frame.pivot(index="confidence", columns="head", values="cell")
    return wide.reindex(columns=heads.unique()).fillna("").reset_index()


def report(calibration, reliability):
    """Markdown of the two tables of confidence."""
    return (
        "`make_diagnoser`, second halves, all "
        "training speeds pooled. Confidence: its mean. Error: mean distance of stated confidence "
        "and accuracy over ten equal bins. Groups of ten consecutive windows by the sum and by the "
        "mean of their log-probabilities. Scale: `confidence_scale_`, fitted on the training "
        "windows with smoothed targets, or the factor of least log loss on blocks of the training "
        "half which the references were not fitted on.\n\n"
        f"**Calibration**\n\n{markdown(wide_calibration(calibration))}\n\n"
        "Accuracy of single windows by stated confidence, and in brackets the share of windows, "
        "with the factor as the package has it.\n\n"
        f"**Reliability**\n\n{markdown(wide_reliability(reliability))}"
    )


def main(arguments=None):
    chosen = options(__doc__, "confidence", arguments)
    chosen.output.mkdir(parents=True, exist_ok=True)
    verdicts = []
    for label, rig in rigs(chosen):
        verdicts.append(all_verdicts(rig, chosen.window_length).assign(rig=label))
    verdicts = pd.concat(verdicts)
    calibration, reliability = calibration_table(verdicts), reliability_table(verdicts)
    for name, frame in {"calibration": calibration, "reliability": reliability}.items():
        frame.to_csv(chosen.output / f"{name}.csv", index=False)
    publish(chosen, {"confidence": report(calibration, reliability)})
