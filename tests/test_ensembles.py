"""Diagnosers inside scikit-learn's ensembles and searches, on windows of one and two channels."""

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter
from sklearn.calibration import CalibratedClassifierCV
from sklearn.compose import ColumnTransformer
from sklearn.ensemble import BaggingClassifier, StackingClassifier
from sklearn.model_selection import RandomizedSearchCV
from sklearn.preprocessing import FunctionTransformer
from sklearn.tree import DecisionTreeClassifier

from skarxlag import DiagnosisPipeline, make_alpio, make_diagnoser

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
    np.testing.assert_array_equal(bag.predict(X[1::2]), Y[1::2])
    confidences = [member.predict_proba(X[:1])[0, 0] for member in bag.estimators_]
    assert len(set(confidences)) == 3  # each saw windows of its own


def test_stacking_with_the_windows_passed_through(rows):
    X, diagnoser = rows
    stack = StackingClassifier(
        [("diagnoser", diagnoser)],
        DecisionTreeClassifier(max_depth=1),
        cv=2,
        passthrough=True,
    ).fit(X[::2], Y[::2])
    assert stack.final_estimator_.n_features_in_ == 1 + X.shape[1]
    # Of all columns the stump takes the diagnoser's, not a sample of the window.
    assert stack.final_estimator_.tree_.feature[0] == 0
    assert np.mean(stack.predict(X[1::2]) == Y[1::2]) > 0.9


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


def test_search_over_columns_of_a_table():
    X = two_channels()
    names = [f"{channel}{k}" for channel in ("emission", "torque") for k in range(300)]
    table = pd.DataFrame(X.reshape(60, -1), columns=names).assign(operator="somebody")
    columns = [name for name in names if name != "operator"]
    pipeline = DiagnosisPipeline(
        [("columns", ColumnTransformer([("windows", "passthrough", columns)])),
         *on_rows(make_alpio()).steps]
    )  # fmt: skip
    search = RandomizedSearchCV(
        pipeline,
        {"columns__windows": ["passthrough"], "identify__order": [2, 4, 8]},
        n_iter=2,
        cv=2,
        random_state=0,
    ).fit(table, Y)
    assert (
        search.cv_results_["mean_test_score"].shape == (2,) and search.best_score_ > 0.9
    )
    direct = make_alpio().set_params(
        identify__order=search.best_params_["identify__order"]
    )
    np.testing.assert_array_equal(search.predict(table), direct.fit(X, Y).predict(X))


def test_calibration_of_a_diagnoser_of_rows(rows):
    X, diagnoser = rows
    calibrated = CalibratedClassifierCV(diagnoser, cv=2, ensemble=False).fit(
        X[::2], Y[::2]
    )
    confidence = calibrated.predict_proba(X[1::2])
    of_truth = confidence[np.arange(30), (Y[1::2] == "worn").astype(int)]
    assert np.mean(of_truth > 0.5) > 0.95 and of_truth.mean() > 0.85
