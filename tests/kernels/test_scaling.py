import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skarxlag.kernels.scaling import (
    centred,
    fit_percentage,
    largest,
    root_mean_square,
    unit_rms_windows,
)


@pytest.fixture
def windows():
    return np.random.default_rng(0).normal(loc=3.0, size=(5, 2, 40))


def test_output_has_mean_zero_and_unit_rms(windows):
    scaled, rms = unit_rms_windows(windows)
    plain = windows - windows.mean(axis=-1, keepdims=True)
    assert_allclose(rms, plain[:, 0].std(axis=-1))
    assert_allclose(scaled, plain / rms[:, np.newaxis, np.newaxis], atol=1e-13)


@pytest.mark.parametrize("factor", [1e300, 1e-300, 2.0**-1060, -1.0])
def test_huge_and_tiny_windows_scale(windows, factor):
    scaled, rms = unit_rms_windows(windows * factor)
    expected, expected_rms = unit_rms_windows(windows)
    tolerance = 1e-3 if abs(factor) < 1e-307 else 1e-12
    assert_allclose(scaled * np.sign(factor), expected, rtol=tolerance, atol=tolerance)
    assert_allclose(rms, expected_rms * abs(factor), rtol=tolerance)


@pytest.mark.parametrize("value", [0.0, 5.0, 0.1, 1e300, -1e-300])
def test_constant_output_becomes_zero_and_scales_nothing(windows, value):
    windows[1, 0] = value
    scaled, rms = unit_rms_windows(windows)
    assert_array_equal(scaled[1, 0], 0)
    assert_allclose(scaled[1, 1], windows[1, 1] - windows[1, 1].mean(), atol=1e-14)
    assert rms[1] == 1
    expected, expected_rms = unit_rms_windows(np.delete(windows, 1, axis=0))
    assert_array_equal(np.delete(scaled, 1, axis=0), expected)
    assert_array_equal(np.delete(rms, 1), expected_rms)


def test_centred_treats_rounding_as_constant():
    # 0.1 + 0.2 and 0.3 differ in the last bit.
    unit, peak = centred(np.array([[0.1 + 0.2, 0.3, 0.3], [0.0, 1e-9, 0.0]]))
    assert_array_equal(unit[0], 0)
    assert np.ptp(unit[1]) == pytest.approx(1)
    assert_array_equal(peak, [[0.1 + 0.2], [1e-9]])
    # The limit is a deviation of eight units of rounding.
    eps = np.finfo(float).eps
    unit, _ = centred(np.array([[1, 1 - 16 * eps], [1, 1 - 17 * eps]]))
    assert_array_equal(unit, [[0, 0], [8.5 * eps, -8.5 * eps]])


def test_largest_value_counts_without_its_sign():
    signals = np.array([[-3.0, 1.0], [2.0, -1.0], [0.0, 0.0]])
    assert_array_equal(largest(signals), [[3], [2], [0]])


def test_arguments_are_not_written(windows):
    windows.flags.writeable = False
    unit_rms_windows(windows)
    centred(windows)


@pytest.mark.parametrize("factor", [1.0, 1e300, 1e-300])
def test_root_mean_square(factor):
    signals = factor * np.array([[[3.0, 4.0, 0.0, 0.0], [0, 0, 0, 0]]])
    assert_allclose(root_mean_square(signals), [[2.5 * factor, 0]], rtol=1e-14)
    assert_allclose(root_mean_square(signals[0, 0]), 2.5 * factor, rtol=1e-14)


@pytest.mark.parametrize("factor", [1.0, 7.0, 1e200])
def test_fit_is_one_minus_the_normalised_error(windows, factor):
    output, predicted = windows[:, 0], windows[:, 0] + 0.3 * windows[:, 1]
    error = np.sqrt(np.sum((output - predicted) ** 2, axis=1))
    spread = np.sqrt(np.sum((output - output.mean(axis=1, keepdims=True)) ** 2, axis=1))
    found = fit_percentage(factor * output, factor * predicted)
    assert_allclose(found, 100 - 100 * error / spread, rtol=1e-9)
    assert fit_percentage(np.full(5, 3.0), np.arange(5.0)) == 100
