"""Detectors of the benchmark: ours, and outlier detectors on common features.

Each is a function from a rate of false alarms, healthy rows and their speeds to a
function that scores rows at speeds; below 0 is an alarm.
"""

import warnings

import numpy as np
from scipy.stats import kurtosis
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.svm import OneClassSVM

from benchmarks.cross_speed.peers import band_energies, unit_rms
from skarxlag import make_detector

RANDOM_STATE = 0


def ours(rate, X, rpm, *, fixed_gain):
    with warnings.catch_warnings():
        # One speed, few rows: that is what the tables are about.
        warnings.simplefilter("ignore", UserWarning)
        detector = make_detector(false_alarm_rate=rate, fixed_gain=fixed_gain).fit(
            X, rpm=rpm
        )

    def score(X, rpm):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            return detector.decision_function(X, rpm=rpm)

    return score


def features(X, *, fixed_gain):
    """Log energies of 32 bands and kurtosis; the level where the gain is fixed."""
    y = X[:, 0] if X.ndim == 3 else X
    columns = [band_energies(unit_rms(y)), kurtosis(y, axis=1)[:, None]]
    if fixed_gain:
        columns.append(np.log(y.std(axis=1))[:, None])
    return np.column_stack(columns)


def peer(rate, X, rpm, *, fixed_gain, make):
    """Peer with the order statistic of its scores that supports the rate as its threshold."""
    rows = features(X, fixed_gain=fixed_gain)
    score = make(rows)
    scores = np.sort(score(rows))
    # Rank floor((n + 1) rate) from below, the lowest at least.
    threshold = scores[max(int(np.floor((len(scores) + 1) * rate + 1e-9)), 1) - 1]
    return lambda X, rpm: score(features(X, fixed_gain=fixed_gain)) - threshold


def one_class_svm(rows):
    return make_pipeline(StandardScaler(), OneClassSVM()).fit(rows).score_samples


def isolation_forest(rows):
    from pyod.models.iforest import IForest

    fitted = IForest(random_state=RANDOM_STATE).fit(rows)
    return lambda rows: -fitted.decision_function(rows)


def ecod(rows):
    from pyod.models.ecod import ECOD

    fitted = ECOD().fit(rows)
    return lambda rows: -fitted.decision_function(rows)


PEERS = {
    "isolation forest (pyod)": isolation_forest,
    "one-class SVM": one_class_svm,
    "ECOD (pyod)": ecod,
}
