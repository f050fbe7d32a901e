from typing import ClassVar

import numpy as np
import pytest
from sklearn.base import BaseEstimator, ClassifierMixin
from sklearn.utils import Bunch

from benchmarks.paper.protocol import run_protocol, scored_windows

CONDITIONS = ["Normal", "Ball", "IR"]


class Recorder(ClassifierMixin, BaseEstimator):
    """Classifier that remembers what it was given, and names windows by a value in them."""

    def __init__(self, healthy):
        self.healthy = healthy
        self.fitted_on = None

    def fit(self, X, y):
        assert self.fitted_on is None
        self.fitted_on = X[:, 0, :2].tolist()
        self.classes_ = np.unique(y)
        return self

    def predict(self, X):
        return np.array([CONDITIONS[int(value)] for value in X[:, 0, 2]])


@pytest.fixture
def made():
    """Classifiers in the order in which they were made, and the maker."""
    found = []

    def make(healthy):
        found.append(Recorder(healthy))
        return found[-1]

    return Bunch(found=found, make=make)


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


def test_all_windows_at_500_calibrate_and_all_windows_are_tested(made):
    outcome = run_protocol(load, {"one": made.make, "two": made.make})
    assert len(made.found) == 8  # 2 cracks, 2 names, all windows and first halves
    assert all(each.healthy == "Normal" for each in made.found)
    assert list(outcome.fitted) == [(3, "one"), (3, "two"), (6, "one"), (6, "two")]
    everything = load(3, 500).data[:, 0, :2].tolist()
    assert all(each.fitted_on == everything for each in outcome.fitted.values())
    verdicts = outcome.verdicts
    assert len(verdicts) == 2 * 2 * 4 * 15
    assert verdicts["test_rpm"].unique().tolist() == [300, 400, 450, 500]
    assert (verdicts["train_rpm"] == 500).all()
    for (crack, rpm, _), own in verdicts.groupby(["crack_mm", "test_rpm", "diagnoser"]):
        rig = load(crack, rpm)
        assert own["true"].tolist() == rig.target.tolist()
        assert own["start"].tolist() == rig.start.tolist()
        assert (
            own["predicted"].tolist() == Recorder("Normal").predict(rig.data).tolist()
        )


def test_halves_are_calibrated_on_the_first_and_scored_on_the_second(made):
    outcome = run_protocol(load, {"one": made.make})
    by_half = [each for each in made.found if each not in outcome.fitted.values()]
    assert len(by_half) == 2
    for each in by_half:
        # Of five windows the middle one belongs to neither half.
        assert each.fitted_on == [[500, 0], [500, 10]] * 3
    halves = outcome.halves
    assert (halves["test_rpm"] == 500).all() and set(halves["start"]) == {30, 40}
    assert len(halves) == 2 * 3 * 2


class Timed(ClassifierMixin, BaseEstimator):
    """Requests the speed, and remembers which it was given."""

    __metadata_request__fit: ClassVar = {"rpm": True}
    __metadata_request__predict: ClassVar = {"rpm": True}
    given: ClassVar = []

    def fit(self, X, y, rpm=None):
        self.given.append(("fit", rpm.tolist()))
        self.classes_ = np.unique(y)
        return self

    def predict(self, X, rpm=None):
        assert X[:, 0, 0].tolist() == rpm.tolist()
        self.given.append(("predict", rpm.tolist()))
        return np.repeat("Normal", len(X))


def test_speeds_reach_what_requests_them():
    run_protocol(load, {"timed": lambda healthy: Timed()})
    halves = [500.0] * 6
    whole = [500.0] * 15
    of_crack = [
        ("fit", halves),
        ("predict", halves),
        ("fit", whole),
        ("predict", whole),
    ]
    of_crack += [("predict", [rpm] * 15) for rpm in (300.0, 400.0, 450.0)]
    assert Timed.given == 2 * of_crack


def test_scored_windows():
    class Fixed(BaseEstimator):
        def predict(self, X):
            return np.where(X[:, 0] > 0, "ball", "normal")

    rig = Bunch(
        data=np.array([[1.0], [-1.0], [2.0]]),
        target=np.array(["ball", "ball", "normal"]),
        rpm=np.array([300.0, 400.0, 500.0]),
        recording=np.array(["a", "b", "c"]),
        start=np.array([0, 10, 20]),
    )
    table = scored_windows(Fixed(), rig, np.array([2, 1]), {"diagnoser": "fixed"})
    assert table.to_dict("list") == {
        "diagnoser": ["fixed", "fixed"],
        "test_rpm": [500.0, 400.0],
        "recording": ["c", "b"],
        "start": [20, 10],
        "true": ["normal", "ball"],
        "predicted": ["ball", "normal"],
    }
