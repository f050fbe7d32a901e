import numpy as np
import pytest

from skarxlag.kernels.healthy_rows import (
    log_impulsiveness,
    log_spectra_cepstra,
    measure_rows,
    number_of_cepstra,
)
from skarxlag.kernels.spectra import (
    autoregressive_log_spectrum,
    short_time_log_spectra,
    unit_peak,
)


@pytest.mark.parametrize(
    ("n_windows", "length"), [(1, 300), (3, 200), (4, 100), (1, 1100)]
)
def test_rows_are_means_over_their_windows(n_windows, length):
    rng = np.random.default_rng(0)
    # Two samples at the end of each row belong to no window.
    signals = 5 + 3 * rng.normal(size=(2, n_windows * length + n_windows - 1)).cumsum(
        axis=1
    )
    rows = measure_rows(signals, n_windows, with_level=True)
    for r, signal in enumerate(signals):
        cut = signal[: n_windows * length] - signal[: n_windows * length].mean()
        colours, steady = [], []
        for window in cut.reshape(n_windows, length):
            one = unit_peak(window[np.newaxis])
            colours.append(autoregressive_log_spectrum(one, 128, 256)[0])
            segment = min(128, length)
            mean, median = short_time_log_spectra(one, segment, min(16, segment))
            steady.append((median - mean)[0])
        # The gain of a window is in no other feature than the level.
        np.testing.assert_allclose(
            np.ptp(rows.spectral_shape[r] - np.mean(colours, axis=0)), 0, atol=1e-6
        )
        np.testing.assert_allclose(
            rows.steadiness[r], np.mean(steady, axis=0), atol=1e-9
        )
        for w in range(n_windows):
            expected = log_spectra_cepstra(
                colours[w][np.newaxis], steady[w][np.newaxis]
            )[0]
            np.testing.assert_allclose(rows.cepstra[r, w], expected, atol=1e-6)
        assert rows.cepstra.shape[2] == number_of_cepstra(length)
        impulsiveness = np.log(max(-np.mean(steady) - 0.36, 0) + 0.02)
        np.testing.assert_allclose(
            rows.values[r], [impulsiveness, np.log(cut.std())], rtol=1e-6
        )


def test_level_is_left_out_on_request_and_finite_for_silence():
    assert measure_rows(np.ones((2, 200)), 2, with_level=False).values.shape == (2, 1)
    assert np.all(
        np.isfinite(measure_rows(np.ones((2, 200)), 2, with_level=True).values)
    )


def test_impulsiveness_by_hand():
    found = log_impulsiveness(np.array([[-0.36, -0.36], [-1.0, -0.72], [0.0, 0.0]]))
    np.testing.assert_allclose(found, np.log([0.02, 0.52, 0.02]))


def test_windows_of_a_few_samples_have_no_features_of_steadiness():
    rows = measure_rows(
        np.random.default_rng(0).normal(size=(2, 8)), 2, with_level=False
    )
    assert rows.cepstra.shape[2] == number_of_cepstra(4) == 48
