import tracemalloc
from functools import partial
from typing import ClassVar

import joblib
import numpy as np
import pandas as pd
import pytest
import sklearn
from numpy.testing import assert_allclose, assert_array_equal
from scipy.signal import lfilter
from sklearn.base import BaseEstimator, TransformerMixin, clone
from sklearn.metrics import confusion_matrix
from sklearn.model_selection import GridSearchCV
from sklearn.pipeline import Pipeline
from sklearn.utils import Bunch

from skarxlag import (
    ARXLaguerre,
    DiagnosisPipeline,
    ExtendedStatePIObserver,
    PIObserver,
    ThresholdLadder,
    make_alpio,
    make_detector,
    make_diagnoser,
    make_extended_state_pio,
    make_known_conditions,
)

pytestmark = pytest.mark.filterwarnings("ignore:rpm is not given:UserWarning")

MAKERS = [make_alpio, make_extended_state_pio, make_diagnoser]
POLES = {"normal": (0.9, 0.4), "ball": (0.7, 1.2), "inner": (0.85, 2.2)}


def simulate(n_windows, seed, length=400):
    """Windows of noise through a resonance of its own for each condition."""
    rng = np.random.default_rng(seed)
    X, y = [], []
    for name, (radius, angle) in POLES.items():
        noise = rng.normal(size=(n_windows, length + 200))
        X.append(
            lfilter([1], [1, -2 * radius * np.cos(angle), radius**2], noise)[:, 200:]
        )
        y += [name] * n_windows
    return np.concatenate(X), np.array(y)


@pytest.fixture(scope="module")
def data():
    return simulate(12, seed=0)


@pytest.mark.parametrize("make", MAKERS)
def test_diagnoser_distinguishes_conditions_on_windows_of_another_size(make, data):
    diagnoser = make(healthy="normal").fit(*data)
    fresh, truth = simulate(10, seed=1)
    assert_array_equal(confusion_matrix(truth, diagnoser.predict(fresh)).sum(1), 10)
    assert diagnoser.score(fresh, truth) > 0.9
    assert diagnoser.score(1e-3 * fresh + 5.0, truth) > 0.9
    probability = diagnoser.predict_proba(fresh)
    assert probability.shape == (30, 3)
    assert_allclose(probability.sum(axis=1), 1)


@pytest.mark.parametrize("make", MAKERS)
def test_parameters_of_the_makers(make, tmp_path):
    plain = make()
    assert isinstance(plain, Pipeline)
    assert plain["decide"].healthy is None
    assert make(healthy="normal")["decide"].healthy == "normal"
    assert make(memory=str(tmp_path)).memory == str(tmp_path)
    assert plain.memory is None
    with_jobs = [p for p in make(n_jobs=2).get_params() if p.endswith("__n_jobs")]
    assert len(with_jobs) >= 2
    assert all(make(n_jobs=2).get_params()[p] == 2 for p in with_jobs)


class CountedARXLaguerre(ARXLaguerre):
    """Counts how often it is fitted."""

    n_fits = 0

    def fit(self, X, y=None):
        type(self).n_fits += 1
        return super().fit(X, y)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("observer", "grid"),
    [
        (PIObserver(), {"kp": [0.0, 0.5, 1.0], "ki": [0.01, 0.2]}),
        (ExtendedStatePIObserver(), {"kp": [0.0, 0.3, 0.9], "ki": [0.005, 0.05]}),
    ],
    ids=["PI", "extended"],
)
def test_search_over_gains_identifies_once_a_split(observer, grid, tmp_path):
    X, y = simulate(12, seed=0, length=60)
    # Hard enough that scores are neither 0 nor 1.
    X = X + 3 * np.random.default_rng(5).normal(size=X.shape)
    CountedARXLaguerre.n_fits = 0
    steps = [
        ("identify", CountedARXLaguerre(order=6)),
        ("observe", observer),
        ("decide", ThresholdLadder()),
    ]
    pipe = Pipeline(steps, memory=joblib.Memory(tmp_path, verbose=0))
    grid = {f"observe__{name}": values for name, values in grid.items()}
    search = GridSearchCV(pipe, grid, cv=3, error_score="raise", refit=False).fit(X, y)
    assert len(search.cv_results_["params"]) == 6
    assert CountedARXLaguerre.n_fits == 3
    scores = search.cv_results_["mean_test_score"]
    assert len(np.unique(scores.round(12))) > 1


