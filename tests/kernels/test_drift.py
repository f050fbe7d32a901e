import numpy as np
import pytest
from scipy.spatial.distance import mahalanobis

from skarxlag.kernels import drift
from skarxlag.kernels.drift import (
    along_axes,
    drift_covariance,
    joint_axes,
    raised_noise,
    scaled_frequency,
    squared_distances,
)
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
    np.testing.assert_allclose(
        faster[within], frequency[within] * (np.exp(0.1) - 1), rtol=1e-12
    )
    # Below the first cell and beyond the last one the value is held.
    np.testing.assert_allclose(
        faster[~within], frequency[-1] - frequency[~within], rtol=1e-12
    )
    np.testing.assert_allclose(
        slower[1:], frequency[1:] * (np.exp(-0.1) - 1), rtol=1e-12
    )
    assert slower[0] == 0


def test_raised_noise_adds_power_20_and_26_db_below_the_mean():
    power = np.random.default_rng(0).exponential(size=(3, 50))
    changes = drift.raised_noise(np.log(power))
    for change, level in zip(np.split(changes, 2), (0.01, 10**-2.6), strict=True):
        added = np.exp(np.log(power) + change) - power
        expected = level * power.mean(axis=1, keepdims=True) * np.ones(50)
        np.testing.assert_allclose(added, expected, rtol=1e-6)


@pytest.mark.parametrize("size", [0, 1, 6])
def test_joint_axes_make_both_diagonal(size):
    rng = np.random.default_rng(0)
    root = rng.normal(size=(size, size))
    drift = root @ root.T + np.eye(size)
    few = rng.normal(size=(size, 2))
    scatter = few @ few.T
    axes, variances = joint_axes(scatter, drift)
    assert axes.shape == (size, size) and variances.shape == (size,)
    np.testing.assert_allclose(axes.T @ drift @ axes, np.eye(size), atol=1e-10)
    np.testing.assert_allclose(axes.T @ scatter @ axes, np.diag(variances), atol=1e-10)
    assert (variances >= 0).all()


def test_product_does_not_depend_on_the_number_of_rows():
    rng = np.random.default_rng(0)
    rows, axes = rng.normal(size=(300, 40)), rng.normal(size=(40, 30))
    product = along_axes(rows, axes)
    np.testing.assert_allclose(product, rows @ axes, rtol=1e-10)
    np.testing.assert_array_equal(along_axes(rows[7:8], axes)[0], product[7])
    np.testing.assert_array_equal(along_axes(np.asfortranarray(rows), axes), product)
    groups = along_axes(np.stack([rows, 2 * rows], axis=1), np.stack([axes, axes]))
    np.testing.assert_allclose(
        groups, np.stack([product, 2 * product], axis=1), rtol=1e-10
    )


@pytest.mark.parametrize("n_axes", [1, 4])
def test_squared_distances_are_mahalanobis_distances_at_the_place_of_each_row(n_axes):
    rng = np.random.default_rng(0)
    rows, axes = rng.normal(size=(5, 3, 6)), rng.normal(size=(3, 6, n_axes))
    references = rng.normal(size=(4, 2, 3, n_axes))
    precisions, places = (
        rng.uniform(0.5, 2, size=(4, 3, n_axes)),
        rng.integers(4, size=(2, 5)),
    )
    found = squared_distances(rows, axes, references, precisions, places)
    assert found.shape == (2, 5, 2, 3)
    for (tried, w, c, g), value in np.ndenumerate(found):
        place = places[tried, w]
        weight = np.diag(precisions[place, g])
        along = rows[w, g] @ axes[g]
        expected = mahalanobis(along, references[place, c, g], weight) ** 2 / n_axes
        assert value == pytest.approx(expected, rel=1e-12)
    alone = squared_distances(rows[3:4], axes, references, precisions, places[:, 3:4])
    np.testing.assert_array_equal(alone, found[:, 3:4])


def test_drift_of_flat_spectra_is_smooth_and_rough_drift_alone(monkeypatch):
    spectral_shape, steadiness = np.zeros((2, 256)), np.full((2, 63), -0.36)
    # A floor that rises lifts a flat spectrum alike everywhere: no cepstrum changes.
    found = drift_covariance(spectral_shape, steadiness)
    n = np.concatenate([np.arange(1, 49), np.arange(1, 63)])
    np.testing.assert_allclose(found, np.diag(0.1 / n**2 + 0.01), atol=1e-12)
    monkeypatch.setattr(drift, "NOISE", 5.0)
    moved = drift_covariance(np.linspace(0, -6, 256)[None], steadiness[:1])
    assert np.linalg.eigvalsh(moved - found).min() > -1e-10
    assert np.trace(moved) > 1.05 * np.trace(found)


@pytest.mark.parametrize("n_frequencies", [256, 40])
def test_drift_covariance_is_the_mean_square_of_the_changes(n_frequencies):
    rng = np.random.default_rng(0)
    spectral_shape = rng.normal(size=(3, n_frequencies)).cumsum(axis=1) / 10
    steadiness = rng.normal(size=(3, 20))
    found = drift_covariance(spectral_shape, steadiness)
    n_colour = min(48, n_frequencies - 1)

    def coefficients(change):
        """Cosine coefficients of a log spectrum, without the first, as explicit sums."""
        size = len(change)
        angles = np.pi * (np.arange(size) + 0.5) / size
        return [change @ np.cos(n * angles) * 2 / size for n in range(1, size)]

    def features(of_colour, of_steadiness):
        return np.array(
            coefficients(of_colour)[:n_colour] + coefficients(of_steadiness)
        )

    scaled = [
        features(*changes)
        for changes in zip(
            scaled_frequency(spectral_shape), scaled_frequency(steadiness), strict=True
        )
    ]
    raised = [features(change, np.zeros(20)) for change in raised_noise(spectral_shape)]
    n = np.concatenate([np.arange(1, n_colour + 1), np.arange(1, 20)])
    expected = np.diag(0.1 / n**2 + 0.01)
    for weight, rows in ((0.1, scaled), (0.5, raised)):
        for row in rows:
            expected = expected + weight * np.outer(row, row) / len(rows)
    np.testing.assert_allclose(found, expected, atol=1e-9)
