"""Common behaviour of the detectors of faults and of unknown conditions."""

import warnings

import numpy as np
import pytest
from sklearn.base import clone

from skarxlag import (
    FaultDetector,
    KnownConditions,
)

from .outliers import LENGTH, RATE, fit, rig, rows

DETECTORS = [
    FaultDetector(false_alarm_rate=RATE),
    KnownConditions(false_rejection_rate=RATE),
]


@pytest.fixture(scope="module")
def data():
    return rig(("good", "inner"), (800, 1200), 30)


@pytest.fixture(scope="module")
def new():
    return np.concatenate([rows("good", 5, 1000, 1), rows("outer", 5, 1000, 1)])


@pytest.fixture(scope="module", params=DETECTORS, ids=["faults", "conditions"])
def fitted(request, data):
    X, y, rpm = data
    return fit(clone(request.param), X, y, rpm=rpm)


def test_outputs_agree(fitted, new):
    found = fitted.diagnose(new, rpm=1000)
    p_values = fitted.p_values(new, rpm=1000)
    assert np.all((p_values > 0) & (p_values <= 1))
    np.testing.assert_array_equal(found.p_values, p_values.reshape(10, -1))
    score = np.log(p_values.reshape(10, -1).max(axis=1))
    np.testing.assert_allclose(found.score, score - np.log(RATE))
    decision = fitted.decision_function(new, rpm=np.full(10, 1000.0))
    np.testing.assert_array_equal(decision, found.score)
    np.testing.assert_array_equal(fitted.predict(new, rpm=1000), found.verdict)
    np.testing.assert_array_equal(found.verdict, np.where(found.score < 0, -1, 1))
    np.testing.assert_array_equal(found.alarm, found.verdict == -1)


def test_fit_predict_is_fit_and_predict(fitted, data):
    X, y, rpm = data
    with warnings.catch_warnings(action="ignore"):
        verdicts = clone(fitted).fit_predict(X, y, rpm=rpm)
    np.testing.assert_array_equal(verdicts, fitted.predict(X, rpm=rpm))


def test_gain_and_offset_do_not_matter(fitted):
    new = rows("good", 19, 1000, 3)
    scores = fitted.score_samples(new, rpm=1000)
    gains = np.logspace(-9, 9, 19)[:, np.newaxis]
    amplified = fitted.score_samples(gains * new, rpm=1000)
    np.testing.assert_allclose(amplified, scores, rtol=1e-6, atol=1e-9)
    shifted = fitted.score_samples(new + 1e3, rpm=1000)
    np.testing.assert_allclose(shifted, scores, rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize("rpm", [0.0, -1000.0, np.nan, np.inf, 0.001, 12.5, 1e9])
def test_rows_at_an_implausible_speed_are_flagged_with_one_warning(fitted, rpm):
    X = rows("good", 3, 1000, 0)
    expected = fitted.diagnose(X, rpm=1000).p_values
    message = "1 of 3 rows are treated as rows without a signal"
    with pytest.warns(UserWarning, match=message) as caught:
        found = fitted.diagnose(X, rpm=[1000.0, rpm, 1000.0])
    assert len(caught) == 1 and caught[0].filename == __file__
    np.testing.assert_array_equal(found.p_values[[0, 2]], expected[[0, 2]])
    assert np.all((found.p_values[1] > 0) & (found.p_values[1] < 1e-30))
    assert found.verdict[1] == -1


@pytest.mark.parametrize("detector", DETECTORS, ids=["faults", "conditions"])
@pytest.mark.parametrize(
    ("options", "rpm", "message"),
    [
        ({"rate": 0.0}, 800, "_rate == 0.0"),
        ({"rate": 1.0}, 800, "_rate == 1.0"),
        ({"window_length": 0}, 800, "window_length == 0"),
        ({}, [800, 800, np.nan, 800], "rpm of row 2: nan"),
        ({}, [800] * 3, r"rpm.shape == \(3,\), expected one speed for each"),
        ({}, "fast", "rpm must hold numbers, got 'fast'"),
    ],
)
def test_fit_names_bad_input(detector, options, rpm, message):
    name = next(name for name in detector.get_params() if name.endswith("_rate"))
    options = {key.replace("rate", name): value for key, value in options.items()}
    with pytest.raises(ValueError, match=message):
        clone(detector).set_params(**options).fit(rows("good", 4, 800, 0), rpm=rpm)


def test_rows_count_as_their_weights_say(fitted, data, new):
    X, y, rpm = data
    is_first = np.arange(len(X)) % 30 < 15
    weights = is_first.astype(float)
    with_zeros = fit(clone(fitted), X, y, rpm=rpm, sample_weight=weights)
    half = fit(clone(fitted), X[is_first], y[is_first], rpm=rpm[is_first])
    expected = half.p_values(new, rpm=1000)
    np.testing.assert_allclose(with_zeros.p_values(new, rpm=1000), expected)


@pytest.mark.parametrize("detector", DETECTORS, ids=["faults", "conditions"])
def test_rows_are_cut_into_windows(detector):
    noise = np.random.default_rng(0).normal(size=(2, 9600))

    def n_windows(**options):
        model = fit(clone(detector).set_params(**options), noise, rpm=800)
        return getattr(model, "detectors_", [model])[0].n_windows_

    assert (n_windows(), n_windows(window_length=1200)) == (2, 8)
    assert n_windows(window_length=20_000) == 1


def test_window_length_of_fit_counts(fitted, new):
    expected = fitted.score_samples(new, rpm=1000)
    renamed = clone(fitted).set_params(window_length=100)
    vars(renamed).update(vars(fitted) | {"window_length": 100})
    np.testing.assert_array_equal(renamed.score_samples(new, rpm=1000), expected)


def test_labels_are_conditions_or_warned_of(data):
    X, _, rpm = data
    y = np.resize(range(4), len(X))
    message = (
        "y has 4 labels (0, 1, 2, ...), but all rows count as healthy. Pass healthy "
        "rows alone."
    )
    with pytest.warns(UserWarning) as caught:
        FaultDetector(false_alarm_rate=RATE).fit(X, y, rpm=rpm)
        KnownConditions(false_rejection_rate=0.1).fit(X, y, rpm=rpm)
    texts = [str(warning.message) for warning in caught]
    assert texts.count(message) == 1
    with warnings.catch_warnings(action="error"):
        FaultDetector(false_alarm_rate=RATE).fit(X, 0 * y, rpm=rpm)


def test_a_row_has_the_length_of_fit(fitted):
    with pytest.raises(ValueError, match=f"expecting {LENGTH} features"):
        fitted.predict(np.ones((2, LENGTH + 1)), rpm=1000)
