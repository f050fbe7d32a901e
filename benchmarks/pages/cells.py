"""Cells of tables that are computed in seconds: the canaries of the parts that name them.

A change of a residual shows before a verdict changes, so cells hold mean residuals next
to accuracies. Cells of a real rig need its recordings in ``$SKARXLAG_DATA``; without
them, the simulated rig alone is compared.
"""

import os
import warnings
from functools import cache, partial

import numpy as np
import pandas as pd

from benchmarks.cross_speed import reporting
from benchmarks.cross_speed.peers import BATCH, METHODS, PLAIN
from benchmarks.cross_speed.protocol import leave_one_speed_in
from skarxlag import (
    FaultOrderClassifier,
    make_alpio,
    make_detector,
    make_diagnoser,
    make_extended_state_pio,
)
from skarxlag.datasets import fetch_hit_sm, simulate_rig
from skarxlag.model_selection import first_and_second_half

SPEEDS = (300, 500)
SAMPLING_RATE = 250_000
CONDITIONS = ["Normal", "IR", "OR", "Ball"]


@cache
def _simulated(window_length=1200, n_windows=40):
    return simulate_rig(
        rpm=SPEEDS,
        crack_mm=3,
        conditions=CONDITIONS,
        n_samples=n_windows * window_length,
        window_length=window_length,
    )


def _cell(make, rig, train_rpm, test_rpm, **speeds):
    """Accuracy and mean log residual of one pair of speeds."""
    first, second = first_and_second_half(rig.recording, rig.start, rig.data.shape[-1])
    train, test = first & (rig.rpm == train_rpm), second & (rig.rpm == test_rpm)
    fit_speeds = {name: train_rpm for name in speeds}
    diagnoser = make().fit(rig.data[train], rig.target[train], **fit_speeds)
    X = rig.data[test]
    residuals = diagnoser.diagnose(X, **speeds).levels
    return {
        "accuracy": float(np.mean(diagnoser.predict(X, **speeds) == rig.target[test])),
        "mean log residual": float(np.log(residuals).mean()),
    }


def windows():
    """`make_diagnoser` on windows of the simulated rig."""
    return _cell(make_diagnoser, _simulated(), *SPEEDS)


def cross_speed():
    """Mean accuracy of plain peers over the pairs of speeds of the simulated rig."""
    frames = []
    for method in (*PLAIN, *BATCH):
        pairs = list(leave_one_speed_in(METHODS[method], _simulated(), 1200))
        key = {"rig": "simulated", "window_length": 1200, "method": method}
        frames.append(reporting.pair_frame(pairs).assign(**key))
    summary = reporting.summarise(pd.concat(frames)).query("verdict == 'window'")
    return summary.set_index("method")["mean"].to_dict()


def proposal():
    """`make_extended_state_pio` on windows of the simulated rig."""
    return _cell(make_extended_state_pio, _simulated(), *SPEEDS)


def proposal_in_stretches():
    """`make_extended_state_pio` on long windows of the simulated rig, where sums are large."""
    return _cell(
        make_extended_state_pio, _simulated(SAMPLING_RATE // 2, n_windows=4), *SPEEDS
    )


def baseline():
    """`make_alpio` on windows of the simulated rig."""
    return _cell(make_alpio, _simulated(), *SPEEDS)


def spectraquest():
    """`make_diagnoser` on windows of the SpectraQuest rig, if it is there."""
    home = os.environ.get("SKARXLAG_DATA")
    if home is None:
        return {}
    rig = fetch_hit_sm(window_length=4800, data_home=home, download_if_missing=False)
    return _cell(make_diagnoser, rig, 600, 1200)


def stretches():
    """`make_diagnoser` on stretches of half a second of the simulated rig."""
    rig = _simulated(SAMPLING_RATE // 2, n_windows=4)
    make = partial(make_diagnoser, sampling_rate=SAMPLING_RATE)
    return _cell(make, rig, *SPEEDS, rpm=SPEEDS[1])


def probabilities():
    """Mean probability of the verdicts of `make_diagnoser`, on stretches of the simulated rig."""
    rig = _simulated(SAMPLING_RATE // 2, n_windows=4)
    is_known = rig.rpm == SPEEDS[0]
    diagnoser = make_diagnoser(sampling_rate=SAMPLING_RATE)
    diagnoser.fit(rig.data[is_known], rig.target[is_known], rpm=SPEEDS[0])
    probability = diagnoser.predict_proba(rig.data[~is_known], rpm=SPEEDS[1])
    return {"mean": float(probability.max(axis=1).mean())}


def detector():
    """`make_detector` on windows of the simulated rig: false alarms, detections, mean score."""
    rig = _simulated()
    is_healthy, is_known = rig.target == CONDITIONS[0], rig.rpm == SPEEDS[0]
    detector = make_detector(false_alarm_rate=0.1)
    with warnings.catch_warnings(action="ignore"):
        # One speed of training, and a test speed far from it, are meant here.
        detector.fit(rig.data[is_healthy & is_known], rpm=SPEEDS[0])
        scores = detector.decision_function(rig.data[~is_known], rpm=SPEEDS[1])
    is_healthy = is_healthy[~is_known]
    return {
        "false alarms": float(np.mean(scores[is_healthy] < 0)),
        "detections": float(np.mean(scores[~is_healthy] < 0)),
        "mean score": float(scores.mean()),
    }


def fault_orders():
    """`FaultOrderClassifier` without training on stretches of the simulated rig."""
    rig = _simulated(SAMPLING_RATE // 2, n_windows=4)
    X = rig.data[:, 0]
    classifier = FaultOrderClassifier(bearing="6205", sampling_rate=SAMPLING_RATE).fit(
        X
    )
    probability = classifier.predict_proba(X, rpm=rig.rpm)
    return {"mean probability": float(probability.max(axis=1).mean())}
