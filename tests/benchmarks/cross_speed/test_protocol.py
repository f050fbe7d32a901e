"""Diagnosers are fitted on first halves of one speed and scored on second halves."""

import numpy as np
import pytest
from sklearn.base import BaseEstimator, ClassifierMixin
from sklearn.dummy import DummyClassifier
from sklearn.svm import LinearSVC

from benchmarks.cross_speed.protocol import (
    check_rig,
    consecutive_groups,
    leave_one_speed_in,
    log_evidence,
    score,
)
from tests.benchmarks.speed_rig import two_conditions

LENGTH = 4


@pytest.fixture
def rig():
    """Constant windows whose level shows the condition, 0 or 1, times 1 + rpm / 1000."""

    def make_windows(speed, condition):
        return np.full((24, LENGTH), (condition == "bad") * (1 + speed / 1000))

    return two_conditions(make_windows, 24, LENGTH)


class Recorder(ClassifierMixin, BaseEstimator):
    """Classifier that calls everything above half of the training mean "bad"."""

    fitted = []  # noqa: RUF012

    def fit(self, X, y):
        self.classes_ = np.unique(y)
        self.level_ = X.mean()
        Recorder.fitted.append((X, y))
        return self

    def predict(self, X):
        return np.where(X.mean(axis=1) > self.level_, "bad", "ok")


def pairs_of(rig):
    pairs = leave_one_speed_in(Recorder, rig, LENGTH)
    return {(pair["train_rpm"], pair["test_rpm"]): pair for pair in pairs}


def test_groups_stay_within_a_recording_and_follow_time():
    groups = consecutive_groups(["a", "a", "a", "b", "b"], [20, 0, 10, 0, 10], size=2)
    assert groups.tolist() == [[1, 2], [2, 0], [3, 4]]


@pytest.mark.parametrize(
    ("strategy", "expected"),
    [("prior", np.log([[0.5, 0.5]])), ("most_frequent", [[0, np.log(1e-6)]])],
)
def test_log_evidence_of_probabilities_is_floored(strategy, expected):
    X = np.zeros((4, 1))
    classifier = DummyClassifier(strategy=strategy).fit(X, ["a", "a", "b", "b"])
    evidence, rule = log_evidence(classifier, X[:1], None)
    np.testing.assert_allclose(evidence, expected)
    assert rule == "log-probability"


def test_log_evidence_of_a_binary_decision_function_has_two_columns():
    X = np.array([[-1.0], [1.0]])
    classifier = LinearSVC().fit(X, ["a", "b"])
    evidence, rule = log_evidence(classifier, X, None)
    assert rule == "decision function"
    decision = classifier.decision_function(X)
    np.testing.assert_allclose(evidence, np.stack([-decision, decision], axis=1))


def test_score_by_hand():
    scores = score(["a", "a", "a", "b"], ["a", "a", "b", "b"])
    assert scores["accuracy"] == 0.75 and scores["verdicts"] == 4
    assert scores["balanced_accuracy"] == pytest.approx((2 / 3 + 1) / 2)
    assert scores["confusion"] == {("a", "a"): 2, ("a", "b"): 1, ("b", "b"): 1}


def test_fit_gets_first_halves_of_one_speed_only(rig):
    rig.data += np.arange(len(rig.data))[:, None] * 1e-6  # every window is recognisable
    Recorder.fitted.clear()
    assert list(pairs_of(rig)) == [(a, b) for a in (100, 200) for b in (100, 200)]
    for speed, (X, y) in zip((100.0, 200.0), Recorder.fitted, strict=True):
        expected = (rig.rpm == speed) & (rig.start < 12 * LENGTH)
        np.testing.assert_array_equal(X, rig.data[expected])
        np.testing.assert_array_equal(y, rig.target[expected])


def test_scores_come_from_second_halves(rig):
    rig.data[rig.start >= 12 * LENGTH] *= -1  # both conditions look healthy there
    for pair in pairs_of(rig).values():
        assert pair["window"]["confusion"] == {("ok", "ok"): 12, ("bad", "ok"): 12}
        assert pair["group"]["confusion"] == {("ok", "ok"): 3, ("bad", "ok"): 3}


def test_group_outvotes_a_wrong_window(rig):
    wrong = (rig.rpm == 200) & (rig.target == "bad") & (rig.start == 20 * LENGTH)
    rig.data[wrong] = 0.0
    pairs = pairs_of(rig)
    assert pairs[100, 200]["window"]["accuracy"] == 23 / 24
    assert pairs[100, 200]["group"]["accuracy"] == 1.0
    assert pairs[100, 100]["window"]["accuracy"] == 1.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"rpm": np.full(96, 100.0)}, "at least two speeds"),
        ({"target": np.repeat(["ok"], 95)}, "target has 95 rows"),
        ({"data": np.zeros((96, 3))}, "3 samples, window_length is 4"),
        ({"target_names": ["ok", "bad", "worse"]}, "'worse'.*first half.*100"),
    ],
)
def test_unusable_rig_is_refused(rig, change, message):
    rig.update(change)
    with pytest.raises(ValueError, match=message):
        check_rig(rig, LENGTH)
