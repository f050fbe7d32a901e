import numpy as np

from skarxlag.kernels.group_means import group_means


def test_means_are_those_of_repeated_rows():
    rng = np.random.default_rng(0)
    values, group = rng.normal(size=(20, 3, 2)), np.arange(20) % 3
    weights = rng.integers(1, 5, 20)
    rows = np.repeat(np.arange(20), weights)
    repeated = [values[rows][group[rows] == number].mean(axis=0) for number in range(3)]
    np.testing.assert_allclose(group_means(values, group, weights), repeated, rtol=1e-12)
