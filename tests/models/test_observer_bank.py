import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.model_selection import GridSearchCV
from sklearn.pipeline import Pipeline

from skarxlag import (
    ARXLaguerre,
    DiagnosisPipeline,
    ExtendedStatePIObserver,
    PIObserver,
    SpectralDistance,
    ThresholdLadder,
)
from skarxlag.kernels import observer
from skarxlag.kernels.observer_bank import bank_levels

OBSERVERS = [ExtendedStatePIObserver, PIObserver]


@pytest.fixture(scope="module")
def innovations():
    return np.random.default_rng(0).normal(size=(70, 2, 200))


@pytest.fixture(scope="module")
def y():
    return np.arange(70) % 2


def typed(observe, kind=Pipeline, **identification):
    return kind(
        [
            ("identify", ARXLaguerre(**identification)),
            ("observe", observe),
            ("decide", ThresholdLadder()),
        ]
    )


@pytest.mark.parametrize("make", OBSERVERS)
def test_residuals_are_distances_of_the_levels_of_the_mean_innovations(
    make, innovations, y
):
    bank = make(n_observers=8).fit(innovations, y)
    gains = bank.kp_, bank.ki_, bank.bounds_, bank.adaptation_step
    power, gain = bank_levels(innovations.mean(axis=1), bank.pole, *gains)
    groups = np.stack([power, gain, gain - power], axis=1)
    distance = SpectralDistance(smooth_drift=0.1, rough_drift=0.005)
    expected = distance.fit(groups, y).transform(groups)
    assert_array_equal(bank.transform(innovations), expected)
    assert_array_equal(make(n_observers=8).fit_transform(innovations, y), expected)


def test_speeds_reach_the_comparison(innovations, y):
    rpm = np.repeat([300.0, 500.0], 35)
    bank = ExtendedStatePIObserver().fit(innovations, y, rpm=rpm)
    assert_allclose(bank.distance_.speeds_, [300, 500])
    near, far = (bank.transform(innovations, rpm=speed) for speed in (300.0, 900.0))
    assert (far < near).all()


@pytest.mark.parametrize("pole", [-0.5, 0.0, 0.3, 0.8])
@pytest.mark.parametrize("n_observers", [8, 64])
def test_every_observer_settles_equally_fast_and_is_certified(pole, n_observers, y):
    X = np.random.default_rng(0).normal(size=(70, 50))
    bank = ExtendedStatePIObserver(pole=pole, n_observers=n_observers).fit(X, y)
    radius = observer.spectral_radius(pole, 0.1, 0.028)
    for kp, ki, bound in zip(bank.kp_, bank.ki_, bank.bounds_, strict=True):
        assert_allclose(observer.spectral_radius(pole, kp, ki), radius, rtol=1e-6)
        assert bound > 0
        assert observer.meets_circle_criterion(pole, kp, ki, bound)


def test_saturation_limits_the_bounds(innovations, y):
    free, limited, linear = (
        ExtendedStatePIObserver(saturation=saturation).fit(innovations, y).bounds_
        for saturation in (100.0, 0.02, 0.0)
    )
    assert free.max() > 0.5
    assert limited.max() == 0.02
    assert np.all(linear == 0)


@pytest.mark.parametrize("make", OBSERVERS)
def test_type_layout_and_threads(make, innovations, y):
    single = innovations.astype(np.float32)
    single.flags.writeable = False
    residuals = make(n_observers=8).fit_transform(single, y)
    assert residuals.dtype == np.float32
    fortran = np.asfortranarray(single)
    assert_array_equal(make(n_observers=8).fit_transform(fortran, y), residuals)
    threads = make(n_observers=8, n_jobs=2).fit_transform(single, y)
    assert_array_equal(threads, residuals)


def test_trajectories_of_a_bank_are_those_of_its_observers(innovations, y):
    bank = ExtendedStatePIObserver(n_observers=4).fit(innovations, y)
    paths = bank.observe(innovations)
    mean = innovations.mean(axis=1, keepdims=True)
    for m, gains in enumerate(zip(bank.kp_, bank.ki_, bank.bounds_, strict=True)):
        error, estimate = observer.observe(mean, (bank.pole, *gains))
        assert_allclose(paths.error[:, m], error[:, 0])
        assert_allclose(paths.fault_estimate[:, m], estimate[:, 0])
    assert_array_equal(paths.sliding_surface, paths.fault_estimate)


@pytest.fixture(scope="module")
def windows():
    rng = np.random.default_rng(0)
    X = rng.normal(size=(60, 300))
    y = np.repeat(["good", "worn"], 30)
    X[30:, 1:] -= 0.4 * X[30:, :-1]
    return X, y


@pytest.mark.parametrize("kind", [Pipeline, DiagnosisPipeline])
@pytest.mark.parametrize("observe", [ExtendedStatePIObserver(), PIObserver()], ids=str)
def test_three_typed_steps_are_a_classifier(kind, observe, windows):
    X, y = windows
    train = np.arange(60) % 2 == 0
    diagnoser = typed(observe, kind).fit(X[train], y[train])
    assert diagnoser.score(X[~train], y[~train]) > 0.8
    tables = typed(observe, kind).set_output(transform="pandas").fit(X, y)
    residuals = tables[:-1].transform(X)
    assert residuals.columns.tolist() == ["good", "worn"]
    assert tables["decide"].feature_names_in_.tolist() == ["good", "worn"]


@pytest.mark.parametrize("gain", ["ki", "kp", "saturation"])
def test_a_search_over_gains_changes_the_score_and_refuses_unstable_ones(gain, windows):
    X, y = windows
    X = X + 2 * np.random.default_rng(1).normal(size=X.shape)
    values = {"ki": [0.005, 0.2], "kp": [-0.2, 0.6], "saturation": [0.0, 5.0]}[gain]
    unstable = {"ki": [2.0], "kp": [3.0], "saturation": []}[gain]
    grid = {f"observe__{gain}": [*values, *unstable]}
    search = GridSearchCV(typed(ExtendedStatePIObserver(), order=4), grid, cv=3)
    if unstable:
        with (
            pytest.warns(match="The observer is unstable: with pole=0.3"),
            pytest.warns(match="non-finite"),
        ):
            search.fit(X, y)
    else:
        search.fit(X, y)
    scores = search.cv_results_["mean_test_score"]
    assert scores[0] != scores[1]
    assert np.isnan(scores[2:]).all()


def test_raw_windows_of_several_channels_are_refused_with_a_way_out():
    X = np.random.default_rng(0).normal(size=(30, 2, 100))
    y = np.repeat(["a", "b", "c"], 10)
    for make in OBSERVERS:
        with pytest.raises(ValueError, match=r"models in X: 2, .*put ARXLaguerre"):
            make().fit(X, y)
    with pytest.raises(ValueError, match="requires y"):
        ExtendedStatePIObserver().fit(X)


@pytest.mark.parametrize("make", OBSERVERS)
def test_an_interrupted_fit_leaves_the_observer_as_it_was(
    make, innovations, y, monkeypatch
):
    bank = make(n_observers=8).fit(innovations, y)
    before = bank.transform(innovations)

    def interrupted(*args, **kwargs):
        raise KeyboardInterrupt

    monkeypatch.setattr(SpectralDistance, "fit", interrupted)
    with pytest.raises(KeyboardInterrupt):
        bank.fit(innovations[:, :1, :50], y)
    assert_array_equal(bank.transform(innovations), before)
