import numpy as np
import pytest
from scipy import linalg

from skarxlag.kernels.healthy_limits import Limits, log_p_values
from skarxlag.kernels.healthy_rows import Rows
from skarxlag.kernels.speed_references import (
    SAME_LOG_SPEED,
    UNIT_DISTANCE,
    drift_learned,
    group_means,
    group_speeds,
    mean_by_speed,
    reference_weights,
    slope_against_speed,
    speed_distance,
    speeds_to_try,
)


def kriging(x, known, drift_free=False):
    """Mean weights and variance of Brownian motion at x, by conditioning on the known values."""
    # Brownian motion with an unknown start: differences from the first known value.
    ends = known - known[0]

    def covariance(a, b):
        a, b = np.subtract.outer(a, 0.0), b
        same = np.sign(a)[:, None] == np.sign(b)[None, :]
        return np.where(same, np.minimum(np.abs(a)[:, None], np.abs(b)[None, :]), 0.0)

    at = np.atleast_1d(x - known[0])
    rest = ends[1:]
    cross, own = covariance(at, rest), covariance(at, at)
    inverse = linalg.inv(covariance(rest, rest)) if len(rest) else np.empty((0, 0))
    return cross @ inverse, float(np.diag(own - cross @ inverse @ cross.T)[0])


@pytest.mark.parametrize("x", [-0.5, 0.0, 0.05, 0.2, 0.31, 0.7, 1.4])
@pytest.mark.parametrize("known", [[0.0], [0.0, 0.3], [0.0, 0.3, 0.7, 1.0]])
def test_expectation_and_variance_are_those_of_brownian_motion(x, known):
    known = np.array(known)
    values = np.random.default_rng(0).normal(size=len(known))
    at = speed_distance(np.array([x]), known)
    weights, variance = kriging(x, known)
    expected = values[0] + (weights @ (values[1:] - values[0])).sum()
    np.testing.assert_allclose(at.interpolate(values), expected, atol=1e-12)
    np.testing.assert_allclose(at.variance, variance / UNIT_DISTANCE, atol=1e-12)
    np.testing.assert_allclose(at.beyond, x - np.clip(x, known[0], known[-1]))


def test_rows_of_features_are_interpolated_too():
    at = speed_distance(np.array([0.5, 2.0]), np.array([0.0, 1.0]))
    np.testing.assert_allclose(
        at.interpolate(np.array([[0.0, 2.0], [4.0, 0.0]])), [[2, 1], [4, 0]]
    )


def test_speeds_that_hardly_differ_are_one():
    known, at = group_speeds(np.log([1500, 1000, 1010, 1019, 1021, 1500.0]))
    np.testing.assert_array_equal(at, [2, 0, 0, 0, 1, 2])
    np.testing.assert_allclose(known[0], np.log([1000, 1010, 1019]).mean())


def test_slope_is_that_of_a_regression_on_increments():
    # Increments of Brownian motion are independent: generalised least squares with a
    # prior.
    rng = np.random.default_rng(0)
    known, values = np.array([0.3, 0.4, 0.8, 1.2]), rng.normal(size=4)
    mean, deviation, drift = 1.5, 0.75, 0.3
    steps = np.diff(known)
    noise = drift**2 * steps / UNIT_DISTANCE
    precision = 1 / deviation**2 + np.sum(steps**2 / noise)
    expected = (
        mean / deviation**2 + np.sum(steps * np.diff(values) / noise)
    ) / precision
    slope, variance = slope_against_speed(
        values, known, mean=mean, deviation=deviation, drift=drift
    )
    assert slope == pytest.approx(expected)
    assert variance == pytest.approx(1 / precision)


def test_a_group_spans_as_much_as_is_stated():
    _, at = group_speeds(np.array([0.0, SAME_LOG_SPEED]))
    assert at.tolist() == [0, 0]
    _, at = group_speeds(np.array([0.0, np.nextafter(SAME_LOG_SPEED, 1)]))
    assert at.tolist() == [0, 1]


