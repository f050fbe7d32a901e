import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skarxlag.kernels import measures, spectra


@pytest.fixture
def noise():
    return np.random.default_rng(0).normal(size=(3, 600))


@pytest.mark.parametrize(("n_bands", "n_cells"), [(31, 9), (63, 4)])
def test_colour_is_the_mean_of_the_fine_log_spectrum_in_each_band(
    noise, n_bands, n_cells
):
    fine = spectra.autoregressive_log_spectrum(noise, 20, n_bands * n_cells)
    expected = fine.reshape(3, n_bands, n_cells).mean(axis=2)
    found = measures.own_model(noise, 2 * n_bands + 2, 20)["spectral_shape"]
    assert_allclose(found, expected, rtol=1e-12)


@pytest.mark.parametrize(("segment", "hop"), [(64, 8), (8, 1), (7, 1)])
def test_steadiness_is_floor_less_power(noise, segment, hop):
    found = measures.short_time(noise, segment, 20)
    mean, median = spectra.short_time_log_spectra(noise, segment, hop)
    assert_array_equal(found["power"], mean)
    assert_array_equal(found["floor"], median)
    assert_array_equal(found["steadiness"], median - mean)


@pytest.mark.parametrize(
    "names", [["spectral_shape"], ["steadiness", "power"], list(measures.MEASURES)]
)
def test_measures_come_in_the_order_of_their_names(noise, names):
    groups = measures.measure(noise, names, 64, 20)
    single = [measures.measure(noise, [name], 64, 20)[:, 0] for name in names]
    assert_array_equal(groups, np.stack(single, axis=1))
    assert groups.shape == (3, len(names), 31)


@pytest.mark.parametrize("segment", [1, 3, 4, 5, 600])
def test_all_measures_have_the_same_bands(noise, segment):
    groups = measures.measure(noise, list(measures.MEASURES), segment, 20)
    assert groups.shape == (3, 4, max(segment // 2 - 1, 1))
    assert np.isfinite(groups).all()