def test_healthy_chooses_the_condition_that_gamma_is_for(data):
    thresholds = [
        make_alpio(healthy=h).fit(*data)["decide"].healthy_index_ for h in sorted(POLES)
    ]
    assert thresholds == [0, 1, 2]


METHODS = ["predict", "predict_proba", "predict_log_proba", "decision_function"]


@pytest.mark.filterwarnings(
    "ignore:36 healthy rows",
    "ignore:.* rows of condition .* are too few:UserWarning",
    "ignore:y has 3 labels:UserWarning",
)
@pytest.mark.parametrize("make", [*MAKERS, make_detector, make_known_conditions])
def test_results_are_those_of_scikit_learn_bit_for_bit(make, data):
    """For windows with a signal and without: the quality of windows is no matter of a pipeline."""
    X, y = data
    model = make(n_jobs=2).fit(X, y)
    plain = Pipeline(model.steps)
    mixed = np.tile(X, (30, 1))[:1030]
    mixed[::7], mixed[1::7], mixed[2::7, 50:] = 0, mixed[1::7].clip(-0.1, 0.1), 3
    compared = 0
    for name in [*METHODS, "score_samples"]:
        if hasattr(plain, name):
            assert_array_equal(getattr(model, name)(mixed), getattr(plain, name)(mixed))
            compared += 1
    assert compared == (4 if make in MAKERS else 3)
    found = model.diagnose(mixed)
    assert_array_equal(found.verdict, plain.predict(mixed))
    assert_array_equal(model.predict(pd.DataFrame(mixed)), found.verdict)
    assert_array_equal(model.predict(mixed.tolist()), found.verdict)
    assert_array_equal(found.score, plain.decision_function(mixed))
    if "probability" in found:
        assert_array_equal(found.probability, plain.predict_proba(mixed))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_plain_array_of_one_row_is_refused_like_any_other(data, value):
    X, y = data
    diagnoser = make_diagnoser().fit(X, y)
    row = X[:1].copy()
    row[0, 7] = value
    for refused in (row, row.astype(np.float32), row.astype(">f8"), row.tolist()):
        with pytest.raises(ValueError, match=r"contains (NaN|infinity)"):
            diagnoser.predict(refused)
    for refused in (X[:1, 1:], X[:0], X[0], X[:1].astype(complex)):
        with pytest.raises(ValueError):
            diagnoser.predict(refused)


@pytest.mark.parametrize("make", MAKERS)
@pytest.mark.parametrize("table", ["default", "pandas"])
@pytest.mark.parametrize("routed", ["sample_weight", "identify__sample_weight"])
def test_fit_is_that_of_scikit_learn_bit_for_bit(make, table, routed, data):
    params = {routed: np.arange(36) % 3}
    model = make().set_output(transform=table).fit(*data, **params)
    plain = Pipeline(clone(model).steps)
    with sklearn.config_context(enable_metadata_routing="__" not in routed):
        plain.fit(*data, **params)
    for (_, step), (_, expected) in zip(model.steps, plain.steps, strict=True):
        assert joblib.hash(state(step)) == joblib.hash(state(expected))
    assert_array_equal(model.predict_proba(data[0]), plain.predict_proba(data[0]))


@pytest.mark.filterwarnings("ignore::UserWarning")  # Speeds are not known.
@pytest.mark.parametrize(
    ("make", "copies"),
    [
        (make_detector, 1.7),
        (make_known_conditions, 1.7),
        (lambda: make_diagnoser(healthy=0), 0.5),
        (make_alpio, 0.5),
        (make_extended_state_pio, 0.5),
    ],
)
def test_fit_needs_memory_for_some_copies_of_its_windows(make, copies):
    many, y = np.random.default_rng(0).normal(size=(2000, 2400)), np.arange(2000) % 3
    make().fit(many[:99], y[:99])
    tracemalloc.start()
    make().fit(many, y)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < copies * many.nbytes


@pytest.mark.filterwarnings("ignore::UserWarning")  # Too few rows.
@pytest.mark.parametrize(
    "make",
    [make_detector, partial(make_diagnoser, sampling_rate=10_000, bearing="6205")],
    ids=["detector", "joint"],
)
@pytest.mark.parametrize("metadata", [{}, {"sample_weight": np.arange(40) % 3}])
def test_fit_on_stretches_is_that_of_scikit_learn_bit_for_bit(make, metadata):
    X = np.random.default_rng(0).normal(size=(40, 8000))
    y = np.repeat(["healthy", "inner"], 20)
    metadata = metadata | {"rpm": np.where(np.arange(40) % 4 < 2, 1200, 1500)}
    model = make(n_jobs=2).fit(X, y, **metadata)
    with sklearn.config_context(enable_metadata_routing=True):
        plain = Pipeline(clone(model).steps).fit(X, y, **metadata)
    for (_, step), (_, expected) in zip(model.steps, plain.steps, strict=True):
        assert joblib.hash(state(step)) == joblib.hash(state(expected))


