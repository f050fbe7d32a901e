"""Diagnosers inside scikit-learn's ensembles, on windows of one channel."""

import numpy as np
import pytest
from scipy.signal import lfilter
from sklearn.ensemble import BaggingClassifier, StackingClassifier
from sklearn.tree import DecisionTreeClassifier

from skarxlag import make_diagnoser


@pytest.fixture(scope="module")
def windows():
    noise = np.random.default_rng(0).normal(size=(60, 300))
    X = np.concatenate([lfilter([1], [1, -0.9], noise[:30]), lfilter([1], [1, 0.9], noise[30:])])
    return X, np.repeat(["good", "worn"], 30)


def test_bagging_of_diagnosers(windows):
    X, y = windows
    bag = BaggingClassifier(make_diagnoser(), n_estimators=3, random_state=0).fit(X[::2], y[::2])
    np.testing.assert_array_equal(bag.predict(X[1::2]), y[1::2])
    confidences = [member.predict_proba(X[:1])[0, 0] for member in bag.estimators_]
    assert len(set(confidences)) == 3  # each saw windows of its own


def test_stacking_with_the_windows_passed_through(windows):
    X, y = windows
    stack = StackingClassifier(
        [("diagnoser", make_diagnoser())],
        DecisionTreeClassifier(max_depth=1),
        cv=2,
        passthrough=True,
    ).fit(X[::2], y[::2])
    assert stack.final_estimator_.n_features_in_ == 1 + X.shape[1]
    # Of all columns the stump takes the diagnoser's, not a sample of the window.
    assert stack.final_estimator_.tree_.feature[0] == 0
    assert np.mean(stack.predict(X[1::2]) == y[1::2]) > 0.9
