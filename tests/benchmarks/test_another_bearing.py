"""Protocol, measures and methods of the benchmark on another bearing."""

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter

from benchmarks.another_bearing import (
    command,
    constants,
    curve,
    metrics,
    protocol,
)
from benchmarks.another_bearing.methods import METHODS, by_location
from benchmarks.recipe.rigs import Recording, Rig
from skarxlag.core.fault_locations import FAULT_LOCATIONS
from skarxlag.kernels import posterior

RATE = 2000.0
POLES = {"Normal": 0.0, "IR2": 0.6, "IR5": 0.5, "OR2": -0.6, "OR5": -0.5}


def rig(name="CWRU drive end", loads=(None,)):
    """A rig of five conditions at two speeds, with recordings of 6 s."""
    rng = np.random.default_rng(0)
    recordings = [
        Recording(
            lfilter([1], [1, -pole], rng.normal(size=12_000)),
            condition,
            rpm,
            None,
            load,
        )
        for condition, pole in POLES.items()
        for rpm in (1200.0, 1500.0)
        for load in loads
    ]
    return Rig(name, RATE, recordings)


def test_folds_leave_one_specimen_of_each_location_out():
    assert protocol.left_out_sets(rig()) == [{"IR2", "OR2"}, {"IR5", "OR5"}]
    found = list(protocol.folds(rig()))
    # All specimens, then two folds, at two speeds each.
    assert len(found) == 6
    same = found[0]
    other = found[2]
    assert set(same.train.condition) == set(POLES) and list(same.tests) == [
        protocol.SAME_BEARING
    ]
    assert set(other.train.condition) == {"Normal", "IR5", "OR5"}
    assert set(other.train.rpm) == {1200.0}
    assert list(other.tests) == [protocol.ANOTHER, protocol.ANOTHER_SPEED]
    for rows in other.tests.values():
        assert set(rows.condition) == {"IR2", "OR2"} and set(rows.location) == {
            "inner",
            "outer",
        }
        # Whole recordings of specimens that were left out, first halves of the others.
        assert len(rows.X) == 2 * 6
    assert (
        len(other.train.X) == 3 * 3
        and len(same.tests[protocol.SAME_BEARING].X) == 5 * 3
    )
    assert set(other.tests[protocol.ANOTHER].rpm) == {1200.0}


def test_another_load_is_a_protocol_of_its_own():
    fold = list(protocol.folds(rig(loads=("low", "high"))))[-1]
    assert fold.tests.keys() == {
        protocol.ANOTHER,
        protocol.ANOTHER_SPEED,
        protocol.ANOTHER_LOAD,
    }
    assert set(fold.train.load) != set(fold.tests[protocol.ANOTHER_LOAD].load)
    assert set(fold.tests[protocol.ANOTHER_LOAD].rpm) == set(fold.train.rpm)


def test_a_bearing_is_a_specimen_if_it_is_stated():
    named = [
        each._replace(condition=each.condition[:2], specimen=each.condition)
        for each in rig()[2]
    ]
    stated = rig()._replace(recordings=named)
    assert protocol.left_out_sets(stated) == [{"IR2", "OR2"}, {"IR5", "OR5"}]
    rows = protocol.rows_of(stated, named)
    assert set(rows.condition) == {f"{name[:2]} {name}" for name in POLES}


def table_of(right, stated=0.95):
    """Probabilities of locations, of which some are right."""
    frame = pd.DataFrame(0.0, index=range(len(right)), columns=list(FAULT_LOCATIONS))
    frame["inner"] = np.where(right, stated, 1 - stated)
    frame["outer"] = np.where(right, 1 - stated, stated)
    return frame.assign(
        location="inner", specimen=[f"s{i % 4}" for i in range(len(right))]
    )


def test_measures_by_hand():
    right = np.arange(40) % 4 != 0
    found = metrics.measured(table_of(right))
    assert found["rows"] == 40 and found["right"].startswith("0.750 (")
    assert found["stated"] == 1 and found["of these"] == 0.75
    assert found["error"] == pytest.approx(0.2)
    expected = -np.log(np.where(right, 0.95, 0.05)).mean()
    assert found["log loss"] == pytest.approx(expected)
    # Fewer than 30 stated rows have no share, and one location has no area.
    few = metrics.measured(table_of(right[:8]))
    assert np.isnan(few["of these"]) and np.isnan(few["AUROC"])
    low, high = metrics.interval(right, np.arange(40) % 4)
    assert low < 0.75 < high


def test_methods_return_probabilities_of_locations():
    fold = list(protocol.folds(rig()))[2]
    for name, method in METHODS.items():
        for key, probability in method(rig(), fold.train, fold.tests):
            assert probability.shape == (
                len(fold.tests[key].X),
                len(FAULT_LOCATIONS),
            ), name
            assert (probability >= 0).all() and (
                probability.sum(axis=1) < 1 + 1e-9
            ).all()
    found = by_location(
        np.array([[0.1, 0.2, 0.7]]), np.array(["inner", "inner", "healthy"])
    )
    np.testing.assert_allclose(found, [[0, 0.3, 0, 0.7]])


def test_tables_of_the_command():
    found = command.scored(rig())
    table = metrics.table(found)
    assert len(table) == 3 * len(METHODS)
    pivot = command.side_by_side(table)
    assert list(pivot)[3:] == list(METHODS) and len(pivot) == 3
    assert set(command.overview(table)["method"]) <= set(METHODS)


def test_settings_of_the_constants_change_the_score_and_are_put_back():
    parts = constants.compared(rig())
    in_use, stated = constants.losses(parts, constants.IN_USE)
    other, _ = constants.losses(parts, constants.IN_USE | {"UNKNOWN_SHARE": 0.9})
    assert other > in_use > 0 and stated.dtype == bool
    assert constants.IN_USE["UNKNOWN_SHARE"] == posterior.UNKNOWN_SHARE
    tried = constants.settings()
    assert len(tried) == 240 and tried[0] == constants.IN_USE
    scores = pd.DataFrame(np.full((240, 2), 1.0), columns=["a", "b"])
    scores.loc[7] = 0.5
    quiet = pd.DataFrame(np.zeros((240, 2)), columns=["a", "b"])
    found = constants.left_out(scores, quiet)
    assert found["log loss"].tolist() == [0.5, 0.5] and found["in use"].tolist() == [
        1.0,
        1.0,
    ]
    assert found["far"][0] == tried[7]["FAR"]


def test_the_curve_has_fewer_specimens():
    train = next(iter(protocol.folds(rig()))).train
    assert set(curve.chosen(train, 1).condition) == {"Normal", "IR2", "OR2"}
    assert set(curve.chosen(train, 2).condition) == set(POLES)
