"""Cells of tables that are computed in seconds: the canaries of the parts that name them.

A change of a residual shows before a verdict changes, so cells hold mean residuals next
to accuracies. Cells of a real rig need its recordings in ``$SKARXLAG_DATA``; without
them, the simulated rig alone is compared. Texts and pages are compared by a checksum.
The cells of benchmarks of a machine, `speed` and `soak`, show that its code runs.
"""

import os
import re
import tempfile
import warnings
import zlib
from functools import cache, partial
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.another_bearing.methods import fitted
from benchmarks.another_bearing.protocol import Rows
from benchmarks.cross_speed import reporting
from benchmarks.cross_speed.peers import BATCH, METHODS, PLAIN
from benchmarks.cross_speed.protocol import leave_one_speed_in
from benchmarks.fault_orders.runs import names_over_time
from benchmarks.monitoring.soak import soak as soaked
from benchmarks.pages.bearings import bearings_table
from benchmarks.pages.dot_tables import TABLES, read_table
from benchmarks.pages.formats import formats_table
from benchmarks.pages.modules import ROOT
from benchmarks.pages.parts import REPORT
from benchmarks.pages.pipeline_figure import shapes
from benchmarks.pages.recordings_figure import WAYS
from benchmarks.quality.__main__ import damaged_rows, good_rows
from benchmarks.quality.rigs import simulated_rig
from benchmarks.quality.treatments import DAMAGED, ORDINARY
from benchmarks.recipe.constants import score_rig
from benchmarks.recipe.rigs import simulated_rigs
from benchmarks.recordings import fetch_hit_sm
from benchmarks.speed.rows import transforms
from skarxlag import (
    FaultOrderClassifier,
    load_recordings,
    make_alpio,
    make_detector,
    make_diagnoser,
    make_extended_state_pio,
    read_recording_table,
)
from skarxlag.core.fault_locations import location_of_label
from skarxlag.datasets import simulate_rig
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
    train = first & (rig.rpm == train_rpm)
    test = second & (rig.rpm == test_rpm)
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


def baseline():
    """`make_alpio` on windows of the simulated rig."""
    return _cell(make_alpio, _simulated(), *SPEEDS)


def spectraquest():
    """`make_diagnoser` on windows of the SpectraQuest rig, if it is there."""
    home = os.environ.get("SKARXLAG_DATA")
    if home is None:
        return {}
    rig = fetch_hit_sm(window_length=4800, data_home=home)
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


def another_bearing():
    """Mean probability of the verdicts on half of the specimens of the simulated rig."""
    rig = simulate_rig(
        rpm=SPEEDS[0],
        crack_mm=(3, 6),
        conditions=CONDITIONS,
        n_samples=2 * SAMPLING_RATE,
        window_length=SAMPLING_RATE // 2,
    )
    location = np.array([location_of_label(name) for name in rig.target])
    specimen = np.char.add(location, rig.crack_mm.astype(str))
    rows = Rows(rig.data, specimen, location, specimen, rig.rpm, location)
    is_first, _ = first_and_second_half(rig.recording, rig.start, rig.data.shape[-1])
    train = rows[is_first]
    probabilities = fitted(rig, train, specimen=train.specimen)(
        rig.data[~is_first], SPEEDS[0]
    )
    return {"mean probability": float(probabilities.max(axis=1).mean())}


def detector():
    """`make_detector` on windows of the simulated rig: false alarms, detections, mean score."""
    rig = _simulated()
    is_healthy = rig.target == CONDITIONS[0]
    is_known = rig.rpm == SPEEDS[0]
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


def gathered_combs():
    """Mean probability of a monitor that gathers the combs of snapshots of noise."""
    snapshots = np.random.default_rng(0).normal(size=(30, 2560))
    verdicts = names_over_time(snapshots, 10.0 * np.arange(30), 1800.0, 25_600.0)
    return {"mean probability": float(np.mean([each.probability for each in verdicts]))}


def constants():
    """Accuracy and calibration of one setting of the constants, on the simulated rig."""
    rig = next(simulated_rigs())
    grid = ((4,), (256,), (0.4,), (0.5,))
    accuracies, calibrations = score_rig(rig, ["windows of 4800"], grid, _silent)
    return {
        "accuracy": float(np.mean([row["right"] for row in accuracies])),
        "calibration error": float(np.mean([row["error"] for row in calibrations])),
    }


def _silent(text):
    """Print no progress."""


def quality():
    """Shares of good and of damaged rows of a simulated bearing that are refused."""
    rig = simulated_rig(2)
    ordinary = {name: way for group in ORDINARY.values() for name, way in group.items()}
    rows = {
        "good": good_rows(rig, {0.5: 4}, ordinary),
        "damaged": damaged_rows(rig, {0.5: 4}, DAMAGED),
    }
    return {
        name: float(np.mean([row["quality"] != "good" for row in of_kind]))
        for name, of_kind in rows.items()
    }


def kept_windows():
    """Starts of the windows, and the power of a resampled recording, of noise."""
    with tempfile.TemporaryDirectory() as folder:
        noise = np.random.default_rng(0).normal(size=9000)
        np.save(Path(folder, "noise.npy"), noise)
        starts = {
            name: load_recordings(
                folder, window_length=1200, sampling_rate=25_600, **way
            ).start
            for name, way in WAYS.items()
        }
        table = read_recording_table(folder, sampling_rate=25_600, resample=51_200)
        power = float(np.var(table.recordings[0]))
    means = {name: float(np.mean(positions)) for name, positions in starts.items()}
    return means | {"power of the resampled recording": power}


def bearings():
    """Checksum of the table of bearings."""
    return _checksum(bearings_table())


def formats():
    """Checksum of the table of formats."""
    return _checksum(formats_table())


def diagram():
    """Checksum of the ensemble that the diagram shows, as text."""
    # It needs Pillow, which no other cell does.
    from benchmarks.pages.diagram_image import ensemble

    # A function is shown with its address.
    return _checksum(re.sub(" at 0x[0-9a-f]+", "", repr(ensemble())))


def pipeline():
    """Checksum of the shapes of the arrays between the steps."""
    return _checksum(str(shapes()))


def dots():
    """Checksum of what the dot plots show of the tables."""
    return _checksum("".join(read_table(name).to_csv() for name in TABLES))


def report():
    """Checksum of the page that the report fills, without white space."""
    return _checksum("".join((ROOT / REPORT).read_text("utf-8").split()))


def _checksum(text):
    return {"checksum": float(zlib.crc32(text.encode()))}


def speed():
    """The benchmark of computing time runs."""
    return {"runs": float(len(transforms(n_rounds=1, n_windows=8)) > 0)}


def soak():
    """The benchmark of a monitor's memory runs."""
    return {"runs": float(len(soaked(400, n_steps=2)) == 3)}
