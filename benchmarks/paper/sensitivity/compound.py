"""Compound faults that are not in the calibration: verdicts, alarms and confidence."""

import numpy as np
import pandas as pd
from sklearn.metrics import roc_auc_score
from sklearn.pipeline import make_pipeline

from benchmarks.paper.sensitivity.protocol import (
    CRACKS,
    DIAGNOSERS,
    FRESH,
    HEALTHY,
    TRAIN_RPM,
    calibrated,
    percentage,
    rows_of,
    standard_rig,
)
from skarxlag import ARXLaguerre, PIObserver, ThresholdLadder

KNOWN = (HEALTHY, "IR", "OR", "Ball")
COMPOUND = ("IR-Ball", "OR-Ball", "IR-OR", "IR-OR-Ball")
SPEEDS = {"500 rpm": np.equal, "300 to 450 rpm": np.not_equal}


def compound(seeds, n_samples):
    """Calibrated on normal windows and single faults at 500 rpm, scored on all conditions.

    The scored recordings are not in the calibration, since the emission of a defect is
    the same realisation in single and in compound recordings. One row for each draw,
    crack size, diagnoser, speed and condition, in %: share of each verdict, of verdicts
    that name one of the condition's faults, of windows over the detection threshold,
    mean confidence; and the share of pairs of a window of this and one of a known
    condition in which the former has less confidence. The detector, on normal windows
    alone and in the sensor's unit, has alarms only.
    """
    rows = []
    for seed in seeds:
        rig, fresh = (standard_rig(each, n_samples) for each in (seed, seed + FRESH))
        # The level alone, as in the paper: a ladder with the healthy rung only.
        detector = make_pipeline(
            ARXLaguerre(unit_rms=False), PIObserver(), ThresholdLadder()
        )
        healthy = rows_of(rig, None, conditions=[HEALTHY], rpm=TRAIN_RPM)
        detector.fit(rig.data[healthy], rig.target[healthy])
        for crack_mm in CRACKS:
            kept = rows_of(fresh, crack_mm)
            X = fresh.data[kept]
            target = fresh.target[kept]
            rpm = fresh.rpm[kept]
            scored = {
                name: _verdicts(
                    calibrated(make(healthy=HEALTHY), rig, crack_mm, conditions=KNOWN),
                    X,
                )
                for name, make in DIAGNOSERS.items()
            }
            scored["Detector"] = {
                "alarm": detector[-1].detect(detector[:-1].transform(X))
            }
            for name, verdicts in scored.items():
                for speeds, compare in SPEEDS.items():
                    at = compare(rpm, TRAIN_RPM)
                    for condition in KNOWN + COMPOUND:
                        case = {
                            "seed": seed,
                            "crack_mm": crack_mm,
                            "diagnoser": name,
                            "tested at": speeds,
                            "condition": condition,
                        }
                        rows.append(case | _rates(verdicts, target, condition, at))
    return pd.DataFrame(rows)


def _verdicts(diagnoser, X):
    """Return the verdicts of one diagnoser on each window."""
    residuals = diagnoser[:-1].transform(X)
    ladder = diagnoser[-1]
    return {
        "verdict": ladder.predict(residuals),
        "alarm": ladder.detect(residuals),
        "confidence": ladder.predict_proba(residuals).max(axis=1),
    }


def _rates(verdicts, target, condition, at):
    """Rates of one condition over the windows that `at` selects."""
    rows = at & (target == condition)
    rates = {"alarm": percentage(verdicts["alarm"][rows])}
    if "verdict" in verdicts:
        verdict = verdicts["verdict"][rows]
        confidence = verdicts["confidence"]
        rates |= {f"as {each}": percentage(verdict == each) for each in KNOWN}
        rates["named"] = percentage(np.isin(verdict, condition.split("-")))
        rates["confidence"] = percentage(confidence[rows])
        if condition in COMPOUND:
            is_trained = at & np.isin(target, KNOWN)
            rates["AUC"] = roc_auc_score(
                rows[rows | is_trained], -confidence[rows | is_trained]
            )
    return rates
