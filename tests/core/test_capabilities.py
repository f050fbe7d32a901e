"""Capabilities of fitted estimators, for our own decisions and for those of scikit-learn."""

from dataclasses import replace

import numpy as np
import pytest
import sklearn
from scipy.signal import lfilter
from sklearn.calibration import CalibratedClassifierCV
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.ensemble import BaggingClassifier, IsolationForest
from sklearn.frozen import FrozenEstimator
from sklearn.linear_model import LogisticRegression, RidgeClassifier
from sklearn.model_selection import GridSearchCV
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import StandardScaler

from skarxlag import (
    OrderResidual,
    ThresholdLadder,
    make_alpio,
    make_detector,
    make_diagnoser,
    make_known_conditions,
)
from skarxlag.core.capabilities import (
    Capabilities,
    capabilities,
    requests,
)
from skarxlag.core.pipelines import as_diagnosis_pipeline

pytestmark = pytest.mark.filterwarnings(
    "ignore:rpm is not given:UserWarning", "ignore:.* rows of condition .* are too few:UserWarning",
    "ignore:All rows of condition .* have one speed:UserWarning",
)  # fmt: skip
Y = np.repeat(["good", "worn"], 30)
CONDITIONS = ("good", "worn")
ROWS = {"window_length": 300}
LADDER = {
    "conditions": CONDITIONS,
    "states_probabilities": True,
    "healthy": "good",
    "alarm": True,
    "stated_rate": 0.01,
}
SPECIMENS = {
    "states_unknown": True,
    "locations": ("healthy", None),
    "n_specimens": (1, 1),
    "n_healthy": 30,
}
FOREIGN = {"conditions": CONDITIONS, "states_probabilities": True}


@pytest.fixture(scope="module")
def X():
    noise = np.random.default_rng(0).normal(size=(60, 300))
    return np.concatenate(
        [lfilter([1], [1, -0.9], noise[:30]), lfilter([1], [1, 0.9], noise[30:])]
    )


def calibrated(diagnoser):
    return CalibratedClassifierCV(diagnoser, cv=2)


def searched(diagnoser):
    return GridSearchCV(diagnoser, {"decide__false_alarm_rate": [0.01]}, cv=2)


@pytest.mark.parametrize(
    ("model", "expected"),
    [
        (make_alpio(healthy="good"), LADDER | ROWS),
        (make_diagnoser(healthy="good"), LADDER | ROWS | SPECIMENS | {"n_evidence": 2}),
        (searched(make_alpio(healthy="good")), LADDER | ROWS),
        (Pipeline([("outer", make_alpio(healthy="good"))]), LADDER | ROWS),
        (calibrated(make_alpio(healthy="good")), FOREIGN | ROWS | {"healthy": "good"}),
        (BaggingClassifier(make_alpio(), 2), FOREIGN | ROWS | {"healthy": None}),
        (calibrated(searched(make_alpio(healthy="good"))), FOREIGN | ROWS | {"healthy": "good"}),
        (make_pipeline(StandardScaler(), LogisticRegression()), FOREIGN | ROWS),
        (make_pipeline(StandardScaler(), RidgeClassifier()), {"conditions": CONDITIONS} | ROWS),
        (LinearDiscriminantAnalysis(), FOREIGN | ROWS),
        (IsolationForest(random_state=0), {"alarm": True} | ROWS),
    ],
)  # fmt: skip
def test_models_are_described(model, expected, X):
    found = capabilities(model.fit(X, Y))
    assert replace(found, limits="") == Capabilities(**expected)
    # Only models of this package state the basis of their alarm.
    is_own = found.alarm and not isinstance(model, IsolationForest)
    assert bool(found.limits) == is_own
    assert capabilities(FrozenEstimator(model)) == found


def test_detector_and_known_conditions_answer_different_questions(X):
    rows = np.tile(X, (4, 1))
    rpm = np.repeat([900, 1200], 120)
    detector = capabilities(make_detector(false_alarm_rate=0.05).fit(rows, rpm=rpm))
    asked = {"stated_rate": 0.05, "takes_rpm": True, "speeds": (900.0, 1200.0)} | ROWS
    own = {"alarm": True, "n_healthy": 240, "healthy_p_value": True, "needs_rpm": True}
    shares = "0.0% at 900 rpm, 0.0% at 1200 rpm"
    own["limits"] = (
        f"240 healthy rows; false alarms at speeds that were left out: {shares}"
    )
    assert detector == Capabilities(**own, **asked)
    known = make_known_conditions(false_rejection_rate=0.05).fit(
        rows, np.tile(Y, 4), rpm=rpm
    )
    assert capabilities(known) == Capabilities(none_of_these=True, **asked)
    without = capabilities(make_detector().fit(rows))
    assert (without.takes_rpm, without.needs_rpm, without.speeds) == (False, False, ())


@pytest.fixture(scope="module")
def stretches():
    rng = np.random.default_rng(0)
    X = 0.1 * rng.normal(size=(40, 4000))
    for i, period in enumerate(np.repeat([170, 110], 20)):
        X[i, ::period] += 5
    return X, np.repeat(CONDITIONS, 20)


@pytest.mark.slow
@pytest.mark.parametrize("rpm", [None, 600.0])
def test_speed_is_taken_if_fit_knew_it(rpm, stretches):
    X, y = stretches
    steps = [
        ("compare", OrderResidual(sampling_rate=10_000)),
        ("decide", ThresholdLadder()),
    ]
    diagnoser = Pipeline(steps)
    model = as_diagnosis_pipeline(diagnoser).fit(
        X, y, **({} if rpm is None else {"rpm": rpm})
    )
    can = capabilities(model)
    assert can.takes_rpm == (rpm is not None)
    assert can.speeds == (() if rpm is None else (600.0,))
    assert (can.is_stretch, can.sampling_rate, can.window_length) == (
        True,
        10_000,
        4000,
    )


@pytest.mark.parametrize("wrap", [lambda step: step, make_pipeline])
def test_requests_follow_what_a_step_was_set_to_request(wrap):
    with sklearn.config_context(enable_metadata_routing=True):
        residual = OrderResidual()
        model = wrap(residual)
        assert requests(model, "transform", "rpm")
        residual.set_transform_request(rpm=False)
        assert not requests(model, "transform", "rpm")
        residual.set_transform_request(rpm=True)
        assert requests(model, "transform", "rpm")
