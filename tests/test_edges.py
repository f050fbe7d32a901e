"""Poles next to the unit circle and gains next to instability: finite results or a refusal."""

import numpy as np
import pytest
from scipy.signal import lfilter

from skarxlag import (
    ARXLaguerre,
    ExtendedStatePIObserver,
    PIObserver,
    make_diagnoser,
)

RNG = np.random.default_rng(0)
X = lfilter([1], [1, -0.9], RNG.normal(size=(12, 400)))
NEXT_TO_1 = float(np.nextafter(1, 0))
POLES = [0.999, NEXT_TO_1, -NEXT_TO_1, 5e-324]


@pytest.mark.parametrize("pole", POLES)
@pytest.mark.parametrize("order", [1, 100])
def test_models_with_such_poles_predict_no_worse_than_none(pole, order):
    for rows in (X, np.stack([X, X[::-1]], axis=1), 1e150 * X, 1e-150 * X):
        model = ARXLaguerre(order=order, pole=pole).fit(rows)
        innovations = model.transform(rows)
        assert np.isfinite(model.coef_).all() and np.isfinite(innovations).all()
        # Rows have the variance 1 after scaling, also within the model.
        assert innovations.var() < 1.1


@pytest.mark.parametrize("pole", [1.0, -1.0, float(np.nextafter(1, 2)), np.nan, np.inf])
@pytest.mark.parametrize("kind", [ARXLaguerre, PIObserver, ExtendedStatePIObserver])
def test_poles_on_the_unit_circle_are_refused(kind, pole):
    with pytest.raises(ValueError, match="pole == "):
        kind(pole=pole).fit(X)


def beside(value):
    """Return a number, its neighbours, and numbers that differ in the tenth and third digit."""
    factors = [1, 1 - 1e-10, 1 + 1e-10, 0.999, 1.001]
    return [
        np.nextafter(value, -9),
        np.nextafter(value, 9),
        *(value * each for each in factors),
    ]


def levels(observer, rows):
    """Residual levels and trajectories, or None if the observer is refused."""
    try:
        fitted = observer.fit(rows, np.arange(len(rows)) % 2)
    except ValueError as error:
        assert "is unstable" in str(error)
        return None
    of_rows = fitted.transform(rows)
    assert np.isfinite(of_rows).all()
    return of_rows


@pytest.mark.parametrize("pole", [0.3, NEXT_TO_1, -NEXT_TO_1])
def test_a_pi_observer_at_the_edge_is_finite_or_refused(pole):
    rows, results = np.tile(X, 50), []
    for kp in (0.1, 0.0, 1e-300):
        # With a = pole - kp it is stable if a + ki < 1 and 2 (1 + a) + ki > 0.
        for ki in beside(1 - pole + kp):
            results += [levels(PIObserver(pole=pole, kp=kp, ki=max(ki, 0)), rows)]
    for kp in beside(1 + pole) + beside(pole - 1):
        results += [levels(PIObserver(pole=pole, kp=kp, ki=0.0), rows)]
    assert any(each is None for each in results) and not all(
        each is None for each in results
    )


@pytest.mark.parametrize("saturation", [0.0, 2.0, 1e100])
def test_an_extended_observer_at_the_edge_is_finite_or_refused(saturation):
    rows, results = np.tile(X, 20), []
    options = {"n_observers": 1, "saturation": saturation}
    for pole in (0.3, NEXT_TO_1, -NEXT_TO_1):
        edge = 1 - pole + 0.1
        for ki in [1e-300, 0.1 * edge, *beside(edge)]:
            observer = ExtendedStatePIObserver(pole=pole, ki=ki, **options)
            results.append(levels(observer, rows))
    refused = [each is None for each in results]
    assert any(refused) and not all(refused)


def test_windows_of_one_channel_may_have_three_axes():
    """Arrays of aeon have the shape (n, 1, T); further channels are inputs."""
    X = np.random.default_rng(0).normal(size=(20, 300))
    y = np.repeat(["good", "worn"], 10)
    X[10:] = X[10:].cumsum(axis=1)
    flat = make_diagnoser().fit(X, y).predict_proba(X)
    of_channels = make_diagnoser().fit(X[:, np.newaxis], y)
    np.testing.assert_array_equal(of_channels.predict_proba(X[:, np.newaxis]), flat)
