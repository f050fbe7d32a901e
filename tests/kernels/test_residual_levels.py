import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skarxlag.kernels.observer import observe
from skarxlag.kernels.residual_levels import (
    adapt_switching_gain,
    settled_level,
    sliding_surface,
    switching_gain,
)

LOOP = (0.4, 0.3, 0.06, 1.2)


def switching_gain_levels(innovations, loop, slope, step):
    error, _ = observe(innovations, loop)
    surface = sliding_surface(error, slope).reshape(-1, error.shape[-1])
    return settled_level(switching_gain(surface, step)).reshape(error.shape[:2])


@pytest.mark.slow
@pytest.mark.parametrize("size", [0.0, 1e-300, 1e-160, 1e160, 1e300])
def test_levels_of_extreme_windows_stay_beside_ordinary_ones(size):
    linear = (*LOOP[:3], 0.0)
    innovations = np.random.default_rng(0).normal(size=(4, 2, 200))
    before = switching_gain_levels(innovations, linear, 10, 0.01)
    innovations[2] *= size
    after = switching_gain_levels(innovations, linear, 10, 0.01)
    assert_array_equal(after[[0, 1, 3]], before[[0, 1, 3]])
    assert_allclose(after[2], size * before[2], rtol=1e-10)


def test_sliding_surface_by_hand():
    error = np.array([[1.0, 4.0, 2.0]])
    assert_array_equal(sliding_surface(error, 2.0), [[2.0, 11.0, 2.0]])
    assert_array_equal(sliding_surface(error, 0.0), [[0.0, 3.0, -2.0]])


@pytest.mark.parametrize("draw", ["normal", "laplace", "uniform"])
def test_switching_gain_settles_at_the_median_of_the_surface(draw):
    surface = getattr(np.random.default_rng(0), draw)(size=(2, 200_000))
    level = settled_level(switching_gain(surface, 0.01))
    assert_allclose(level, np.median(np.abs(surface), axis=1), rtol=0.03)


def test_settled_level_is_the_geometric_mean_of_the_last_half():
    gain = np.array([[9.0, 9.0, 1.0, 4.0], [0.0, 0.0, 0.0, 0.0]])
    assert_allclose(settled_level(gain), [2.0, 0.0])
    assert_allclose(settled_level(np.array([[5.0]])), [5.0])
    rising = np.arange(1.0, 101.0)
    expected = np.exp(np.mean(np.log(rising[50:])))
    assert_allclose(settled_level(rising[np.newaxis]), expected)


def test_switching_gain_by_hand():
    up, down = np.exp(0.5), np.exp(-0.5)
    sizes, gain = np.array([[2.0, 0], [2.0, 0], [0, 0]]), np.array([1.0, 0.0])
    adapt_switching_gain(sizes, gain, 0.5)
    assert_allclose(sizes, [[up, 0], [up * up, 0], [up * up * down, 0]])
    assert_array_equal(gain, sizes[-1])
