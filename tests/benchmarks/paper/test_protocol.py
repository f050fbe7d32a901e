"""The paper's protocol: calibrated at 500 rev/min, tested at every speed and by halves."""

import numpy as np
import pytest
from sklearn.base import BaseEstimator, ClassifierMixin
from sklearn.utils import Bunch

from benchmarks.paper.protocol import run_protocol

CONDITIONS = ["Normal", "Ball", "IR"]


class Recorder(ClassifierMixin, BaseEstimator):
    """Classifier that keeps its training rows and names windows by a value in them."""

    def __init__(self, healthy):
        self.healthy = healthy

    def fit(self, X, y):
        self.rows_ = X[:, 0, :2].tolist()
        self.classes_ = np.unique(y)
        return self

    def predict(self, X):
        return np.array([CONDITIONS[int(value)] for value in X[:, 0, 2]])


def load(crack_mm, rpm):
    """Five windows a condition that hold rpm, start, and the verdict of the recorder."""
    target = np.repeat(CONDITIONS, 5)
    start = np.tile(np.arange(5) * 10, 3)
    verdict = (start + rpm / 50 + crack_mm) % 3
    data = np.stack([np.full(15, rpm), start, verdict], axis=1)[:, np.newaxis]
    return Bunch(
        data=data,
        target=target,
        target_names=CONDITIONS,
        rpm=np.full(15, float(rpm)),
        recording=np.char.add(target, f"_{rpm:g}"),
        start=start,
    )


@pytest.fixture
def made():
    """All recorders, in the order in which they are made."""
    return []


@pytest.fixture
def outcome(made):
    def make(healthy):
        made.append(Recorder(healthy))
        return made[-1]

    return run_protocol(load, {"one": make, "two": make})


def test_all_windows_at_500_calibrate(outcome):
    assert list(outcome.fitted) == [(3, "one"), (3, "two"), (6, "one"), (6, "two")]
    for recorder in outcome.fitted.values():
        assert recorder.healthy == "Normal"
        assert recorder.rows_ == load(3, 500).data[:, 0, :2].tolist()


def test_all_windows_are_tested(outcome):
    verdicts = outcome.verdicts
    assert len(verdicts) == 2 * 2 * 4 * 15 and (verdicts["train_rpm"] == 500).all()
    assert verdicts["test_rpm"].unique().tolist() == [300, 400, 450, 500]
    for (crack, rpm, _), rows in verdicts.groupby(
        ["crack_mm", "test_rpm", "diagnoser"]
    ):
        rig = load(crack, rpm)
        assert rows["true"].tolist() == rig.target.tolist()
        assert rows["start"].tolist() == rig.start.tolist()
        assert rows["predicted"].tolist() == [
            CONDITIONS[int(x[0, 2])] for x in rig.data
        ]


def test_halves_are_calibrated_on_the_first_and_scored_on_the_second(outcome, made):
    by_half = [each for each in made if each not in outcome.fitted.values()]
    # Of five windows the middle one belongs to neither half.
    assert [each.rows_ for each in by_half] == 4 * [3 * [[500, 0], [500, 10]]]
    halves = outcome.halves
    assert (halves["test_rpm"] == 500).all() and set(halves["start"]) == {30, 40}
    assert len(halves) == 2 * 2 * 3 * 2