def state(estimator):
    """Fitted attributes, also those of fitted estimators among them."""
    found = {
        name: value for name, value in vars(estimator).items() if name.endswith("_")
    }
    nested = {
        name: value for name, value in found.items() if isinstance(value, BaseEstimator)
    }
    for name, value in nested.items():
        steps = [each for _, each in getattr(value, "steps", [("", value)])]
        found[name] = [state(step) for step in steps]
    return found


def test_a_diagnosis_pipeline_has_what_its_last_step_has(data):
    identify = DiagnosisPipeline([("identify", ARXLaguerre())]).fit(*data)
    detector = make_detector(false_alarm_rate=0.1).fit(data[0])
    assert [hasattr(identify, name) for name in METHODS] == [False] * 4
    assert [hasattr(detector, name) for name in METHODS] == [True, False, False, True]
    assert isinstance(make_diagnoser(n_jobs=2)[:-1], DiagnosisPipeline)
    with pytest.raises(ValueError, match="0 sample"):
        make_alpio().fit(*data).predict(np.empty((0, 400)))


class SpeedScaled(TransformerMixin, BaseEstimator):
    """A step that divides each window by its speed, and remembers what `fit` was given."""

    __metadata_request__fit: ClassVar = {"rpm": True}
    __metadata_request__transform: ClassVar = {"rpm": True}

    def fit(self, X, y=None, rpm=None):
        self.rpm_ = rpm
        return self

    def fit_transform(self, X, y=None, rpm=None):
        return self.fit(X, y, rpm=rpm).transform(X, rpm=rpm)

    def transform(self, X, rpm=None):
        return X if rpm is None else X / np.reshape(rpm, (-1, 1))

    def adapt(self, X, y, rpm=None):
        self.adapted_ = X, y, rpm
        return self


@pytest.fixture
def speed_aware():
    """Levels that separate the conditions only when they are divided by the speed."""
    rng = np.random.default_rng(0)
    rpm = rng.uniform(300, 3000, size=60)
    y = np.repeat(["good", "worn"], 30)
    X = rpm[:, np.newaxis] * (1 + (y == "worn") + 0.1 * rng.random(60))[:, np.newaxis]
    return (
        DiagnosisPipeline([("scale", SpeedScaled()), ("decide", ThresholdLadder())]),
        X,
        y,
        rpm,
    )


@pytest.mark.parametrize("enabled", [False, True])
def test_speeds_reach_the_steps_with_routing_on_or_off(speed_aware, enabled):
    pipe, X, y, rpm = speed_aware
    with sklearn.config_context(enable_metadata_routing=enabled):
        pipe.fit(X, y, rpm=rpm)
        assert_array_equal(pipe["scale"].rpm_, rpm)
        assert_array_equal(pipe.predict(X, rpm=rpm), y)
        assert np.mean(pipe.predict(X) == y) < 0.9
        for name in METHODS:
            expected = getattr(pipe[-1], name)(X / rpm[:, np.newaxis])
            assert_array_equal(getattr(pipe, name)(X, rpm=rpm), expected)
        assert_array_equal(pipe[:-1].transform(X, rpm=rpm), X / rpm[:, np.newaxis])
        assert_array_equal(pipe.diagnose(X, rpm=rpm).verdict, y)
        assert pipe.score(X, y, rpm=rpm) == 1.0
        assert_array_equal(pipe.predict(X / 7, rpm=7.0), pipe.predict(X / 49))
        assert not sklearn.get_config()["enable_metadata_routing"] or enabled


