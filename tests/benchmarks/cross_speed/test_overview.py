"""Means over rigs, their intervals, and the differences from peers."""

import numpy as np
import pandas as pd
import pytest

from benchmarks.cross_speed.intervals import mean_draws, rig_draws
from benchmarks.cross_speed.overview import differences, overview
from benchmarks.cross_speed.peers import BATCH, LEFT_OUT
from benchmarks.recipe.left_out import choices, diagnoser_without

(BATCHED,) = BATCH
OURS = {("r", "make_diagnoser"): 0.5, ("s", "make_diagnoser"): 0.7}


def results(accuracies):
    """Return summary and recordings of methods with these accuracies, by rig and method."""
    summary = []
    recordings = []
    for (rig, method), accuracy in accuracies.items():
        key = {"rig": rig, "window_length": 4, "method": method}
        scores = {"verdict": "window", "mean": accuracy, "worst": accuracy / 2}
        counts = {"windows": 100, "right": round(100 * accuracy)}
        summary.append(key | scores)
        recordings += [
            key
            | counts
            | {"train_rpm": 3 - test, "test_rpm": test, "recording": f"{name}{test}"}
            for test in (1.0, 2.0)
            for name in "ab"
        ]
    return pd.DataFrame(summary), pd.DataFrame(recordings)


def test_a_method_has_a_row_and_a_rig_a_column():
    accuracies = OURS | {("r", "QUANT"): 0.6, ("s", "QUANT"): 0.4}
    accuracies |= {(rig, BATCHED): 1 for rig in "rs"}
    accuracies |= {("r", "MiniRocket"): 1.0, ("simulated rig", "make_diagnoser"): 0.0}
    accuracies |= {(rig, LEFT_OUT): 0.3 for rig in "rs"}
    text = overview(*results(accuracies))
    assert text.splitlines()[-6:] == [
        "| method | mean of rigs | 90 % interval | worst rig | worst pair | r | s |",
        "| --- | --- | --- | --- | --- | --- | --- |",
        "| `make_diagnoser` (ours) | **0.600** | 0.500 to 0.700 | **0.500** | **0.250** | 0.500 "
        "| **0.700** |",
        "| QUANT | 0.500 | 0.400 to 0.600 | 0.400 | 0.200 | **0.600** | 0.400 |",
        "| `make_diagnoser`, constants chosen without the rig (ours) | 0.300 | 0.300 to 0.300 "
        "| 0.300 | 0.150 | 0.300 | 0.300 |",
        f"| {BATCHED} | 1.000 | 1.000 to 1.000 | 1.000 | 0.500 | 1.000 | 1.000 |",
    ]
    assert "another protocol" in text


def test_differences_are_paired_and_name_the_rigs_with_a_better_peer():
    _, recordings = results(OURS | {("r", "QUANT"): 0.6, ("s", "QUANT"): 0.4})
    text = differences(recordings)
    assert text.splitlines()[-1].startswith("| QUANT | +0.100 | -0.100 to 0.300 |")
    assert "with the best peer: r (QUANT, 0.600 against 0.500)." in text


def test_draws_are_of_recordings():
    _, recordings = results({("r", "make_diagnoser"): 0.5})
    assert rig_draws(recordings).std() == 0
    recordings["right"] = np.where(recordings.recording.str.startswith("a"), 100, 0)
    drawn = rig_draws(recordings)
    # Two recordings at each of two speeds, each right as a whole or wrong as a whole.
    assert np.unique(drawn).tolist() == [0, 0.25, 0.5, 0.75, 1]
    assert drawn.mean() == pytest.approx(0.5, abs=0.03)
    assert (drawn != rig_draws(recordings, random_state=1)).any()


def test_draws_are_of_rigs():
    means = mean_draws([np.zeros(1000), np.ones(1000)])
    assert np.unique(means).tolist() == [0, 0.5, 1]
    assert means.mean() == pytest.approx(0.5, abs=0.03)


def test_constants_of_a_rig_are_those_that_the_others_chose():
    rows = choices()
    assert len(rows) == 6
    for rig, row in rows.iterrows():
        diagnoser = diagnoser_without(rig)
        residual = diagnoser["decide"].residual["compare"]
        assert diagnoser["identify"].order[0] == row["model order"]
        assert residual.smooth_drift == row["smooth drift"]
