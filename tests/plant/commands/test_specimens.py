"""The bearing and the load that a table states, from the table to the model and the results."""

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter

from skarxlag import make_alpio
from skarxlag.decisions.ladder import ThresholdLadder
from skarxlag.plant.commands import fit

WINDOW, N_WINDOWS = 200, 8


class SpecimenLadder(ThresholdLadder):
    """Decision that is given the specimen of each window."""

    __metadata_request__fit = {"specimen": True}  # noqa: RUF012
    seen = []  # noqa: RUF012

    def fit(self, X, y, rpm=None, specimen=None):
        self.seen.append(specimen)
        return super().fit(X, y, rpm=rpm)


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


@pytest.mark.parametrize("is_stated", [True, False])
def test_fit_passes_stated_specimens_to_the_steps_that_request_them(
    run, table, monkeypatch, is_stated
):
    def make(healthy=None):
        return make_alpio(healthy=healthy).set_params(
            decide=SpecimenLadder(healthy=healthy)
        )

    monkeypatch.setitem(fit.DIAGNOSERS, "alpio", ("ALPIO", make))
    SpecimenLadder.seen.clear()
    if not is_stated:
        pd.read_csv(table).drop(columns="specimen").to_csv(table, index=False)
    model = table.with_suffix(".skops")
    # A model file cannot hold a decision of another package.
    with pytest.raises(TypeError, match="SpecimenLadder"):
        run(
            "fit", table, "-o", model, "--diagnoser", "alpio", "--window-length", WINDOW
        )
    (seen,) = SpecimenLadder.seen
    if is_stated:
        assert seen.tolist() == np.repeat(["B1", "B2", "B3", "B1"], N_WINDOWS).tolist()
    else:
        assert seen is None


def test_fit_counts_the_specimens_of_each_condition(run, table):
    model = table.with_suffix(".skops")
    options = ("--diagnoser", "alpio", "--window-length", WINDOW)
    _, out, _ = run("fit", table, "-o", model, *options)
    lines = [line.split() for line in out.splitlines()]
    assert ["specimens", "recordings", "windows"] in lines
    assert ["good", "1", "2", "16"] in lines and ["inner", "2", "2", "16"] in lines
    pd.read_csv(table).drop(columns="specimen").to_csv(table, index=False)
    assert "specimens " not in run("fit", table, "-o", model, *options)[1]


def test_results_repeat_the_stated_specimen_and_load(run, table):
    model, results = table.with_suffix(".skops"), table.with_name("results.csv")
    run("fit", table, "-o", model, "--diagnoser", "alpio", "--window-length", WINDOW)
    code, _, err = run("diagnose", model, "--table", table, "-o", results)
    assert code == 0, err
    rows = pd.read_csv(results)
    assert rows["stated_specimen"].tolist() == ["B1", "B2", "B3", "B1"]
    np.testing.assert_array_equal(rows["stated_load"], [np.nan, 2.5, np.nan, 2.5])