@pytest.mark.parametrize("n_jobs", [None, 2])
def test_batches_cut_metadata(speed_aware, n_jobs):
    pipe, X, y, rpm = speed_aware
    pipe.set_params(n_jobs=n_jobs).fit(X, y, rpm=rpm)
    # 8000 bytes a row: some 130 rows are a batch.
    wide, speeds, truth = np.tile(X, (10, 1000)), np.tile(rpm, 10), np.tile(y, 10)
    pipe["decide"].n_features_in_ = 1000
    assert_array_equal(pipe.predict(wide, rpm=speeds), truth)
    assert_array_equal(pipe.predict(wide, rpm=speeds.tolist()), truth)
    assert_array_equal(pipe.predict(wide, rpm=pd.Series(speeds, index=speeds)), truth)
    with pytest.raises(ValueError, match="inconsistent numbers of samples"):
        pipe.predict(wide, rpm=speeds[:7])


def test_speeds_reach_a_step_by_its_new_name(data):
    diagnoser = make_diagnoser().fit(*data, rpm=600.0)
    expected = diagnoser.predict_proba(data[0], rpm=700.0)
    diagnoser.steps[-1] = ("named", diagnoser[-1])
    assert_array_equal(diagnoser.predict_proba(data[0], rpm=700.0), expected)


def test_metadata_that_no_step_requests_are_refused(data):
    with pytest.raises(TypeError, match="turns"):
        make_alpio().fit(*data, turns=300)
    with pytest.raises(TypeError, match="turns"):
        make_alpio().fit(*data).predict(data[0], turns=300)


@pytest.mark.parametrize("make", MAKERS)
def test_diagnose_gives_all_in_one_pass(make, data, monkeypatch):
    X = np.tile(data[0], (10, 1))
    diagnoser = make(n_jobs=2).fit(*data)
    levels = diagnoser[:-1].transform(X)
    if make is make_diagnoser:
        of_rows = diagnoser[-1].diagnose(levels)
    else:
        of_rows = Bunch(levels=levels, alarm=diagnoser[-1].detect(levels))
    expected = {
        "levels": of_rows.levels,
        "verdict": diagnoser.predict(X),
        "probability": diagnoser.predict_proba(X),
        "score": diagnoser.decision_function(X),
        "alarm": of_rows.alarm,
    }
    seen = []
    original = ARXLaguerre.transform
    monkeypatch.setattr(
        ARXLaguerre,
        "transform",
        lambda self, X: seen.append(len(X)) or original(self, X),
    )
    found = diagnoser.diagnose(X)
    assert sum(seen) == len(X)
    further = {"log_probability", "recorded", "row_evidence"}
    if make is not make_diagnoser:
        further = set()
    assert set(found) == set(expected) | further
    for name, value in expected.items():
        assert_array_equal(found[name], value)


def test_diagnose_of_a_detector():
    X, _ = simulate(40, seed=0)
    detector = make_detector(false_alarm_rate=0.05, fixed_gain=True).fit(X[:40])
    found = detector.diagnose(20 * X[:40])
    assert found.alarm.all() and (found.verdict == -1).all()
    assert_array_equal(found.score, detector.decision_function(20 * X[:40]))
    assert "probability" not in found


def test_adapt_reaches_its_step_through_the_steps_before(data):
    diagnoser = make_diagnoser().fit(*data)
    by_hand = clone(diagnoser).fit(*data)
    healthy = data[1] == "normal"
    X, y = 0.5 * data[0][healthy] ** 3, data[1][healthy]
    assert diagnoser.adapt(X, y) is diagnoser
    step = next(step for _, step in by_hand.steps if hasattr(step, "adapt"))
    before = by_hand.predict_proba(data[0])
    i = [each for _, each in by_hand.steps].index(step)
    step.adapt(by_hand[:i].transform(X), y)
    assert_array_equal(diagnoser.predict_proba(data[0]), by_hand.predict_proba(data[0]))
    assert np.abs(diagnoser.predict_proba(data[0]) - before).max() > 1e-6
    assert not hasattr(make_alpio(), "adapt")
    first = DiagnosisPipeline([("scale", SpeedScaled()), ("decide", ThresholdLadder())])
    first.fit(*data).adapt(X, y)
    assert first["scale"].adapted_[0] is X
    first.adapt(X, y, rpm=900.0)
    assert first["scale"].adapted_[2] == 900.0


@pytest.mark.parametrize(
    "index", [np.linspace(0, 1, 1440), np.arange(1440.0)[::-1], np.arange(1440)[::-1]]
)
def test_rows_of_a_table_are_positions_whatever_its_index(data, index):
    diagnoser = make_alpio().fit(*data)
    # 3200 bytes a row: two batches.
    X = np.tile(data[0], (40, 1))
    table = pd.DataFrame(X, index=index)
    assert_array_equal(diagnoser.predict(table), diagnoser.predict(X))
