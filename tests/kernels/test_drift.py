import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from skarxlag.kernels import drift
from skarxlag.kernels.drift import along_axes

from .literal import generators, literal_cepstrum, some_examples, walk


def test_product_does_not_depend_on_the_number_of_rows():
    rng = np.random.default_rng(0)
    rows, axes = rng.normal(size=(300, 40)), rng.normal(size=(40, 30))
    product = along_axes(rows, axes)
    assert_allclose(product, rows @ axes, rtol=1e-10)
    assert_array_equal(along_axes(rows[7:8], axes)[0], product[7])
    assert_array_equal(along_axes(np.asfortranarray(rows), axes), product)


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
    power = np.exp(log_spectra)
    mean = power.mean(axis=1, keepdims=True)
    raised = [
        np.log(power + share * mean) - log_spectra for share in (10**-2, 10**-2.6)
    ]
    assert_allclose(drift.raised_noise(log_spectra), np.concatenate(raised), atol=1e-12)


@some_examples
@given(generators, st.integers(1, 3), st.integers(2, 60), st.integers(2, 20))
def test_covariance_of_drift(rng, n_speeds, n_frequencies, n_bands):
    spectral_shape, steadiness = (
        walk(rng, n_speeds, n_frequencies),
        walk(rng, n_speeds, n_bands),
    )
    n_shape = min(48, n_frequencies - 1)
    numbers = [*range(1, n_shape + 1), *range(1, n_bands)]
    expected = np.diag([0.1 / n**2 + 0.01 for n in numbers])

    shapes, steady = map(drift.scaled_frequency, (spectral_shape, steadiness))
    for c, s in zip(shapes, steady, strict=True):
        change = [*literal_cepstrum(c)[:48], *literal_cepstrum(s)]
        expected += 0.1 * np.outer(change, change) / (2 * n_speeds)
    for raised in drift.raised_noise(spectral_shape):
        change = [*literal_cepstrum(raised)[:48], *[0.0] * (n_bands - 1)]
        expected += 0.5 * np.outer(change, change) / (2 * n_speeds)
    assert_allclose(
        drift.drift_covariance(spectral_shape, steadiness), expected, atol=1e-9
    )
