"""Tables that others have printed, on the same splits, as far as the recordings are here.

``python -m benchmarks.published`` prints what is the same and what differs. The splits
and grades are files in ``$SKARXLAG_PUBLISHED``, or in the folder ``published`` beside
that of the rigs:

- Bearing-wise splits of CWRU and Paderborn of J. P. Vieira et al. (arXiv:2509.22267),
  rebuilt from their public files. The measure is the macro AUROC over rows of a second.
- Combinations of Paderborn's bearings of Lessmeier et al. (2016), tables 10 and 11. The
  measure is the share of right recordings.
- Tasks between the settings of Paderborn of the benchmark UDTL (Zhao et al. 2021). The
  classes are bearings, and the measure is the share of right rows of 1024 samples.
- Grades of the CWRU recordings of Smith and Randall (2015), and the fault that
  predictive-maintenance-mcp 0.13 ranks first.

The folder of the rigs has CWRU's sensor beside the fault only, and nine bearings of
Paderborn. Runs without a left-out inner and outer race are left out.
"""

import csv
import json
import os
import re
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from sklearn.ensemble import RandomForestClassifier
from sklearn.metrics import roc_auc_score
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer

from benchmarks.another_bearing import LOCATIONS, by_location
from benchmarks.detection import features
from benchmarks.fault_orders import ours as orders_of_bearing
from benchmarks.peers import log_spectrum, of_features, shrinkage_lda
from benchmarks.rigs import read_rigs, rows_of
from skarxlag import make_diagnoser

CWRU = "CWRU, bearing-wise splits"
PADERBORN = "Paderborn, bearing-wise splits"
LESSMEIER = "Paderborn, combinations of bearings"
UDTL = "Paderborn, tasks between settings"
GRADES = "CWRU drive end, grades Y1 and Y2"
#: Runs of each table that are computed, evenly spread over all. A run of the first two
#: takes about half a minute.
MOST_RUNS = {CWRU: 5, PADERBORN: 5, LESSMEIER: 5, UDTL: 4}


class Printed(NamedTuple):
    """A table of others: its figures, the best as a share, and how ours differs."""

    figures: str
    best: float
    same: str
    differs: str


PRINTED = {
    CWRU: Printed(
        "macro AUROC: random forest .855, SVM .760",
        0.855,
        "splits by bearing, rows of 1 s, three locations, measure",
        "one sensor of two, without the fan end at 1797 rpm",
    ),
    PADERBORN: Printed(
        "macro AUROC: random forest .697, SVM .644",
        0.697,
        "splits by bearing, rows of 1 s, two locations, measure",
        "9 of 17 bearings, one recording of 20 for each setting",
    ),
    LESSMEIER: Printed(
        "random forest 98.3 %, SVM 75.8 % of recordings",
        0.983,
        "combinations of bearings, one setting, three classes",
        "9 of 15 bearings: one or two of a class train, not three; one recording of 20",
    ),
    UDTL: Printed(
        "40.5 to 46.5 % without adaptation, 59.3 % with the best",
        0.593,
        "12 tasks, rows of 1024 samples, classes are bearings",
        "5 of 13 bearings, so there are fewer classes to confuse",
    ),
    GRADES: Printed(
        "predictive-maintenance-mcp 0.13 ranks the fault first in 34 of 44",
        34 / 44,
        "recordings, bearing and speed; no recorded fault",
        "36 of 60 recordings, outer race in one position",
    ),
}
_FAULTS = {"IR": "inner", "OR": "outer", "B": "ball"}
_RPM = {"0": 1797.0, "1": 1772.0, "2": 1750.0, "3": 1730.0}
_WINDOW = 1024
#: Bearings of UDTL with damage from accelerated life tests.
_UDTL_BEARINGS = (
    *("KA04", "KA15", "KA16", "KA22", "KA30", "KB23", "KB24", "KB27"),
    *("KI14", "KI16", "KI17", "KI18", "KI21"),
)


def folder(home=None):
    """Return the folder of splits and grades."""
    beside = Path(home or os.environ.get("SKARXLAG_DATA", ".")).resolve().parent
    return Path(os.environ.get("SKARXLAG_PUBLISHED", beside / "published"))


def diagnoser(train, tests, rate, bearing, *, with_bearing=True):
    """Return location probabilities of make_diagnoser."""
    fitted = make_diagnoser(
        sampling_rate=rate, bearing=bearing if with_bearing else None
    )
    names = np.char.add(np.char.add(train.condition, " "), train.specimen)
    fitted.fit(train.X, names, rpm=train.rpm, specimen=train.specimen)
    location = dict(zip(names, train.location, strict=True))
    of_class = np.array([location[name] for name in fitted.classes_])
    logs = fitted.diagnose(tests.X, rpm=tests.rpm).log_probability
    return by_location(np.exp(logs[:, :-1]), of_class)


