import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skarxlag.kernels.least_squares import distinct_windows, solve_sums


def sums_of(states, output):
    both = np.column_stack([states, output])
    return both.T @ both


@pytest.fixture
def data():
    rng = np.random.default_rng(0)
    states = rng.normal(size=(80, 4))
    return states, states @ [1.0, -2.0, 0.5, 0.0] + 0.3 * rng.normal(size=80)


@pytest.mark.parametrize("alpha", [0.0, 0.1, 10.0])
def test_ridge_is_least_squares_on_augmented_rows(data, alpha):
    states, output = data
    rows = np.vstack([states, np.sqrt(alpha) * np.eye(4)])
    expected = np.linalg.lstsq(rows, np.append(output, np.zeros(4)), rcond=None)[0]
    coef, error = solve_sums(sums_of(states, output), alpha)
    assert_allclose(coef, expected, rtol=1e-10)
    # The ridge is not part of the error that it reports.
    assert_allclose(error, np.sum((output - states @ expected) ** 2), rtol=1e-9)


def test_without_excitation_the_coefficients_of_least_norm_are_returned():
    states = np.ones((5, 2))
    coef, error = solve_sums(sums_of(states, np.ones(5)), 0.0)
    assert_allclose(coef, [0.5, 0.5])
    assert error == pytest.approx(0, abs=1e-12)
    assert_array_equal(solve_sums(np.zeros((4, 4)), 0.0)[0], np.zeros(3))


@pytest.mark.parametrize("forgetting_factor", [1.0, 0.9])
def test_recursion_16_repaired_ends_at_the_same_coefficients(data, forgetting_factor):
    states, output = data
    alpha = 0.5
    n = len(output)
    # The ridge does not fade in the sums; in the recursion it does, so it starts larger
    # there.
    P = np.eye(4) / (alpha / forgetting_factor**n)
    K = np.zeros(4)
    for x, y in zip(states, output, strict=True):
        P = (
            P - np.outer(P @ x, x @ P) / (forgetting_factor + x @ P @ x)
        ) / forgetting_factor
        K = K + P @ x * (y - K @ x)
    fading = np.sqrt(forgetting_factor ** np.arange(n - 1, -1, -1.0))
    coef, _ = solve_sums(
        sums_of(states * fading[:, np.newaxis], output * fading), alpha
    )
    assert_allclose(coef, K, rtol=1e-8)


@pytest.mark.parametrize("n_samples", [1, 2, 50])
def test_repeated_and_weighted_windows_are_the_same_rows_in_the_same_order(n_samples):
    rng = np.random.default_rng(0)
    windows, weights = rng.normal(size=(30, 2, n_samples)), rng.integers(1, 4, 30)
    order = rng.permutation(30)
    rows, counted = distinct_windows(windows, order, weights[order].astype(float))
    repeated = np.repeat(windows, weights, axis=0)
    places, times = distinct_windows(
        repeated, np.arange(len(repeated)), np.ones(len(repeated))
    )
    assert_array_equal(windows[rows], repeated[places])
    assert_array_equal(counted, times)


def test_windows_of_equal_keys_that_differ_elsewhere_are_kept_apart():
    windows = np.zeros((3, 1, 100))
    windows[1, 0, 7] = 1.0
    rows, counted = distinct_windows(windows, np.arange(3), np.ones(3))
    assert sorted(counted) == [1, 2]
    assert 1 in rows.tolist()
