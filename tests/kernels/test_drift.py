import numpy as np

from skarxlag.kernels import drift
from skarxlag.kernels.spectra import frequency_grid


def test_smooth_variance_by_hand():
    np.testing.assert_allclose(drift.smooth_variance(3, 0.9, 0.05), [0.95, 0.275, 0.15])


def test_scaled_frequency_moves_a_peak_both_ways():
    frequency = frequency_grid(2000)
    peak = np.exp(-0.5 * ((frequency - 1.0) / 0.1) ** 2)
    up_or_down = drift.scaled_frequency(peak[np.newaxis]) + peak
    assert up_or_down.shape == (2, 2000)
    places = frequency[np.argmax(up_or_down, axis=1)]
    np.testing.assert_allclose(places, [np.exp(-0.1), np.exp(0.1)], atol=2e-3)


def test_scaled_frequency_counts_from_the_edge_of_the_first_cell():
    # A spectrum that is proportional to frequency changes in proportion to it.
    frequency = frequency_grid(50)
    faster, slower = drift.scaled_frequency(frequency[np.newaxis])
    within = frequency * np.exp(0.1) < frequency[-1]
    np.testing.assert_allclose(faster[within], frequency[within] * (np.exp(0.1) - 1), rtol=1e-12)
    # Below the first cell and beyond the last one the value is held.
    np.testing.assert_allclose(faster[~within], frequency[-1] - frequency[~within], rtol=1e-12)
    np.testing.assert_allclose(slower[1:], frequency[1:] * (np.exp(-0.1) - 1), rtol=1e-12)
    assert slower[0] == 0


def test_raised_noise_adds_power_20_and_26_db_below_the_mean():
    power = np.random.default_rng(0).exponential(size=(3, 50))
    changes = drift.raised_noise(np.log(power))
    for change, level in zip(np.split(changes, 2), (0.01, 10**-2.6), strict=True):
        added = np.exp(np.log(power) + change) - power
        expected = level * power.mean(axis=1, keepdims=True) * np.ones(50)
        np.testing.assert_allclose(added, expected, rtol=1e-6)
