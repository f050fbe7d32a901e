import numpy as np
import pytest

from skarxlag.kernels.distinct import distinct_windows


@pytest.mark.parametrize("n_samples", [1, 2, 50])
def test_repeated_and_weighted_windows_are_the_same_rows_in_the_same_order(n_samples):
    rng = np.random.default_rng(0)
    windows, weights = rng.normal(size=(30, 2, n_samples)), rng.integers(1, 4, 30)
    order = rng.permutation(30)
    rows, counted = distinct_windows(windows[order], weights[order].astype(float))
    repeated = np.repeat(windows, weights, axis=0)
    places, times = distinct_windows(repeated, np.ones(len(repeated)))
    np.testing.assert_array_equal(windows[order][rows], repeated[places])
    np.testing.assert_array_equal(counted, times)


def test_windows_of_equal_keys_that_differ_elsewhere_are_kept_apart():
    windows = np.zeros((3, 1, 100))
    windows[1, 0, 7] = 1.0
    rows, counted = distinct_windows(windows, np.ones(3))
    assert counted.sum() == 3
    assert {1} < set(rows.tolist())


def test_windows_that_differ_stay_as_they_come():
    windows = np.random.default_rng(0).normal(size=(9, 1, 20))
    rows, counted = distinct_windows(windows, np.ones(9))
    np.testing.assert_array_equal(rows, np.arange(9))
    np.testing.assert_array_equal(counted, np.ones(9))
