"""Verdicts of classifiers by protocol, and their summary."""

import numpy as np
import pandas as pd
import pytest
from sklearn.base import BaseEstimator, ClassifierMixin
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.svm import LinearSVC

from skarxlag import SpeedSplit, make_diagnoser
from skarxlag.model_selection import evaluate, evaluation_summary, protocol_splits


@pytest.fixture
def rig():
    rng = np.random.default_rng(0)
    y = np.repeat(["good", "inner", "outer"], 40)
    rpm = np.tile(np.repeat([300.0, 400.0], 20), 3)
    X = rng.normal(size=(120, 400))
    X[y == "inner"] = np.cumsum(X[y == "inner"], axis=1)
    X[y == "outer"] = np.diff(X[y == "outer"], axis=1, append=0)
    recording = np.char.add(y, rpm.astype(int).astype(str))
    return X, y, pd.DataFrame({"rpm": rpm, "recording": recording})


def test_verdicts_are_those_of_the_classifier_itself(rig):
    X, y, facts = rig
    levels = np.log(X.std(axis=1, keepdims=True)) + facts[["rpm"]].to_numpy() / 1000
    verdicts = evaluate({"LDA": LinearDiscriminantAnalysis()}, levels, y, facts)
    for split, (train, test) in enumerate(
        SpeedSplit().split(None, groups=facts["rpm"])
    ):
        peer = LinearDiscriminantAnalysis().fit(levels[train], y[train])
        found = verdicts[verdicts["split"] == split]
        assert found["row"].tolist() == test.tolist()
        assert found["predicted"].tolist() == peer.predict(levels[test]).tolist()
        largest = peer.predict_proba(levels[test]).max(axis=1)
        np.testing.assert_allclose(found["probability"], largest)
        assert found["train_rpm"].unique() == facts["rpm"][train].unique()
    assert verdicts["rpm"].tolist() == facts["rpm"][verdicts["row"]].tolist()


class NeedsSpeed(ClassifierMixin, BaseEstimator):
    """Classifier that fails unless it is given the speed of each row."""

    __metadata_request__fit = {"rpm": True}  # noqa: RUF012
    __metadata_request__predict = {"rpm": True}  # noqa: RUF012

    def fit(self, X, y, rpm=None):
        self.classes_ = np.unique(y)
        assert len(rpm) == len(X)
        return self

    def predict(self, X, rpm=None):
        assert set(rpm) in ({300.0}, {400.0})
        return np.full(len(X), "good")


def test_metadata_reach_those_who_request_them(rig):
    X, y, facts = rig
    methods = {"speed": NeedsSpeed(), "none": LinearSVC()}
    verdicts = evaluate(methods, X[:, :3], y, facts, params={"rpm": facts["rpm"]})
    assert verdicts["probability"].isna().all()
    assert set(verdicts.loc[verdicts["estimator"] == "speed", "predicted"]) == {"good"}


def test_our_diagnosers_are_evaluated_in_one_pass_on_several_threads(rig):
    X, y, facts = rig
    counted = []
    options = {
        "params": {"rpm": facts["rpm"]},
        "note": lambda *each: counted.append(each),
    }
    one, two = (
        evaluate({"D": make_diagnoser()}, X, y, facts, n_jobs=n, **options)
        for n in (None, 2)
    )
    pd.testing.assert_frame_equal(one, two)
    assert counted == [("D", 120)] * 4
    shares = evaluation_summary(one).loc[("speed", "D")]
    assert shares["condition"] > 90 and shares["recordings"] == 100


def test_shares_of_a_summary_by_hand():
    rows = [
        # split, rpm, recording, true, predicted, is_known, probability
        (0, 300, "a", "good", "good", True, 0.95),
        (0, 300, "a", "good", "IR2", True, 0.95),
        (0, 300, "b", "IR2", "IR5", True, 0.5),
        (0, 400, "c", "OR2", "good", False, 0.92),
        (0, 400, "c", "OR2", "OR5", False, 0.5),
        (0, 400, "c", "OR2", "OR5", False, 0.5),
    ]
    names = [
        "split",
        "rpm",
        "recording",
        "true",
        "predicted",
        "is_known",
        "probability",
    ]
    verdicts = pd.DataFrame(rows, columns=names).assign(estimator="E", protocol="load")
    places = {"g": "healthy", "I": "inner", "O": "outer"}
    verdicts["true_location"] = verdicts["true"].str[0].map(places)
    verdicts["location"] = verdicts["predicted"].str[0].map(places)
    shares = evaluation_summary(verdicts).loc[("load", "E")]
    assert shares.to_dict() == pytest.approx(
        {
            "condition": 100 / 3,
            "location": 400 / 6,
            "recordings": 100,
            "worst pair": 200 / 3,
            "false alarms": 50,
            "missed": 25,
            "stated": 50,
            "right of stated": 100 / 3,
        }
    )


def test_protocols_have_their_order(rig):
    X, y, facts = rig
    facts["load"] = facts["rpm"]
    splits, _ = protocol_splits(y, facts)
    verdicts = evaluate(
        {"LDA": LinearDiscriminantAnalysis()}, X, y, facts, splits=splits
    )
    shown = evaluation_summary(verdicts.iloc[::-1])
    assert shown.index.unique("protocol").tolist() == ["speed", "load"]
