"""Weights of windows and prior probabilities of conditions."""

import numpy as np
import pytest
import sklearn
from scipy.signal import lfilter
from sklearn.pipeline import make_pipeline

from skarxlag import ARXLaguerre, PIObserver, ThresholdLadder, make_alpio
from skarxlag.kernels.ladder import false_alarm_threshold, weighted_median

WEIGHTS = np.array([0, 1, 2, 3, 1, 0, 2, 1, 1, 4, 1, 2])


@pytest.fixture(scope="module")
def windows():
    X = np.random.default_rng(0).normal(size=(12, 200))
    return np.concatenate([lfilter([1], [1, -0.9], X[:6]), lfilter([1], [1, 0.5], X[6:])])


@pytest.fixture(scope="module")
def conditions():
    return np.repeat(["healthy", "worn"], 6)


@pytest.mark.parametrize("settings", [{}, {"pole": "optimise"}, {"healthy": "worn"}], ids=str)
def test_identification_counts_a_window_as_often_as_its_weight_says(windows, conditions, settings):
    model = ARXLaguerre(order=4, **settings)
    weighted = model.fit(windows, conditions, sample_weight=WEIGHTS).coef_
    noise_level, poles = model.noise_level_, model.poles_
    rows = np.repeat(np.arange(12), WEIGHTS)
    model.fit(windows[rows], conditions[rows])
    np.testing.assert_allclose(weighted, model.coef_, rtol=1e-6)
    np.testing.assert_allclose(noise_level, model.noise_level_, rtol=1e-6)
    np.testing.assert_allclose(poles, model.poles_, rtol=1e-5)
    model.fit(windows, conditions)
    assert not np.allclose(weighted, model.coef_, rtol=1e-3)


def test_weights_by_parts_are_those_of_the_whole(windows, conditions):
    whole = ARXLaguerre(order=4).fit(windows, conditions, WEIGHTS)
    parts = ARXLaguerre(order=4)
    for batch in (slice(0, 5), slice(5, 12)):
        parts.partial_fit(windows[batch], conditions[batch], WEIGHTS[batch])
    np.testing.assert_allclose(parts.coef_, whole.coef_, rtol=1e-9)


def test_ladder_counts_a_window_as_often_as_its_weight_says():
    rng = np.random.default_rng(0)
    y = np.arange(60) % 3
    weights = rng.integers(0, 4, 60)
    rows = np.repeat(np.arange(60), weights)
    for n_residuals in (1, 3):
        X = rng.lognormal(size=(60, n_residuals)) * (1 + y[:, np.newaxis])
        settings = {"false_alarm_rate": 0.2}
        weighted = ThresholdLadder(**settings).fit(X, y, sample_weight=weights)
        repeated = ThresholdLadder(**settings).fit(X[rows], y[rows])
        for name in ("detection_threshold_", "isolation_thresholds_", "rungs_"):
            np.testing.assert_array_equal(getattr(weighted, name), getattr(repeated, name))
        assert weighted.confidence_scale_ == pytest.approx(repeated.confidence_scale_, rel=1e-5)


@pytest.mark.parametrize("weights", [[1, 1, 1], [2, 1, 1], [1, 3, 2], [5, 1, 1]])
def test_weighted_order_statistics_are_those_of_repeated_levels(weights):
    levels = np.array([2.0, 7.0, 4.0])
    repeated = np.repeat(levels, weights)
    weights = np.array(weights, dtype=float)
    assert weighted_median(levels, weights) == np.median(repeated)
    for rate in (0.05, 0.3, 0.5, 0.8):
        found = false_alarm_threshold(levels, rate, 0.0, weights)
        assert found == false_alarm_threshold(repeated, rate, 0.0)


@pytest.mark.parametrize("estimator", [ARXLaguerre(order=4), ThresholdLadder()], ids=str)
@pytest.mark.parametrize(
    ("weights", "message"),
    [
        (-np.ones(12), "sample_weight has -1, expected weights of at least 0"),
        (np.zeros(12), "All weights in sample_weight are zero"),
        (np.ones(11), r"shape \(11,\), expected one weight for each of 12 windows"),
        (np.ones((12, 1)), r"shape \(12, 1\)"),
        (np.full(12, np.nan), "sample_weight contains NaN"),
    ],
)
def test_bad_weights_are_refused(windows, conditions, estimator, weights, message):
    with pytest.raises(ValueError, match=message):
        estimator.fit(windows, conditions, sample_weight=weights)


def test_a_pipeline_hands_weights_to_its_steps_by_name_and_by_routing(windows, conditions):
    by_name = make_alpio().fit(
        windows, conditions, identify__sample_weight=WEIGHTS, decide__sample_weight=WEIGHTS
    )
    assert not np.allclose(by_name[0].coef_, make_alpio().fit(windows, conditions)[0].coef_)
    with sklearn.config_context(enable_metadata_routing=True):
        routed = make_pipeline(
            ARXLaguerre().set_fit_request(sample_weight=True),
            PIObserver(),
            ThresholdLadder().set_fit_request(sample_weight=True),
        ).fit(windows, conditions, sample_weight=WEIGHTS)
    np.testing.assert_array_equal(routed[0].coef_, by_name[0].coef_)
    np.testing.assert_array_equal(
        routed[-1].isolation_thresholds_, by_name[-1].isolation_thresholds_
    )


@pytest.mark.parametrize("n_residuals", [1, 3])
def test_priors_multiply_the_confidence_as_bayes_says(n_residuals):
    rng = np.random.default_rng(0)
    y = np.arange(60) % 3
    X = rng.lognormal(size=(60, n_residuals)) * (1 + y[:, np.newaxis])
    priors = np.array([0.7, 0.2, 0.1])
    even = ThresholdLadder().fit(X, y)
    informed = ThresholdLadder(priors=priors).fit(X, y)
    expected = priors * even.predict_proba(X)
    expected /= expected.sum(axis=1, keepdims=True)
    np.testing.assert_allclose(informed.predict_proba(X), expected, rtol=1e-9)
    np.testing.assert_array_equal(informed.predict(X), expected.argmax(axis=1))
    np.testing.assert_array_equal(informed.decision_function(X).argmax(axis=1), informed.predict(X))
    assert (informed.predict(X) == 0).sum() > (even.predict(X) == 0).sum()
    np.testing.assert_array_equal(informed.isolation_thresholds_, even.isolation_thresholds_)
    np.testing.assert_array_equal(even.priors_, [1 / 3] * 3)


@pytest.mark.parametrize(
    "priors", [[0.5, 0.5, 0.5], [1.0, 0.0], [1.2, -0.2], [0.5, np.nan], [[0.5, 0.5]], 1.0]
)
def test_bad_priors_are_refused(priors):
    with pytest.raises(ValueError, match=r"priors=.*expected 2 probabilities above 0 that sum"):
        ThresholdLadder(priors=priors).fit([[1.0], [2.0]], ["a", "b"])
