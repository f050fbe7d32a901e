import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from skarxlag.kernels import healthy_rows, spectra
from skarxlag.kernels.healthy_rows import measure_rows, number_of_cepstra

from .literal import (
    generators,
    literal_cepstrum,
    some_examples,
    walk,
)


def test_level_is_finite_for_silence():
    rows = measure_rows(np.ones((2, 200)), 2, with_level=True)
    assert np.isfinite(rows.values).all()


def test_windows_of_a_few_samples_have_no_features_of_steadiness():
    rows = measure_rows(
        np.random.default_rng(0).normal(size=(2, 8)), 2, with_level=False
    )
    assert rows.cepstra.shape[2] == number_of_cepstra(4) == 48


@some_examples
@given(generators, st.integers(1, 3), st.integers(2, 70), st.integers(2, 40))
def test_features_of_log_spectra(rng, n_rows, n_frequencies, n_bands):
    spectral_shape, steadiness = (
        walk(rng, n_rows, n_frequencies),
        walk(rng, n_rows, n_bands),
    )
    expected = [
        literal_cepstrum(c)[:48] + literal_cepstrum(s)
        for c, s in zip(spectral_shape, steadiness, strict=True)
    ]
    found = healthy_rows.log_spectra_cepstra(spectral_shape, steadiness)
    assert_allclose(found, expected, atol=1e-10)
    assert_allclose(spectra.cepstrum(steadiness), [e[-n_bands + 1 :] for e in expected])
    unsteady = [
        math.log(max(-math.fsum(row) / n_bands - 0.36, 0) + 0.02) for row in steadiness
    ]
    assert_allclose(healthy_rows.log_impulsiveness(steadiness), unsteady, atol=1e-9)


@some_examples
@given(
    generators,
    st.integers(1, 3),
    st.integers(40, 160),
    st.integers(0, 2),
    st.booleans(),
)
def test_features_of_rows(rng, n_windows, length, left_over, with_level):
    signals = 3 + rng.normal(
        size=(2, n_windows * length + min(left_over, n_windows - 1))
    )
    found = healthy_rows.measure_rows(signals, n_windows, with_level=with_level)
    assert found.cepstra.shape[2] == healthy_rows.number_of_cepstra(length)
    for row, signal in enumerate(signals[:, : n_windows * length]):
        centred = signal - signal.mean()
        windows = [w / np.abs(w).max() for w in np.split(centred, n_windows)]
        shapes = spectra.autoregressive_log_spectrum(np.array(windows), 128, 256)
        segment = min(128, length)
        steady = spectra.steadiness(np.array(windows), segment, min(16, segment))
        assert_allclose(found.spectral_shape[row], np.mean(shapes, axis=0), atol=1e-5)
        assert_allclose(found.steadiness[row], np.mean(steady, axis=0), atol=1e-3)
        for w in range(n_windows):
            expected = literal_cepstrum(shapes[w])[:48] + literal_cepstrum(steady[w])
            assert_allclose(found.cepstra[row, w], expected, atol=1e-3)
        values = [math.log(max(-np.mean(steady) - 0.36, 0) + 0.02)]
        values += [math.log(math.sqrt(np.mean(centred**2)))] * with_level
        assert_allclose(found.values[row], values, atol=1e-2)
