"""Calls that would run and mean something else: each is refused, or warned of."""

import warnings

import dask.array
import numpy as np
import pytest
import sklearn
from sklearn.model_selection import GridSearchCV, cross_validate

from skarxlag import (
    FaultDetector,
    FaultOrderClassifier,
    OrderResidual,
    estimate_shaft_speed,
    make_detector,
    make_diagnoser,
    make_fault_order_classifier,
    make_known_conditions,
)

LOST = "The pipeline was fitted with rpm and is scored without"
GRID = {"decide__false_alarm_rate": [0.01, 0.1]}


@pytest.fixture(scope="module")
def rows():
    """Windows of two conditions, each at two speeds."""
    X = np.random.default_rng(0).normal(size=(24, 4800))
    X[12:, ::100] += 5
    return X, np.repeat(["good", "worn"], 12), np.tile([600.0, 900.0], 12)


@pytest.fixture(scope="module")
def fitted(rows):
    X, y, rpm = rows
    return make_diagnoser().fit(X, y, rpm=rpm)


def said(call, *arguments, **options):
    """Return the warnings of a call."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        call(*arguments, **options)
    return [str(each.message) for each in caught]


@pytest.mark.parametrize(
    "detector", [make_detector(), FaultDetector()], ids=["maker", "class"]
)
def test_labels_of_several_conditions_for_a_detector_are_warned_of(rows, detector):
    X, y, rpm = rows
    end = "but all rows count as healthy. Pass healthy rows alone."
    assert f"y has 2 labels (good, worn), {end}" in said(detector.fit, X, y, rpm=rpm)
    many = np.arange(24) // 4
    assert f"y has 6 labels (0, 1, 2, ...), {end}" in said(
        detector.fit, X, many, rpm=rpm
    )
    for labels in (None, ["good"] * 24):
        assert not any(
            "label" in each for each in said(detector.fit, X, labels, rpm=rpm)
        )


@pytest.mark.parametrize("rpm", [0, 0.0, -900, np.nan, np.inf, np.array(0.0)])
def test_one_speed_for_all_rows_must_be_above_0(rows, fitted, rpm):
    X, y, speeds = rows
    by_orders = make_fault_order_classifier(bearing="6205", sampling_rate=20_000).fit(X)
    with warnings.catch_warnings(action="ignore", category=UserWarning):
        known = make_known_conditions().fit(X, y, rpm=speeds)
    for model in (fitted, known, by_orders):
        with pytest.raises(
            ValueError, match=r"rpm == .*, expected revolutions per min"
        ):
            model.predict(X[:2], rpm=rpm)


def test_a_sampling_rate_in_kilohertz_is_named(rows):
    X, y, rpm = rows
    message = "expected at least 100 Hz. For 25.6 kHz, give 25600."
    for call in (
        lambda: make_diagnoser(sampling_rate=25.6).fit(X, y),
        lambda: make_diagnoser(sampling_rate=25.6, bearing="6205").fit(X, y, rpm=rpm),
        lambda: OrderResidual(sampling_rate=25.6).fit(X, y, rpm=rpm),
        lambda: estimate_shaft_speed(X, 25.6, 900),
    ):
        with pytest.raises(ValueError, match=message):
            call()


def test_a_sampling_rate_that_is_too_low_for_the_speed_is_named_and_not_the_speed(rows):
    X, y, _ = rows
    message = (
        "sampling_rate == 200, expected at least 300 Hz: a revolution at 9000 rpm "
    )
    with pytest.raises(ValueError, match=message):
        make_diagnoser(sampling_rate=200).fit(X, y, rpm=9000)


def test_a_bearing_without_a_sampling_rate_is_refused_when_the_diagnoser_is_made():
    with pytest.raises(
        ValueError,
        match="The bearing '6205' needs a sampling rate: pass sampling_rate in Hz",
    ):
        make_diagnoser(bearing="6205")
    with pytest.raises(
        ValueError, match="sampling_rate is missing, expected the sampling rate"
    ):
        FaultOrderClassifier(bearing="6205").fit(np.ones((2, 50)))


def evaluations(X, y, rpm):
    """Ways to evaluate a diagnoser, all of which fit it with speeds."""
    params = {"params": {"rpm": rpm}, "cv": 2}
    search = GridSearchCV(make_diagnoser(), GRID, cv=2)
    return {
        "cross_validate": lambda: cross_validate(make_diagnoser(), X, y, **params),
        "search": lambda: search.fit(X, y, rpm=rpm),
        "nested": lambda: cross_validate(search, X, y, **params),
    }


@pytest.mark.parametrize("name", ["cross_validate", "search", "nested"])
def test_speeds_that_cross_validation_drops_are_warned_of_unless_routed(rows, name):
    call = evaluations(*rows)[name]
    messages = said(call)
    assert messages and all(LOST in each for each in messages)
    assert all("set_config(enable_metadata_routing=True)" in each for each in messages)
    with sklearn.config_context(enable_metadata_routing=True):
        assert said(evaluations(*rows)[name]) == []


def test_a_diagnosis_without_speeds_is_legitimate_and_a_score_warns(rows, fitted):
    X, y, rpm = rows
    assert said(cross_validate, make_diagnoser(), X, y, cv=2) == []
    assert said(fitted.predict, X) == []
    [message] = said(fitted.score, X, y)
    assert message.startswith(LOST)
    search = GridSearchCV(make_diagnoser(), GRID, cv=2, refit=True)
    with warnings.catch_warnings(action="ignore", category=UserWarning):
        search.fit(X, y, rpm=rpm)
    assert said(search.predict, X) == []


def test_a_dask_array_is_refused_with_a_recipe(rows, fitted):
    lazy = dask.array.from_array(rows[0], chunks=(10, -1))
    with pytest.raises(TypeError, match=r"X.map_blocks\(diagnoser.predict, dtype="):
        fitted.predict(lazy)
