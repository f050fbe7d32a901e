"""False alarms and missed faults of detectors that were fitted on healthy rows alone.

First halves of the healthy recordings calibrate, second halves of all recordings are
tested. "Left out" calibrates at all speeds but the tested one, "one speed" at one speed
that is not tested, and "same" at all speeds.
"""

import warnings
from functools import partial

import numpy as np
from scipy.stats import kurtosis
from sklearn.ensemble import IsolationForest
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.svm import OneClassSVM

from benchmarks.cross_speed import SIMULATED
from benchmarks.peers import band_energies, unit_rms
from benchmarks.rigs import read_rigs, rows_of
from skarxlag import make_detector, make_known_conditions

RIGS = ("UESTC", "SpectraQuest", "self-built", "motor sound", *SIMULATED)
#: If the gain differs between recordings, the level contains no information.
FREE_GAIN = ("SpectraQuest", "self-built")
RATES = (0.01, 0.05)
LENGTHS = {"4800": 4800, "1 s": None}
SPLITS = ("left out", "one speed", "same")
_OTHER_ROWS = 20


def ours(X, rpm, *, fixed_gain=False):
    """Fit make_detector and return a function from rows and speeds to p-values."""
    detector = make_detector(fixed_gain=fixed_gain).fit(X, rpm=rpm)
    return lambda X, rpm: detector.p_values(X, rpm=rpm)


def features(X, fixed_gain):
    """Compute log energies of 32 bands and kurtosis, and the level if the gain is fixed."""
    columns = [band_energies(unit_rms(X)), kurtosis(X, axis=1)[:, np.newaxis]]
    if fixed_gain:
        columns.append(np.log(X.std(axis=1))[:, np.newaxis])
    return np.column_stack(columns)


def peer(X, rpm, *, make, fixed_gain=False):
    """Fit an outlier detector; a p-value is the share of healthy rows that score lower."""
    rows = features(X, fixed_gain)
    scorer = make_pipeline(StandardScaler(), make()).fit(rows)
    healthy = np.sort(scorer.score_samples(rows))

    def p_values(X, rpm):
        scores = scorer.score_samples(features(X, fixed_gain))
        return np.searchsorted(healthy, scores) / (len(healthy) + 1)

    return p_values


METHODS = {
    "make_detector": ours,
    "make_detector, fixed gain": partial(ours, fixed_gain=True),
    "one-class SVM": partial(peer, make=OneClassSVM),
    "isolation forest": partial(peer, make=lambda: IsolationForest(random_state=0)),
}


def splits(speeds, kind):
    """Yield the speeds that calibrate and those that are tested."""
    if kind == "same":
        yield speeds, speeds
        return
    for speed in speeds:
        others = speeds[speeds != speed]
        yield (others, [speed]) if kind == "left out" else ([speed], others)


def lines(home=None, rigs=RIGS, lengths=LENGTHS, methods=METHODS, kinds=SPLITS):
    """Yield how many rows of each condition and speed have p-values below the rates."""
    for rig in read_rigs(rigs, home):
        for length in lengths:
            # Half a recording of the simulated rig is shorter than a second.
            if rig.name in SIMULATED and length == "1 s":
                continue
            rows = rows_of(rig, LENGTHS[length] or int(rig.sampling_rate))
            is_healthy = rows.location == "healthy"
            for method in methods:
                if "fixed gain" in method and rig.name in FREE_GAIN:
                    continue
                # The peers cannot use the torque.
                if rig.name in SIMULATED and method != "make_detector":
                    continue
                for kind in kinds:
                    facts = {"rig": rig.name, "length": length, "method": method}
                    for speeds, tested in splits(np.unique(rows.rpm), kind):
                        at = np.isin(rows.rpm, speeds)
                        train = rows[is_healthy & ~rows.is_late & at]
                        p_values = _quietly(METHODS[method], train.X, train.rpm)
                        facts |= {"calibrated": kind}
                        facts |= {"at": " ".join(f"{each:g}" for each in speeds)}
                        for speed in tested:
                            late = rows[rows.is_late & (rows.rpm == speed)]
                            p = _quietly(p_values, late.X, late.rpm)
                            yield from _flagged(facts | {"rpm": speed}, late, p)


def _quietly(function, *arguments):
    with warnings.catch_warnings():
        # One speed and few rows are the subject of the tables.
        warnings.simplefilter("ignore", UserWarning)
        return function(*arguments)


def _flagged(facts, rows, p_values):
    for condition in np.unique(rows.condition):
        p = p_values[rows.condition == condition]
        counts = {f"below {rate:g}": int((p < rate).sum()) for rate in RATES}
        line = facts | {"condition": condition, "rows": len(p)} | counts
        yield line | {
            "mean log p": round(float(np.log(np.maximum(p, 1e-12)).mean()), 3)
        }


def unknown_lines(home=None, rigs=RIGS[:3], lengths=LENGTHS):
    """Yield how many rows of known and unknown conditions, and of other kinds, are rejected.

    Rows of one speed train. Each condition has its own limits, so leaving out a
    condition leaves out its p-value.
    """
    kept = list(read_rigs(rigs, home))
    for position, rig in enumerate(kept):
        for length in lengths:
            samples = LENGTHS[length] or int(rig.sampling_rate)
            rows = rows_of(rig, samples)
            other = rows_of(kept[position - 1], samples).X
            other = other[:: max(len(other) // _OTHER_ROWS, 1)][:_OTHER_ROWS]
            noise = np.random.default_rng(0).normal(size=(_OTHER_ROWS, samples))
            foreign = {"white noise": noise, "another rig": other}
            for speed in np.unique(rows.rpm):
                train = rows[~rows.is_late & (rows.rpm == speed)]
                known = _quietly(_known, train)
                for tested in ("same", "other"):
                    at = (rows.rpm == speed) == (tested == "same")
                    facts = {"rig": rig.name, "length": length}
                    facts |= {"trained at": speed, "tested at": tested}
                    late = rows[rows.is_late & at]
                    yield from _rejected(facts, known, late, foreign)


def _known(train):
    return make_known_conditions().fit(train.X, train.condition, rpm=train.rpm)


def _rejected(facts, known, rows, foreign):
    p_values = _quietly(partial(known.p_values, rpm=rows.rpm), rows.X)
    for column, condition in enumerate(known[-1].classes_):
        is_unknown = rows.condition == condition
        rest = np.delete(p_values, column, axis=1).max(axis=1)
        for name, p in (("known", rest[~is_unknown]), ("unknown", rest[is_unknown])):
            yield _counted(facts | {"rows of": name, "left out": condition}, p)
    for name, X in foreign.items():
        rpm = np.resize(np.unique(rows.rpm), len(X))
        p = _quietly(partial(known.p_values, rpm=rpm), X).max(axis=1)
        yield _counted(facts | {"rows of": name, "left out": ""}, p)


def _counted(facts, p):
    counts = {f"below {rate:g}": int((p < rate).sum()) for rate in RATES}
    return facts | {"rows": len(p)} | counts
