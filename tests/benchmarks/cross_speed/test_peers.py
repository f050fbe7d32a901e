import numpy as np
from scipy.signal import lfilter

from benchmarks.cross_speed.peers import (
    ar_coefficients,
    band_energies,
    smooth_gains,
    unit_rms,
)

LENGTH = 600


def test_unit_rms_removes_mean_and_gain_of_the_output_channel():
    y = np.array([[1.0, 3.0, 1.0, 3.0]])
    expected = [[-1.0, 1.0, -1.0, 1.0]]
    np.testing.assert_allclose(unit_rms(y), expected)
    np.testing.assert_allclose(unit_rms(100 * y + 7), expected)
    np.testing.assert_allclose(unit_rms(np.stack([y, 5 * y**2], axis=1)), expected)
    assert unit_rms(np.ones((1, 4))).tolist() == [[0.0] * 4]


def test_band_energies_of_a_sine_peak_in_its_band():
    time = np.arange(256)
    tones = np.array(
        [np.sin(2 * np.pi * 20 * time / 256), np.sin(2 * np.pi * 100 * time / 256)]
    )
    energies = band_energies(tones, n_bands=8)
    assert energies.shape == (2, 8)
    assert energies.argmax(axis=1).tolist() == [19 // 16, 99 // 16]
    # Parseval: a sine of unit amplitude has energy n / 2, half of it at the positive
    # frequency
    np.testing.assert_allclose(np.exp(energies).sum(axis=1), 256 * 256 / 4)


def test_ar_coefficients_recover_a_known_model():
    coefficients = [1.2, -0.8, 0.1]
    noise = np.random.default_rng(0).standard_normal((2, 100_000))
    y = lfilter([1.0], [1.0, *np.negative(coefficients)], noise)
    np.testing.assert_allclose(
        ar_coefficients(y, order=3), [coefficients] * 2, atol=0.02
    )


def test_smooth_gains_vary_slowly_and_by_their_seed():
    gains = smooth_gains(2000, 32, random_state=0)
    n = np.arange(1, 25)
    frequency = (np.arange(32) + 0.5) / 32
    expected = 0.6**2 * (
        2 * np.cos(np.pi * np.outer(n, frequency)) ** 2 / n[:, None] ** 2
    ).sum(0)
    np.testing.assert_allclose(gains.var(axis=0), expected, rtol=0.15)
    neighbours = np.corrcoef(gains.T).diagonal(1)
    assert neighbours.min() > 0.8
    assert not np.allclose(gains, smooth_gains(2000, 32, random_state=1))