def test_drift_at_one_speed_is_9_percent_of_that_over_the_unit_distance():
    one, none = np.ones(1), np.zeros((1, 0))
    cepstra, no_scatter = np.zeros((1, 1)), np.zeros(1)
    limits = Limits(
        no_scatter, np.eye(1), no_scatter, cepstra, none, none, none[0], 0.0, 1.0, 5
    )
    # Changes of the deviation that each of the two is expected to have are equally
    # probable.
    changes = np.sqrt([0.09, 1.09]).reshape(2, 1, 1)
    rows = Rows(one, one, changes, np.zeros((2, 0)))
    found = log_p_values(limits, rows, np.array([0.0, np.log(1.3)]), 1.0)
    np.testing.assert_allclose(found[0], found[1], rtol=1e-10)
    assert found[0] < 0


def test_means_are_those_of_repeated_rows():
    rng = np.random.default_rng(0)
    values, group = rng.normal(size=(20, 3, 2)), np.arange(20) % 3
    weights = rng.integers(1, 5, 20)
    rows = np.repeat(np.arange(20), weights)
    repeated = [values[rows][group[rows] == number].mean(axis=0) for number in range(3)]
    np.testing.assert_allclose(
        group_means(values, group, weights), repeated, rtol=1e-12
    )


def test_means_by_speed_and_group_have_the_axes_of_the_rows():
    rng = np.random.default_rng(0)
    values, weights = rng.normal(size=(12, 2, 3)), rng.uniform(1, 2, 12)
    speed, group = np.repeat([0, 1], 6), np.array([0, 0, 0, 1, 1, 1, 0, 0, 0, 0, 0, 0])
    means, recorded = mean_by_speed(values, speed, group, weights)
    assert means.shape == (2, 2, 2, 3)
    assert recorded.tolist() == [[True, True], [True, False]]
    for q, g in np.argwhere(recorded):
        own = (speed == q) & (group == g)
        np.testing.assert_allclose(
            means[q, g], np.average(values[own], axis=0, weights=weights[own])
        )
    np.testing.assert_array_equal(means[1, 1], 0)


def test_weights_interpolate_the_means_of_the_speeds_at_which_a_condition_was_recorded():
    rng = np.random.default_rng(0)
    known, means = np.array([0.0, 0.3, 1.0]), rng.normal(size=(3, 3, 4))
    recorded = np.array([[True, True, False], [True, False, True], [True, True, False]])
    log_speed = np.array([-0.2, 0.1, 0.3, 0.8, 1.5])
    weights, variance = reference_weights(log_speed, known, recorded)
    found = np.einsum("skc,kcf->scf", weights, means)
    for c in range(3):
        own = recorded[:, c]
        for f in range(4):
            expected = np.interp(log_speed, known[own], means[own, c, f])
            np.testing.assert_allclose(found[:, c, f], expected, atol=1e-12)
    widest = [speed_distance(log_speed, known[own]).variance for own in recorded.T]
    np.testing.assert_array_equal(variance, np.max(widest, axis=0))


def test_learned_drift_has_the_axes_of_the_means():
    known, means = (
        np.array([0.0, 0.2, 0.5]),
        np.random.default_rng(0).normal(size=(3, 2, 4, 5)),
    )
    # The second condition was recorded at the two upper speeds only.
    recorded = np.array([[True, False], [True, True], [True, True]])
    found = drift_learned(known, means, recorded)
    assert found.shape == (5, 4, 5)
    # Between two speeds the prior holds for 0.4 of log speed, of which at least a fifth
    # counts.
    inside = means[1, 0] - (0.6 * means[0, 0] + 0.4 * means[2, 0])
    np.testing.assert_allclose(found[1], inside / np.sqrt(0.2 * 0.3 / 0.5 / 0.4))
    outside = means[2, 1] - means[1, 1]
    np.testing.assert_allclose(found[4], outside / np.sqrt(0.3 / 0.4))


def test_speeds_to_try_are_the_known_ones_and_their_middles():
    np.testing.assert_allclose(
        speeds_to_try(np.array([0.0, 1.0, 3.0])), [0, 0.5, 1, 2, 3]
    )
    np.testing.assert_array_equal(speeds_to_try(np.array([2.0])), [2.0])