def forest(train, tests, rate, bearing):
    """Return location probabilities of a random forest of band energies and kurtosis."""
    columns = FunctionTransformer(lambda X: features(X, fixed_gain=False))
    fitted = make_pipeline(columns, RandomForestClassifier(random_state=0))
    fitted.fit(train.X, train.location)
    return by_location(fitted.predict_proba(tests.X), fitted.classes_)


METHODS = {
    "make_diagnoser with the bearing": diagnoser,
    "make_diagnoser": partial(diagnoser, with_bearing=False),
    "random forest": forest,
}
#: Classifiers of rows of 1024 samples. Ours receives the speed.
WINDOW_PEERS = {
    "log spectrum + shrinkage LDA": lambda: of_features(log_spectrum, shrinkage_lda()),
    "random forest": lambda: of_features(
        log_spectrum, RandomForestClassifier(random_state=0)
    ),
}


def auroc(probability, location, locations):
    """Return the mean area under the ROC curve of some locations.

    Examples
    --------
    >>> auroc(np.array([[0, 0, .9, .1], [0, 0, .2, .8]]), np.array(["inner", "outer"]),
    ...       ("inner", "outer"))
    1.0
    """
    columns = [list(LOCATIONS).index(name) for name in locations]
    areas = [
        roc_auc_score(location == name, probability[:, column])
        for name, column in zip(locations, columns, strict=True)
        if 0 < (location == name).sum() < len(location)
    ]
    return round(float(np.mean(areas)), 4)


def cwru_lines(home, most_runs):
    """Yield the AUROC of each method and run: one model for each sensor and its bearing."""
    splits = json.loads((folder(home) / "cwru_bearing_splits.json").read_text("utf-8"))
    rigs = {
        rig.name.split()[1][0].upper() + "E": rig
        for rig in read_rigs(["CWRU drive end", "CWRU fan end"], home)
    }
    rows = {end: rows_of(rig, int(rig.sampling_rate)) for end, rig in rigs.items()}
    for split in spread(splits, most_runs) if rigs else ():
        for method, judge in METHODS.items():
            probability = []
            location = []
            for end, rig in rigs.items():
                train, test = (
                    _of_waveforms(rows[end], split[part], end)
                    for part in ("train", "test")
                )
                if train.any() and test.any():
                    tested = rows[end][test]
                    trained = rows[end][train]
                    found = judge(trained, tested, rig.sampling_rate, rig.bearing)
                    probability.append(found)
                    location.append(tested.location)
            location = np.concatenate(location)
            area = auroc(np.concatenate(probability), location, _FAULTS.values())
            run = f"{split['run']} {split['train_side']}"
            facts = {"table": CWRU, "method": method, "run": run}
            yield facts | {"rows": len(location), "AUROC": area}


def _of_waveforms(rows, names, end):
    """Select the rows of waveforms of the sensor beside the fault.

    A name is such as B_21_FE_FE_12_3HP: fault, size, place of the fault, of the sensor.
    """
    chosen = np.zeros(len(rows.X), dtype=bool)
    for name in names:
        fault, size, place, sensor, _, load = name.split("_")
        if place == sensor == end:
            condition = f"{_FAULTS[fault.partition('@')[0]]}{int(size):03}"
            chosen |= (rows.condition == condition) & (rows.rpm == _RPM[load[0]])
    return chosen


def spread(runs, most):
    """Return at most so many runs, evenly spread.

    Examples
    --------
    >>> spread([1, 2, 3, 4, 5], 3)
    [1, 3, 5]
    """
    chosen = np.linspace(0, len(runs) - 1, min(most, len(runs))).astype(int)
    return [runs[number] for number in chosen]


def paderborn_lines(home, most_runs):
    """Yield the AUROC of each method and run, trained on all settings of other bearings."""
    text = (folder(home) / "paderborn_bearing_splits.json").read_text("utf-8")
    for rig in read_rigs(["Paderborn"], home):
        rows = rows_of(rig, int(rig.sampling_rate))
        runs = [
            (run, is_test)
            for run, bearings in json.loads(text)["test_bearings_by_run"].items()
            if {"inner", "outer"}
            <= set(rows.location[is_test := np.isin(rows.specimen, bearings)])
        ]
        for run, is_test in spread(runs, most_runs):
            train, tests = rows[~is_test], rows[is_test]
            for method, judge in METHODS.items():
                found = judge(train, tests, rig.sampling_rate, rig.bearing)
                area = auroc(found, tests.location, ("inner", "outer"))
                facts = {"table": PADERBORN, "method": method, "run": run}
                yield facts | {"rows": len(tests.X), "AUROC": area}


