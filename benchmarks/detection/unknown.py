"""None of these: conditions that were never seen, at the training speed and at others.

Run ``python -m benchmarks.detection unknown`` from the root of the repository. One detector for
each condition; a row whose largest p-value over the conditions is below the rate is none of them.
Each condition is left out in turn. First halves calibrate, second halves are tested.
"""

import warnings

import numpy as np
import pandas as pd
from sklearn.metrics import roc_auc_score

from benchmarks.cross_speed.protocol import first_and_second_half
from benchmarks.detection.rigs import WINDOW, find_rig
from benchmarks.pages.blocks import markdown, page_parser, publish
from skarxlag import make_detector

RATES = (0.01, 0.05)
RIGS = ("uestc", "hit_sm")
SPLITS = {
    "training speed": "rows of one speed, tested at it",
    "other speeds": "rows of one speed, tested at every other",
    "left out": "rows of all other speeds, tested at the one left out",
}


def splits(speeds):
    """Speeds that calibrate and speeds that are tested, by the kind of the split."""
    for speed in speeds:
        others = speeds[speeds != speed]
        yield "training speed", np.array([speed]), np.array([speed])
        yield "other speeds", np.array([speed]), others
        yield "left out", others, np.array([speed])


def p_values(rig, train, test, rate):
    """p-values of the tested rows for each condition, (n_rows, n_conditions)."""
    found = []
    for condition in rig.target_names:
        own = train & (rig.target == condition)
        detector = make_detector(false_alarm_rate=rate).fit(rig.data[own], rpm=rig.rpm[own])
        found.append(detector.p_values(rig.data[test], rpm=rig.rpm[test]))
    return np.stack(found, axis=1)


def rejection_rates(rig, row_length):
    """One row for each rate, split and condition that is left out."""
    first, second = first_and_second_half(rig.recording, rig.start, row_length)
    rows = []
    for rate in RATES:
        for split, known, tested in splits(np.unique(rig.rpm)):
            test = second & np.isin(rig.rpm, tested)
            with warnings.catch_warnings():
                # One speed, few rows: that is what the table is about.
                warnings.simplefilter("ignore", UserWarning)
                found = p_values(rig, first & np.isin(rig.rpm, known), test, rate)
            target = rig.target[test]
            for place, condition in enumerate(rig.target_names):
                nearest = np.delete(found, place, axis=1).max(axis=1)
                unknown = target == condition
                rows.append(
                    {
                        "stated": rate,
                        "split": split,
                        "left out": condition,
                        "known rejected": float(np.mean(nearest[~unknown] < rate)),
                        "unknown rejected": float(np.mean(nearest[unknown] < rate)),
                        "auc": roc_auc_score(~unknown, nearest),
                    }
                )
    return pd.DataFrame(rows)


def table(rates):
    """Markdown: known and unknown rows that are rejected, in %."""
    lines = []
    for (rig, split), group in rates.groupby(["rig", "split"], sort=False):
        line = {"rig": rig, "calibrated and tested": SPLITS[split]}
        means = group.groupby("stated")[["known rejected", "unknown rejected"]].mean() * 100
        for name in means:
            line[f"{name}, %"] = "/".join(f"{value:.0f}" for value in means[name])
        missed = group[group["stated"] == RATES[0]].groupby("left out")["unknown rejected"].mean()
        line["hardest to tell"] = f"{missed.idxmin()} ({100 * missed.min():.0f} %)"
        line["AUC"] = group["auc"].mean()
        lines.append(line)
    return (
        "Made by `python -m benchmarks.detection unknown`. Rows of 4800 samples; stated rates of "
        "rejection 1 % / 5 %; each condition left out in turn, means over conditions and speeds."
        f"\n\n{markdown(pd.DataFrame(lines))}"
    )


def main(arguments=None):
    parser = page_parser(__doc__, "detection-unknown")
    parser.add_argument("--rig", nargs="+", default=list(RIGS), help=f"of {list(RIGS)}")
    parser.add_argument("--data-home", help="folder of the downloaded rigs")
    chosen = parser.parse_args(arguments)
    chosen.output.mkdir(parents=True, exist_ok=True)
    found = [
        rejection_rates(find_rig(name)(WINDOW, data_home=chosen.data_home), WINDOW).assign(rig=name)
        for name in chosen.rig
    ]
    rates = pd.concat(found)
    rates.to_csv(chosen.output / "unknown.csv", index=False)
    publish(chosen, {"unknown": table(rates)})
