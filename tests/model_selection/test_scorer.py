"""Scorer that passes speeds to the method that it scores."""

import numpy as np
import pytest
import sklearn
from sklearn.base import BaseEstimator, ClassifierMixin
from sklearn.metrics import accuracy_score, balanced_accuracy_score, log_loss
from sklearn.model_selection import GridSearchCV, cross_val_score
from sklearn.tree import DecisionTreeClassifier

from skarxlag import SpeedSplit
from skarxlag.model_selection import SpeedScorer

RPM = np.repeat([300.0, 400.0], 6)
Y = np.tile(["a", "a", "b"], 4)


class NamesFastRows(ClassifierMixin, BaseEstimator):
    """Classifier that predicts "b" for rows above a speed."""

    __metadata_request__predict = {"rpm": True}  # noqa: RUF012

    def __init__(self, limit=350.0):
        self.limit = limit

    def fit(self, X, y):
        self.classes_ = np.unique(y)
        return self

    def predict(self, X, rpm=None):
        return np.where(np.asarray(rpm) > self.limit, "b", "a")


@pytest.fixture
def routing():
    with sklearn.config_context(enable_metadata_routing=True):
        yield {"rpm": RPM, "groups": RPM}


def test_speeds_reach_predict_in_cross_validation_and_in_searches(routing):
    X = np.zeros((12, 2))
    scorer = SpeedScorer(accuracy_score)
    options = {"cv": SpeedSplit(), "scoring": scorer}
    scores = cross_val_score(NamesFastRows(), X, Y, params=routing, **options)
    np.testing.assert_allclose(scores, [1 / 3, 2 / 3])
    search = GridSearchCV(NamesFastRows(), {"limit": [350.0, 500.0]}, **options)
    search.fit(X, Y, **routing)
    assert search.best_params_ == {"limit": 500.0}


def test_metric_method_and_sign():
    X = np.arange(12.0)[:, np.newaxis]
    tree = DecisionTreeClassifier(max_depth=1).fit(X, Y)
    weights = np.arange(12.0)
    scorer = SpeedScorer(balanced_accuracy_score)
    expected = balanced_accuracy_score(Y, tree.predict(X), sample_weight=weights)
    assert scorer(tree, X, Y, rpm=RPM, sample_weight=weights) == expected
    loss = SpeedScorer(
        log_loss, response_method="predict_proba", greater_is_better=False
    )
    assert loss(tree, X, Y) == pytest.approx(-log_loss(Y, tree.predict_proba(X)))
