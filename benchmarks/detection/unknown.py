"""None of these: conditions that were not trained, and rows without a signal of the machine.

Run ``python -m benchmarks.detection unknown`` from the root of the repository. Known
conditions are calibrated on first halves of recordings; rows of second halves are
tested, and rejected where the p-value of the nearest condition is below the stated
rate. Each condition is left out in turn. With all conditions known, rows of other kinds
are tested: noise, a sine, a ramp, another rig's sensor.
"""

import warnings

import numpy as np
import pandas as pd
from sklearn.metrics import roc_auc_score

from benchmarks.cross_speed.protocol import first_and_second_half
from benchmarks.detection.rigs import find_rig, row_lengths
from benchmarks.pages.blocks import markdown, page_parser, publish
from skarxlag import make_known_conditions

RATES = (0.01, 0.05)
RIGS = ("UESTC", "SpectraQuest", "self-built")
#: Rows of each other kind.
N_OTHER = 20
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


def fitted(rig, train, rate):
    """Known conditions of a rig."""
    with warnings.catch_warnings():
        # One speed, few rows: that is what the tables are about.
        warnings.simplefilter("ignore", UserWarning)
        estimator = make_known_conditions(false_rejection_rate=rate)
        return estimator.fit(rig.data[train], rig.target[train], rpm=rig.rpm[train])


def rejection_rates(rig, row_length, foreign):
    """Two tables: of known and unknown conditions, and of rows of other kinds.

    Each condition has separate limits, so its p-values are left out with it.
    """
    first, second = first_and_second_half(rig.recording, rig.start, row_length)
    others = other_kinds(row_length, foreign)
    rates = []
    kinds = []
    for rate in RATES:
        for split, speeds, tested in splits(np.unique(rig.rpm)):
            estimator = fitted(rig, first & np.isin(rig.rpm, speeds), rate)
            here = {"stated": rate, "split": split}
            test = second & np.isin(rig.rpm, tested)
            p_values = estimator.p_values(rig.data[test], rpm=rig.rpm[test])
            for column, condition in enumerate(estimator[-1].classes_):
                unknown = rig.target[test] == condition
                rest = np.delete(p_values, column, axis=1).max(axis=1)
                rates.append(
                    here
                    | {
                        "left out": condition,
                        "known rejected": float(np.mean(rest[~unknown] < rate)),
                        "unknown rejected": float(np.mean(rest[unknown] < rate)),
                        "auc": roc_auc_score(~unknown, rest),
                    }
                )
            for kind, X in others.items():
                nearest = [
                    estimator.p_values(X, rpm=speed).max(axis=1) for speed in tested
                ]
                share = float(np.mean(np.array(nearest) < rate))
                kinds.append(here | {"kind": kind, "rejected": share})
    return pd.DataFrame(rates), pd.DataFrame(kinds)


def other_kinds(row_length, foreign):
    """Rows that are no signal of the machine, by kind."""
    rng = np.random.default_rng(0)
    time = np.arange(row_length) + row_length * np.arange(N_OTHER)[:, np.newaxis]
    return {
        "white noise": rng.normal(size=(N_OTHER, row_length)),
        "sine": np.sin(0.3 * time),
        "ramp": time / time.max(),
        "other rig": foreign[np.linspace(0, len(foreign) - 1, N_OTHER).astype(int)],
    }


def table(rates):
    """Markdown: known and unknown rows that are rejected, in %."""
    lines = []
    for (rig, length, split), group in rates.groupby(
        ["rig", "row", "split"], sort=False
    ):
        line = {"rig": rig, "row": length, "calibrated and tested": SPLITS[split]}
        means = (
            group.groupby("stated")[["known rejected", "unknown rejected"]].mean() * 100
        )
        for name in means:
            line[f"{name}, %"] = "/".join(f"{value:.0f}" for value in means[name])
        missed = (
            group[group["stated"] == RATES[0]]
            .groupby("left out")["unknown rejected"]
            .mean()
        )
        line["hardest to tell"] = f"{missed.idxmin()} ({100 * missed.min():.0f} %)"
        line["AUC"] = group["auc"].mean()
        lines.append(line)
    return (
        "Stated rates of rejection 1 % / 5 %; "
        "each condition left out in turn, means over conditions and speeds. The model of the "
        "signal is of all conditions, also of the one that is left out."
        f"\n\n{markdown(pd.DataFrame(lines))}"
    )


def kinds_table(kinds):
    """Markdown: rows of other kinds that are rejected, in %."""
    lines = []
    for (rig, length, split), group in kinds.groupby(
        ["rig", "row", "split"], sort=False
    ):
        line = {"rig": rig, "row": length, "calibrated and tested": SPLITS[split]}
        for kind, of_kind in group.groupby("kind", sort=False):
            means = 100 * of_kind.groupby("stated")["rejected"].mean()
            line[f"{kind}, %"] = "/".join(f"{value:.0f}" for value in means)
        lines.append(line)
    return (
        "Rows that are no signal of the machine, rejected at stated rates of 1 % / 5 %; all "
        "conditions are known. *Other rig*: rows of the next rig."
        f"\n\n{markdown(pd.DataFrame(lines))}"
    )


def main(arguments=None):
    parser = page_parser(__doc__, "detection-unknown")
    parser.add_argument("--data-home", help="folder of the downloaded rigs")
    parser.add_argument("--rows", nargs="+", default=["1200", "4800", "1 s"])
    chosen = parser.parse_args(arguments)
    chosen.output.mkdir(parents=True, exist_ok=True)
    rates = []
    kinds = []
    for name, other in zip(RIGS, RIGS[1:] + RIGS[:1], strict=True):
        for label, length in ({"1200": 1200} | row_lengths(name)).items():
            if label not in chosen.rows:
                continue
            rig, foreign = (
                find_rig(n)(length, data_home=chosen.data_home) for n in (name, other)
            )
            here = {"rig": name, "row": label}
            tables = rejection_rates(rig, length, foreign.data)
            rates.append(tables[0].assign(**here))
            kinds.append(tables[1].assign(**here))
            pd.concat(rates).to_csv(chosen.output / "unknown.csv", index=False)
            pd.concat(kinds).to_csv(chosen.output / "other_kinds.csv", index=False)
    publish(
        chosen,
        {
            "unknown": table(pd.concat(rates)),
            "other kinds": kinds_table(pd.concat(kinds)),
        },
    )
