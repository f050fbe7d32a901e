import copy
import warnings

import numpy as np
import pytest
import sklearn
from sklearn.base import clone

from skarxlag import (
    FaultDetector,
    KnownConditions,
    make_diagnoser,
    save_diagnoser,
)
from skarxlag.core.state import check_state

from .outliers import LENGTH, POLES, RATE, changed, fit, rig, rows, struck


@pytest.fixture(scope="module")
def data():
    return rig(("good", "inner"), (800, 1200), 30)


@pytest.fixture(scope="module")
def fitted(data):
    X, y, rpm = data
    return fit(KnownConditions(false_rejection_rate=RATE), X, y, rpm=rpm)


def test_each_condition_has_the_p_values_of_its_detector(fitted, data):
    X, y, rpm = data
    new = rows("good", 5, 1000, 1)
    p_values = fitted.p_values(new, rpm=1000)
    assert p_values.shape == (5, 2) and fitted.classes_.tolist() == ["good", "inner"]
    for c, name in enumerate(fitted.classes_):
        is_class = y == name
        of_class = {"X": X[is_class], "rpm": rpm[is_class]}
        alone = fit(FaultDetector(false_alarm_rate=RATE), **of_class)
        expected = alone.p_values(new, rpm=1000)
        np.testing.assert_array_equal(p_values[:, c], expected)


def test_rows_without_impacts_are_not_of_a_fault():
    X = struck(60, 0, 20.0)
    known = fit(KnownConditions(false_rejection_rate=RATE), X, rpm=1000)
    assert (known.predict(struck(20, 1, 20.0), rpm=1000) == 1).mean() > 0.8
    without = struck(20, 3, 0.0)
    assert np.all(known.predict(without, rpm=1000) == -1)


def test_a_condition_that_was_not_trained_is_rejected(fitted):
    new = rows("outer", 20, 1200, 3)
    assert np.all(fitted.predict(new, rpm=1200) == -1)
    X, y, rpm = rig(POLES, (800, 1200), 30)
    three = fit(clone(fitted), X, y, rpm=rpm)
    assert (three.predict(new, rpm=1200) == 1).mean() > 0.8


@pytest.mark.parametrize(
    "unlike",
    [
        np.random.default_rng(9).normal(size=(8, LENGTH)),
        np.sin(0.3 * np.arange(LENGTH) + np.arange(8)[:, np.newaxis]),
        np.linspace(0, 1, 8 * LENGTH).reshape(8, LENGTH),
    ],
    ids=["white noise", "a sine", "a time column"],
)
@pytest.mark.parametrize("rpm", [800, 1200])
def test_what_is_no_signal_of_the_machine_is_rejected(unlike, rpm):
    # 400 rows are ten blocks of time.
    X, y, speeds = rig(("good", "outer"), (rpm,), 400)
    known = fit(KnownConditions(), X, y, rpm=speeds)
    assert np.all(known.predict(unlike, rpm=rpm) == -1)


@pytest.mark.parametrize(("height", "nearest"), [(60.0, 0), (10.0, 4)])
def test_an_unknown_speed_may_lie_beyond_those_of_fit(height, nearest):
    X = struck(15, 0, 20.0)
    known = fit(KnownConditions(), X, rpm=np.repeat([600, 800, 1200], 5))
    new = struck(5, 1, height)
    hypotheses = 600 / 1.3, 600, 800, 1200, 1200 * 1.3
    scores = np.array([known.score_samples(new, rpm=rpm) for rpm in hypotheses])
    others = np.delete(scores, nearest, axis=0)
    assert np.all(scores[nearest] > others.max(axis=0))
    np.testing.assert_allclose(known.score_samples(new), scores[nearest])


def test_without_labels_all_rows_are_of_one_condition():
    X = rows("good", 40, 1000, 0)
    known = fit(KnownConditions(false_rejection_rate=RATE), X, rpm=1000)
    assert known.classes_.tolist() == ["known"]
    assert known.p_values(X, rpm=1000).shape == (40, 1)
    check_state(known)


FEW_GOOD = "rows of condition good are too few"


