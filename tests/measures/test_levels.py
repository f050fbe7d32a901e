import numpy as np
import pytest

from skarxlag.measures.levels import joined_levels, signal_levels


@pytest.mark.parametrize("scale", [1.0, 1e-300, 1e300])
@pytest.mark.parametrize("offset", [0.0, 0.5])
def test_levels_are_those_about_the_mean(scale, offset):
    X = np.random.default_rng(0).uniform(-1, 1, size=(3, 2, 500))
    levels = signal_levels(scale * (X + offset))
    np.testing.assert_allclose(levels.rms / scale, X.std(axis=-1))
    peak = np.abs(X - X.mean(axis=-1, keepdims=True)).max(axis=-1)
    np.testing.assert_allclose(levels.peak / scale, peak)
    np.testing.assert_allclose(levels.crest_factor, peak / X.std(axis=-1))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_sample_that_is_not_finite_has_no_level(value):
    X = np.random.default_rng(0).normal(size=(2, 50)).astype(np.float32)
    X[1, 7] = value
    levels = signal_levels(X)
    assert np.isnan([level[1] for level in levels]).all()
    assert np.isfinite([level[0] for level in levels]).all()


def test_a_constant_window_has_no_crest_factor():
    levels = signal_levels(np.full(9, 4.0))
    assert levels[:2] == (0.0, 0.0) and np.isnan(levels.crest_factor)


def test_windows_of_equal_length_join_to_the_recording():
    X = np.random.default_rng(0).normal(size=(4, 50))
    X -= X.mean(axis=1, keepdims=True)
    levels = signal_levels(X)
    whole = signal_levels(X.ravel())
    missing = np.append(levels.rms, np.nan), np.append(levels.peak, np.nan)
    np.testing.assert_allclose(joined_levels(*missing), whole)
    assert np.isnan(joined_levels(np.array([np.nan]), np.array([np.nan]))).all()
