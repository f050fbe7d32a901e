"""Weights of windows."""

import numpy as np
import pytest
import sklearn
from scipy.signal import lfilter
from sklearn.base import clone

from skarxlag import (
    ARXLaguerre,
    FaultDetector,
    LogSpectra,
    OrderResidual,
    SpectralDistance,
    StretchResidual,
    ThresholdLadder,
    make_alpio,
    make_diagnoser,
)

WEIGHTS = np.array([0, 1, 2, 3, 1, 0, 2, 1, 1, 4, 1, 2])


@pytest.fixture(scope="module")
def windows():
    X = np.random.default_rng(0).normal(size=(12, 200))
    return np.concatenate(
        [lfilter([1], [1, -0.9], X[:6]), lfilter([1], [1, 0.5], X[6:])]
    )


@pytest.fixture(scope="module")
def conditions():
    return np.repeat(["healthy", "worn"], 6)


@pytest.mark.parametrize(
    "settings", [{}, {"pole": "optimise"}, {"healthy": "worn"}], ids=str
)
def test_identification_counts_a_window_as_often_as_its_weight_says(
    windows, conditions, settings
):
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


SPEEDS = {"rpm": np.linspace(500, 700, 12)}
ORDERS = OrderResidual(sampling_rate=100)
RESIDUALS = {
    "compare": (SpectralDistance(), {}),
    "orders": (ORDERS, SPEEDS),
    "stretches": (StretchResidual(order_residual=ORDERS, window_length=90), SPEEDS),
    "no rpm": (StretchResidual(window_length=90), {}),
}


@pytest.fixture(params=RESIDUALS)
def residual(request, windows):
    """A residual, rows for it, and their metadata."""
    estimator, metadata = RESIDUALS[request.param]
    is_of_spectra = isinstance(estimator, SpectralDistance)
    X = LogSpectra().fit_transform(windows) if is_of_spectra else windows
    return estimator, X, metadata


def test_residuals_count_a_window_as_often_as_its_weight_says(residual, conditions):
    estimator, X, metadata = residual
    rows = np.repeat(np.arange(12), WEIGHTS)
    of_rows = {key: value[rows] for key, value in metadata.items()}
    repeated = clone(estimator).fit(X[rows], conditions[rows], **of_rows)
    expected = repeated.transform(X, **metadata)
    weighted = {"sample_weight": WEIGHTS} | metadata
    at_once = clone(estimator).fit_transform(X, conditions, **weighted)
    np.testing.assert_allclose(at_once, expected, rtol=1e-9)
    plain = clone(estimator).fit_transform(X, conditions, **metadata)
    assert not np.allclose(plain, expected, rtol=1e-2)


def test_a_condition_whose_windows_all_weigh_nothing_is_none(residual):
    estimator, X, metadata = residual
    y = np.repeat(["a", "b", "c"], 4)
    weights = (y != "b").astype(float)
    fitted = clone(estimator).fit(X, y, sample_weight=weights, **metadata)
    assert fitted.classes_.tolist() == ["a", "c"]
    assert fitted.transform(X, **metadata).shape == (12, 2)


@pytest.mark.parametrize(
    ("weights", "message"),
    [
        (
            -np.ones(12),
            r"sample_weight == array\(\[-1., .* expected weights of at least",
        ),
        (np.zeros(12), "sample_weight == .*, not all of them zero"),
        (
            np.ones(11),
            r"shape == \(11,\), expected \(12,\), one weight for each window",
        ),
        (np.full(12, np.nan), "sample_weight contains NaN"),
    ],
)
def test_bad_weights_are_refused(windows, conditions, weights, message):
    for kind in (ThresholdLadder, SpectralDistance, OrderResidual, FaultDetector):
        with pytest.raises(ValueError, match=message):
            kind().fit(windows, conditions, sample_weight=weights)


@pytest.mark.parametrize("routing", [False, True])
@pytest.mark.parametrize("make", [make_diagnoser, make_alpio])
def test_weights_reach_every_step_of_a_diagnoser(windows, conditions, make, routing):
    rows = np.repeat(np.arange(12), WEIGHTS)
    with sklearn.config_context(enable_metadata_routing=routing):
        weighted = make().fit(windows, conditions, sample_weight=WEIGHTS)
    repeated = make().fit(windows[rows], conditions[rows])
    expected = repeated.predict_proba(windows)
    np.testing.assert_allclose(weighted.predict_proba(windows), expected, rtol=1e-6)
    plain = make().fit(windows, conditions).predict_proba(windows)
    assert not np.allclose(plain, expected, rtol=1e-2)


@pytest.mark.filterwarnings("ignore:.* healthy rows are too few:UserWarning")
def test_means_of_a_detector_are_those_of_repeated_rows():
    X, rpm = np.random.default_rng(0).normal(size=(80, 400)), np.repeat([800, 1200], 40)
    X[::4] = lfilter([1], [1, -0.6], X[::4])
    weights = np.arange(80) % 3
    rows = np.repeat(np.arange(80), weights)
    weighted = FaultDetector().fit(X, rpm=rpm, sample_weight=weights)
    repeated = FaultDetector().fit(X[rows], rpm=rpm[rows])
    # Observations are counted, and those of weight 0 are left out.
    assert weighted.n_rows_ == np.sum(weights > 0)
    assert repeated.n_rows_ == weights.sum()
    np.testing.assert_allclose(weighted.means_, repeated.means_, rtol=1e-9)
    references = weighted.references_, repeated.references_
    np.testing.assert_allclose(*references, rtol=1e-9, atol=1e-12)