@pytest.mark.parametrize(
    ("taken", "rpm", "texts", "classes"),
    [
        (
            slice(18),
            800,
            [
                "8 rows of condition inner are too few to hold the rate 0.01 without an "
                "assumption on the distribution of their scores. They hold 1/9 = 0.11. "
                "Use at least 99 rows.",
                "All rows of condition inner have one speed, 800 rpm",
            ],
            ["good", "inner"],
        ),
        (
            slice(11),
            800,
            [
                "Conditions with one row at each speed are left out: 'inner'. Their rows",
                f"10 {FEW_GOOD}",
                "one speed",
            ],
            ["good"],
        ),
        # Fewer speeds are weaker than fewer rows.
        (
            slice(3, 20),
            [800] * 3 + [1200] * 4 + [800] * 10,
            ["10 rows of condition inner", "one speed"],
            ["good", "inner"],
        ),
    ],
)
def test_the_weakest_condition_is_warned_of(taken, rpm, texts, classes):
    X, y, _ = rig(("good", "inner"), (800,), 10)
    with pytest.warns(UserWarning) as caught:
        known = KnownConditions().fit(X[taken], y[taken], rpm=rpm)
    assert known.classes_.tolist() == classes
    assert len(caught) == len(texts)
    for warning, text in zip(caught, texts, strict=True):
        assert text in str(warning.message) and warning.filename == __file__


@pytest.mark.parametrize(
    ("chosen", "labels", "rpm"), [([0, 10], "ab", None), ([0, 1], None, [800, 1200])]
)
def test_some_condition_needs_two_rows_of_one_speed(chosen, labels, rpm):
    X, _, _ = rig(("good", "inner"), (800,), 10)
    y = None if labels is None else list(labels)
    message = "of one condition and speed: 1, expected at least 2"
    with pytest.raises(ValueError, match=message):
        KnownConditions().fit(X[chosen], y, rpm=rpm)


def test_a_condition_with_two_rows_of_one_of_its_speeds_is_known():
    X, y, _ = rig(("good", "inner"), (800,), 3)
    known = fit(KnownConditions(), X, y, rpm=[800, 800, 1200] * 2)
    assert known.classes_.tolist() == ["good", "inner"]
    for detector in known.detectors_:
        np.testing.assert_allclose(detector.speeds_, [800, 1200])


@pytest.mark.parametrize("rpm", [None, 800])
def test_a_condition_of_one_speed_drifts_as_faults_do(rpm):
    X, y, _ = rig(("good", "inner"), (800,), 4)
    known = fit(KnownConditions(), X, y, rpm=rpm)
    assert [detector.drift_scale_ for detector in known.detectors_] == [2.0, 2.0]


def test_labels_of_mixed_types_are_refused():
    with pytest.raises(ValueError, match="all texts or all numbers"):
        KnownConditions().fit(rows("good", 8, 800, 0), ["a", 1] * 4)


def test_only_fitted_known_conditions_are_saved(tmp_path, data):
    X, y, _ = data
    path = tmp_path / "bearing.skops"
    diagnoser = make_diagnoser(healthy="good").fit(X, y)
    message = "known_conditions is a ConditionClassifier, expected"
    with pytest.raises(TypeError, match=message):
        save_diagnoser(diagnoser, path, known_conditions=diagnoser[-1])
    with pytest.raises(sklearn.exceptions.NotFittedError):
        save_diagnoser(diagnoser, path, known_conditions=KnownConditions())


def of_other_length(detector):
    shape = {"window_shape_": np.array([LENGTH + 1]), "n_features_in_": LENGTH + 1}
    return changed(detector, **shape)


@pytest.mark.parametrize(
    ("name", "detectors"),
    [
        ("detectors_", lambda good, inner: []),
        ("detectors_", lambda good, inner: (good, inner)),
        ("detectors_", lambda good, inner: [good, "detector"]),
        ("classes_", lambda good, inner: [good]),
        ("detectors_", lambda good, inner: [good, of_other_length(inner)]),
        ("window_shape_", lambda good, inner: [of_other_length(good)] * 2),
    ],
)
def test_inconsistent_detectors_are_refused(fitted, name, detectors):
    check_state(fitted)
    broken = copy.deepcopy(fitted)
    broken.detectors_ = detectors(*fitted.detectors_)
    with pytest.raises(ValueError, match=name):
        check_state(broken)


def test_speeds_that_fit_did_not_get_are_no_reason_to_warn(data):
    X, y, _ = data
    known = fit(KnownConditions(), X, y)
    with warnings.catch_warnings(action="error"):
        known.predict(X, rpm=[1000.0] * len(X))
