"""The bearing and the load that a table states, from the table to the model and the results."""

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter

WINDOW, N_WINDOWS = 200, 8


@pytest.fixture
def table(tmp_path):
    """Two bearings of each of two conditions; the healthy ones are the same bearing."""
    rows = []
    for seed, (condition, specimen) in enumerate(
        [("good", "B1"), ("inner", "B2"), ("inner", "B3"), ("good", "B1")]
    ):
        colour = [1.0, -0.9] if condition == "good" else [1.0, 0.9]
        noise = np.random.default_rng(seed).normal(size=N_WINDOWS * WINDOW)
        np.save(tmp_path / f"{seed}.npy", lfilter([1.0], colour, noise))
        rows.append(
            (f"{seed}.npy", condition, specimen, ["", "2.5"][seed % 2], 300, 2_000)
        )
    columns = ["path", "condition", "specimen", "load", "rpm", "sampling_rate"]
    pd.DataFrame(rows, columns=columns).to_csv(tmp_path / "table.csv", index=False)
    return tmp_path / "table.csv"


def test_fit_counts_the_specimens_of_each_condition(run, table):
    model = table.with_suffix(".skops")
    options = ("--diagnoser", "diagnoser", "--window-length", WINDOW)
    _, out, _ = run("fit", table, "-o", model, *options)
    lines = [line.split() for line in out.splitlines()]
    assert ["specimens", "recordings", "windows"] in lines
    assert ["good", "1", "2", "16"] in lines and ["inner", "2", "2", "16"] in lines
    pd.read_csv(table).drop(columns="specimen").to_csv(table, index=False)
    assert "specimens " not in run("fit", table, "-o", model, *options)[1]


def test_results_repeat_the_stated_specimen_and_load(run, table):
    model, results = table.with_suffix(".skops"), table.with_name("results.csv")
    run(
        "fit", table, "-o", model, "--diagnoser", "diagnoser", "--window-length", WINDOW
    )
    code, _, err = run("diagnose", model, "--table", table, "-o", results)
    assert code == 0, err
    rows = pd.read_csv(results)
    assert rows["stated_specimen"].tolist() == ["B1", "B2", "B3", "B1"]
    np.testing.assert_array_equal(rows["stated_load"], [np.nan, 2.5, np.nan, 2.5])