def lessmeier_lines(home, most_runs):
    """Yield the right recordings of each method and combination, at setting 0."""
    text = (folder(home) / "lessmeier_combinations.json").read_text("utf-8")
    for rig in read_rigs(["Paderborn"], home):
        rows = rows_of(rig, int(rig.sampling_rate))
        rows = rows[(rows.rpm == 1500) & (rows.load == "0.7 Nm, 1000 N")]
        combinations = [
            (str(each["combination"]), is_train, is_test)
            for each in json.loads(text)
            if (is_test := np.isin(rows.specimen, each["test"])).any()
            and (is_train := np.isin(rows.specimen, each["train"])).any()
        ]
        for run, is_train, is_test in spread(combinations, most_runs):
            train, tests = rows[is_train], rows[is_test]
            for method, judge in METHODS.items():
                found = judge(train, tests, rig.sampling_rate, rig.bearing)
                evidence = np.log(np.maximum(found, 1e-12))
                bearings = np.unique(tests.specimen)
                right = 0
                for bearing in bearings:
                    here = tests.specimen == bearing
                    verdict = LOCATIONS[evidence[here].sum(axis=0).argmax()]
                    right += int(verdict == tests.location[here][0])
                facts = {"table": LESSMEIER, "method": method, "run": run}
                yield facts | {"rows": len(bearings), "right": right}


def udtl_lines(home, most_runs):
    """Yield the right rows of each method and task, from one setting to another."""
    for rig in read_rigs(["Paderborn"], home):
        rows = rows_of(rig, _WINDOW)
        rows = rows[np.isin(rows.specimen, _UDTL_BEARINGS)]
        settings = np.char.add(rows.rpm.astype(int).astype(str), " rpm, ")
        settings = np.char.add(settings, rows.load)
        names = np.unique(settings)
        for source in spread(list(names), most_runs):
            train = rows[settings == source]
            fitted = {
                "make_diagnoser": make_diagnoser().fit(
                    train.X, train.specimen, rpm=train.rpm
                )
            }
            for method, make in WINDOW_PEERS.items():
                fitted[method] = make().fit(train.X, train.specimen)
            for target in names[names != source]:
                tests = rows[settings == target]
                for method, classifier in fitted.items():
                    speed = {} if method in WINDOW_PEERS else {"rpm": tests.rpm}
                    verdict = classifier.predict(tests.X, **speed)
                    facts = {"table": UDTL, "method": method}
                    facts |= {"run": f"{source} to {target}", "rows": len(verdict)}
                    yield facts | {"right": int((verdict == tests.specimen).sum())}


def grade_lines(home, most_runs):
    """Yield what each method names on the graded recordings."""
    text = (folder(home) / "cwru_grades.csv").read_text("utf-8")
    graded = {
        (_FAULTS[row["fault"].partition("@")[0]], row["size_mil"], row["load_hp"]): row
        for row in csv.DictReader(text.splitlines())
        if row["fault"] in ("IR", "B", "OR@6") and row["grade"] in ("Y1", "Y2")
    }
    loads = {rpm: load for load, rpm in _RPM.items()}
    for rig in read_rigs(["CWRU drive end"], home):
        for recording in rig.recordings:
            fault, size = re.match(r"([a-z]+)0*(\d+)", recording.condition).groups()
            row = graded.get((fault, size, loads[recording.rpm]))
            if row is None or (most_runs == 1 and loads[recording.rpm] != "0"):
                continue
            facts = {"table": GRADES, "run": row["file"]}
            theirs = row["ranked_first_by_pm_mcp_0_13"]
            line = {"method": "predictive-maintenance-mcp 0.13", "first": theirs}
            yield facts | line | {"rows": 1, "right": int(theirs == fault)}
            rows = recording.samples[np.newaxis]
            logs, named, _ = orders_of_bearing(
                rows, recording.rpm, rig.sampling_rate, rig.bearing
            )
            first = ("ball", "inner", "outer")[int(logs.argmax())]
            line = {"method": "make_fault_order_classifier", "first": first}
            line |= {"named": named[0], "rows": 1, "right": int(named[0] == fault)}
            yield facts | line


LINES = {
    CWRU: cwru_lines,
    PADERBORN: paderborn_lines,
    LESSMEIER: lessmeier_lines,
    UDTL: udtl_lines,
}


def lines(home=None, most_runs=None):
    """Yield the lines of all tables whose splits and recordings are here.

    Parameters
    ----------
    home : path or None
        Folder of the rigs.
    most_runs : int or None
        Runs of each table, at most. None: those of `MOST_RUNS`.
    """
    if folder(home).is_dir():
        yield from grade_lines(home, most_runs)
        for table, lines_of in LINES.items():
            most = MOST_RUNS[table]
            yield from lines_of(home, min(most_runs or most, most))


if __name__ == "__main__":
    from benchmarks.tables import main

    main(["published"])
