"""Protocol, measures and methods of the benchmark on another bearing."""

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter, welch

from benchmarks.another_bearing import command, constants, metrics, protocol
from benchmarks.another_bearing.methods import METHODS, by_location
from benchmarks.another_bearing.noise import synthetic
from benchmarks.recipe.rigs import Recording, Rig
from skarxlag.core.fault_locations import FAULT_LOCATIONS
from skarxlag.kernels import posterior

RATE = 2400.0
POLES = {"Normal": 0.0, "IR2": 0.6, "IR5": 0.5, "OR2": -0.6, "OR5": -0.5}
SPECIMENS = [{"IR2", "OR2"}, {"IR5", "OR5"}]


def make_rig(loads=(None,)):
    """A rig of five conditions at two speeds, with recordings of 6 s."""
    rng = np.random.default_rng(0)
    settings = [
        (condition, rpm, None, load)
        for condition in POLES
        for rpm in (1200.0, 1500.0)
        for load in loads
    ]
    recordings = [
        Recording(
            lfilter([1], [1, -POLES[facts[0]]], rng.normal(size=int(6 * RATE))), *facts
        )
        for facts in settings
    ]
    return Rig("CWRU drive end", RATE, recordings)


@pytest.fixture(scope="module")
def rig():
    return make_rig()


def test_folds_leave_one_specimen_of_each_location_out(rig):
    assert protocol.left_out_sets(rig) == SPECIMENS
    same, _, other, *rest = protocol.folds(rig)
    # All specimens, then two folds, at two speeds each.
    assert len(rest) == 3
    assert set(same.train.condition) == set(POLES)
    assert list(same.tests) == [protocol.SAME_BEARING]
    assert set(other.train.condition) == {"Normal", "IR5", "OR5"}
    assert set(other.train.rpm) == {1200.0}
    assert list(other.tests) == [protocol.ANOTHER, protocol.ANOTHER_SPEED]
    for rows in other.tests.values():
        assert set(rows.condition) == SPECIMENS[0]
        assert set(rows.location) == {"inner", "outer"}
        # Whole recordings of specimens that were left out, first halves of the others.
        assert len(rows.X) == 2 * 6
    assert len(other.train.X) == 3 * 3
    assert len(same.tests[protocol.SAME_BEARING].X) == 5 * 3
    assert set(other.tests[protocol.ANOTHER].rpm) == {1200.0}


def test_another_load_is_a_protocol_of_its_own():
    *_, fold = protocol.folds(make_rig(loads=("low", "high")))
    rows = fold.tests[protocol.ANOTHER_LOAD]
    assert set(fold.train.load).isdisjoint(rows.load)
    assert set(rows.rpm) == set(fold.train.rpm)


def test_a_bearing_is_a_specimen_if_it_is_stated(rig):
    stated = [
        recording._replace(
            condition=recording.condition[:2], specimen=recording.condition
        )
        for recording in rig.recordings
    ]
    assert protocol.left_out_sets(rig._replace(recordings=stated)) == SPECIMENS
    rows = protocol.rows_of(rig, stated)
    assert set(rows.condition) == {f"{name[:2]} {name}" for name in POLES}


def test_measures_by_hand():
    right = np.arange(40) % 4 != 0
    rows = pd.DataFrame(0.0, index=range(40), columns=list(FAULT_LOCATIONS))
    rows["inner"] = np.where(right, 0.95, 0.05)
    rows["outer"] = 1 - rows["inner"]
    rows = rows.assign(location="inner", specimen=[f"s{i % 4}" for i in range(40)])
    measures = metrics.measured(rows)
    assert measures["rows"] == 40 and measures["right"].startswith("0.750 (")
    assert measures["stated"] == 1 and measures["of these"] == 0.75
    assert measures["error"] == pytest.approx(0.2)
    expected = -np.log(np.where(right, 0.95, 0.05)).mean()
    assert measures["log loss"] == pytest.approx(expected)
    # Fewer than 30 stated rows have no share, and one location has no area.
    few = metrics.measured(rows[:8])
    assert np.isnan(few["of these"]) and np.isnan(few["AUROC"])
    low, high = metrics.interval(right, np.arange(40) % 4)
    assert low < 0.75 < high


def test_probabilities_of_a_location_are_those_of_its_classes():
    probability = np.array([[0.1, 0.2, 0.7]])
    summed = by_location(probability, np.array(["inner", "inner", "healthy"]))
    np.testing.assert_allclose(summed, [[0, 0.3, 0, 0.7]])


def test_every_method_has_a_row_for_each_protocol(rig):
    rows = command.scored(rig)
    probability = rows[list(FAULT_LOCATIONS)]
    assert (probability >= 0).all(axis=None)
    assert (probability.sum(axis=1) < 1 + 1e-9).all()
    table = metrics.table(rows)
    assert len(table) == 3 * len(METHODS)
    assert list(command.side_by_side(table))[3:] == list(METHODS)
    assert set(command.overview(table)["method"]) <= set(METHODS)


@pytest.fixture(scope="module")
def parts(rig):
    return constants.compared(rig)


def test_settings_of_the_constants_change_the_score_and_are_put_back(parts):
    in_use = constants.score(constants.stated(parts, constants.IN_USE))
    changed = constants.IN_USE | {"UNKNOWN_SHARE": 0.9}
    other = constants.score(constants.stated(parts, changed))
    assert other["log loss"] > in_use["log loss"] > 0
    assert 0 <= in_use["right"] <= in_use["stated"] and 0 <= in_use["noise"] <= 1
    assert constants.IN_USE["UNKNOWN_SHARE"] == posterior.UNKNOWN_SHARE


def test_a_larger_prior_states_more_rows(parts):
    table = constants.trade(parts)
    assert table["recorded_prior"].tolist() == list(constants.PRIORS)
    for name in ("same bearing", "another bearing"):
        assert table[f"{name}: stated"].is_monotonic_increasing


def test_the_setting_that_is_best_on_the_other_rigs_is_chosen():
    grid = constants.SETTINGS
    assert len(grid) == 14 and grid[0] == constants.IN_USE
    table = pd.DataFrame(
        {"log loss": 1.0, "noise": 0.0, "stated": 10, "right": 10}, range(14)
    )
    table.loc[3:6, "log loss"] = 0.5
    # Too much noise, and too few right.
    table.loc[3, "noise"] = 0.1
    table.loc[4, "right"] = 5
    chosen = constants.left_out({"a": table, "b": table})
    assert chosen["log loss"].tolist() == [0.5, 0.5]
    assert chosen["in use"].tolist() == [1.0, 1.0]
    assert chosen["odds of noise"][0] == grid[5]["ODDS_OF_NOISE"]


def test_pink_noise_has_the_same_power_in_each_octave():
    frequency, power = welch(synthetic(1000.0, 2**17)["pink"], 1000.0, nperseg=4096)
    octaves = np.log(frequency[20:-20])
    assert abs(np.polyfit(octaves, np.log(power[20:-20]), 1)[0] + 1) < 0.05
