import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skarxlag import OrderResidual
from skarxlag.distances import orders

from ..impacts import RATE, stretches


@pytest.fixture(scope="module")
def fitted():
    return OrderResidual(sampling_rate=RATE).fit(*stretches(900), rpm=900)


def verdicts(residual, X, **kwargs):
    return residual.classes_[residual.transform(X, **kwargs).argmin(axis=1)]


@pytest.mark.parametrize("rpm", [500, 700, 1300])
def test_strikes_are_recognised_at_another_speed(fitted, rpm):
    X, y = stretches(rpm, seed=1)
    assert_array_equal(verdicts(fitted, X, rpm=rpm), y)
    assert_array_equal(verdicts(fitted, X, rpm=np.full(8, rpm)), y)


def test_pattern_is_recognised_without_a_speed(fitted):
    X, y = stretches(600, seed=3)
    found = fitted.match(X)
    assert_array_equal(fitted.classes_[found.residuals.argmin(axis=1)], y)
    nowhere = OrderResidual().fit(*stretches(1200))
    assert len(nowhere.speeds_) == 0
    assert nowhere.samples_per_revolution_ == pytest.approx(RATE / 20)
    X, y = stretches(900, seed=3)
    assert_array_equal(verdicts(nowhere, X), y)


def test_match_shows_the_spectra_that_were_compared(fitted):
    X, _ = stretches(700, seed=2)
    found = fitted.match(X, rpm=700)
    assert found.spectra.shape == (8, 2, 4, len(fitted.orders_))
    factor = max(np.log(900 / 700) / 0.4, 0.2)
    squares = (found.spectra - fitted.references_) ** 2 / (fitted.variances_ + factor)
    unlikely = (np.log(found.factors) / 0.1) ** 2 / 50
    expected = np.sqrt(squares.mean(axis=(2, 3)) + unlikely)
    assert_allclose(found.residuals, expected, rtol=1e-6)
    assert fitted.orders_[[0, -1]] == pytest.approx([0.3, 16.0])


def test_references_are_means_and_variances_of_the_training_stretches(
    fitted, monkeypatch
):
    monkeypatch.setattr(orders, "_SPEED_TOLERANCE", 0.0)
    X, y = stretches(900)
    spectra = fitted.match(X, rpm=900).spectra[:, 0]
    for c, name in enumerate(fitted.classes_):
        assert_allclose(fitted.references_[c], spectra[y == name].mean(axis=0))
    deviation = spectra - fitted.references_[np.searchsorted(fitted.classes_, y)]
    assert_allclose(fitted.variances_, np.mean(deviation**2, axis=0))


def test_drift_counts_in_full_where_the_speed_is_not_given(fitted):
    X, _ = stretches(900, seed=2)
    found = fitted.match(X)
    squares = (found.spectra - fitted.references_) ** 2 / (fitted.variances_ + 1)
    unlikely = (2 * np.log(found.factors) / np.log(2.5)) ** 2 / 50
    expected = np.sqrt(squares.mean(axis=(2, 3)) + unlikely)
    # Factors of other conditions may move orders out of the spectrum.
    best = np.arange(len(X)), found.residuals.argmin(axis=1)
    assert_allclose(found.residuals[best], expected[best], rtol=1e-6)


def test_speed_that_varies_in_a_stretch_is_tracked(fitted):
    rpm = np.linspace(500, 1000, RATE)
    X, y = stretches(rpm, seed=4)
    tracked = fitted.transform(X, rpm=np.tile(rpm, (8, 1)))
    assert_array_equal(fitted.classes_[tracked.argmin(axis=1)], y)
    assert np.all(tracked.min(axis=1) < fitted.transform(X, rpm=rpm.mean()).min(axis=1))
    constant = fitted.transform(X, rpm=np.full((8, RATE), 700.0))
    assert_allclose(constant, fitted.transform(X, rpm=700), rtol=1e-3)
    # Innovations lack the first samples.
    innovations = OrderResidual(sampling_rate=RATE).fit(
        X[:, np.newaxis], y, rpm=rpm.mean()
    )
    assert_array_equal(
        innovations.transform(X[:, np.newaxis, 500:], rpm=np.tile(rpm, (8, 1))),
        innovations.transform(X[:, np.newaxis, 500:], rpm=np.tile(rpm[500:], (8, 1))),
    )


def test_innovations_of_several_models_are_refused():
    X, y = stretches(900)
    one = OrderResidual(sampling_rate=RATE).fit(X[:, np.newaxis], y, rpm=900)
    alone = OrderResidual(sampling_rate=RATE).fit(X, y, rpm=900)
    assert_array_equal(one.references_, alone.references_)
    with pytest.raises(ValueError, match="models in X: 2, expected 1"):
        one.fit(np.stack([X, X], axis=1), y, rpm=900)


def test_sampling_rate_is_the_unit_of_the_speed(fitted):
    X, y = stretches(900)
    # Twice the rate makes every stretch half as many turns: 600 rpm look like 1200.
    twice = OrderResidual(sampling_rate=2 * RATE).fit(X, y, rpm=1800)
    assert_allclose(twice.transform(X, rpm=1400), fitted.transform(X, rpm=700))


@pytest.mark.parametrize(
    ("rpm", "message"),
    [
        (0, "rpm of row 0: 0"),
        (np.r_[[900.0] * 7, -1], "rpm of row 7: -1"),
        (np.r_[np.nan, [900.0] * 7], "rpm of row 0: nan"),
        ("fast", "rpm must hold numbers"),
        (np.full(5, 900), r"shape == \(5,\), expected one speed for each of 8 rows"),
        (np.full((8, 100), 900), r"or for each of their 8000 samples"),
        (
            100,
            r"at 100 rpm and 8000 Hz: 1\.667, expected at least 2.85, or 13680 samples",
        ),
        ([900] * 7 + [100], "expected at least 2.85, or 13680 samples"),
    ],
)
def test_speeds_that_cannot_be(fitted, rpm, message):
    X, y = stretches(900)
    with pytest.raises(ValueError, match=message):
        fitted.match(X, rpm=rpm)
    with pytest.raises(ValueError, match=message):
        OrderResidual(sampling_rate=RATE).fit(X, y, rpm=rpm)


def test_speeds_without_what_they_need():
    X, y = stretches(900, n=1)
    with pytest.raises(
        ValueError, match="sampling_rate is missing, expected a number in Hz"
    ):
        OrderResidual().fit(X, y, rpm=900)
    with pytest.raises(ValueError, match="sampling_rate == 0"):
        OrderResidual(sampling_rate=0.0).fit(X, y)


def test_stretches_too_short_for_orders_say_nothing_without_a_speed():
    plain = OrderResidual().fit(
        np.random.default_rng(0).normal(size=(4, 20)), [0, 0, 1, 1]
    )
    assert_array_equal(plain.transform(np.ones((1, 20))), [[1.0, 1.0]])
