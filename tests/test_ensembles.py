"""Diagnosers inside scikit-learn's ensembles and searches, on windows of one and two channels."""

import numpy as np
import pytest
from scipy.signal import lfilter
from sklearn.ensemble import BaggingClassifier
from sklearn.preprocessing import FunctionTransformer

from skarxlag import DiagnosisPipeline, make_diagnoser
from skarxlag.core.capabilities import capabilities

Y = np.repeat(["good", "worn"], 30)


def two_channels():
    """Windows of a system with an input, which hides from the output alone what is worn."""
    rng = np.random.default_rng(0)
    torque = rng.normal(size=(60, 300))
    noise = 0.3 * rng.normal(size=(60, 300))
    noise[30:] = lfilter([0.5], [1, 0.8], noise[30:])
    output = 3 * lfilter([0, 1], [1, -0.9], torque) + noise
    return np.stack([output, torque], axis=1)


def as_windows(rows):
    return np.reshape(rows, (len(rows), 2, -1))


def on_rows(diagnoser):
    return DiagnosisPipeline(
        [("windows", FunctionTransformer(as_windows)), *diagnoser.steps]
    )


@pytest.fixture(params=[1, 2], ids=["one channel", "two channels"], scope="module")
def rows(request):
    """Rows of a table, and a diagnoser for them."""
    if request.param == 2:
        return two_channels().reshape(60, -1), on_rows(make_diagnoser())
    noise = np.random.default_rng(0).normal(size=(60, 300))
    X = np.concatenate(
        [lfilter([1], [1, -0.9], noise[:30]), lfilter([1], [1, 0.9], noise[30:])]
    )
    return X, make_diagnoser()


def test_bagging_of_diagnosers(rows):
    X, diagnoser = rows
    bag = BaggingClassifier(diagnoser, n_estimators=3, random_state=0).fit(
        X[::2], Y[::2]
    )
    assert np.mean(bag.predict(X[1::2]) == Y[1::2]) > 0.95
    confidences = [member.predict_proba(X[:1])[0, 0] for member in bag.estimators_]
    assert len(set(confidences)) == 3  # each saw windows of its own


def test_three_axes_are_what_ensembles_refuse():
    with pytest.raises(ValueError, match="dim 3"):
        BaggingClassifier(make_diagnoser()).fit(two_channels(), Y)


def test_diagnosers_of_rows_and_of_windows_agree_to_the_last_bit():
    X = two_channels()
    of_windows = make_diagnoser(healthy="good").fit(X, Y)
    of_rows = on_rows(make_diagnoser(healthy="good")).fit(X.reshape(60, -1), Y)
    for method in ("predict", "predict_proba", "decision_function"):
        expected = getattr(of_windows, method)(X)
        np.testing.assert_array_equal(
            getattr(of_rows, method)(X.reshape(60, -1)), expected
        )
    # The steps after the first one are a diagnoser of windows.
    np.testing.assert_array_equal(
        of_rows[1:].predict_proba(X), of_windows.predict_proba(X)
    )


def test_the_healthy_condition_of_an_ensemble_is_its_number():
    X = two_channels()[:, 0]
    with pytest.raises(ValueError, match="number the sorted conditions: pass the num"):
        BaggingClassifier(make_diagnoser(healthy="good"), n_estimators=2).fit(X, Y)
    bag = BaggingClassifier(make_diagnoser(healthy=0), n_estimators=2).fit(X, Y)
    assert capabilities(bag.estimators_[0]).healthy == 0
