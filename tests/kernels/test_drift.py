import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from skarxlag.kernels import drift
from skarxlag.kernels.drift import along_axes, squared_distances

from .literal import generators, some_examples, walk


def test_product_does_not_depend_on_the_number_of_rows():
    rng = np.random.default_rng(0)
    rows, axes = rng.normal(size=(300, 40)), rng.normal(size=(40, 30))
    product = along_axes(rows, axes)
    assert_allclose(product, rows @ axes, rtol=1e-10)
    assert_array_equal(along_axes(rows[7:8], axes)[0], product[7])
    assert_array_equal(along_axes(np.asfortranarray(rows), axes), product)


def test_distances_are_weighted_sums_over_axes_of_each_row_alone():
    rng = np.random.default_rng(0)
    rows, axes = rng.normal(size=(9, 4)), rng.normal(size=(4, 3))
    references, precisions = rng.normal(size=(5, 2, 3)), rng.uniform(size=(5, 3))
    indices = rng.integers(5, size=(3, 9))
    fitted = (axes, references, precisions)
    found = squared_distances(rows, *fitted, indices)
    for tried, row, kind in np.ndindex(3, 9, 2):
        index = indices[tried, row]
        change = rows[row] @ axes - references[index, kind]
        expected = np.mean(precisions[index] * change**2)
        assert_allclose(found[tried, row, kind], expected, rtol=1e-12)
    alone = squared_distances(rows[4:5], *fitted, indices[:, 4:5])
    assert_array_equal(alone[:, 0], found[:, 4])


@some_examples
@given(generators, st.integers(1, 4), st.integers(2, 50))
def test_changes_of_log_spectra(rng, n_spectra, n_frequencies):
    log_spectra = walk(rng, n_spectra, n_frequencies)
    places = np.arange(n_frequencies)
    scaled = [
        np.interp(factor * (places + 0.5) - 0.5, places, row) - row
        for factor in np.exp([0.1, -0.1])
        for row in log_spectra
    ]
    assert_allclose(drift.scaled_frequency(log_spectra), scaled, atol=1e-12)
