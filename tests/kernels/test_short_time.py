import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy import signal

from skarxlag.kernels import short_time


@pytest.mark.parametrize("segment", [4, 31, 128, 130])
@pytest.mark.parametrize("hop", [1, 16, 200])
@pytest.mark.parametrize("n_samples", [130, 1200])
def test_levels_against_the_short_time_transform_of_scipy(segment, hop, n_samples):
    signals = np.random.default_rng(1).normal(size=(3, n_samples))
    signals[1] = np.cos(0.3 * np.arange(n_samples))
    window = signal.windows.hann(segment + 2)[1:-1]
    floor = np.array([0.1, 1e-3, 1e-6])
    mean, median = short_time.band_levels(signals, window, hop, floor)
    n_segments = (n_samples - segment) // hop + 1
    plain = {
        "boundary": None,
        "padded": False,
        "detrend": False,
        "noverlap": segment - 1,
    }
    for row in range(3):
        _, _, spectra = signal.stft(
            signals[row], window=window, nperseg=segment, **plain
        )
        spectra = spectra[:, ::hop].T * window.sum()
        assert len(spectra) == n_segments
        power = np.abs(spectra) ** 2 + floor[row]
        # Rounding is a share of the amplitude of the strongest band.
        allowed = {"rtol": 1e-5, "atol": 1e-6 * np.sqrt(power.max())}
        for found, literal in (
            (mean, power.mean(axis=0)),
            (median, np.median(power, axis=0)),
        ):
            expected = np.sqrt(literal)[1 : segment // 2]
            assert_allclose(np.sqrt(found[row]), expected, **allowed)


@pytest.mark.parametrize("segment", [100, 128])
def test_layout_and_number_of_signals_do_not_matter(segment):
    signals = np.random.default_rng(2).normal(size=(9, 700)).astype(np.float32)
    window, floor = np.hanning(segment), np.full(9, 1e-9)
    levels = np.array(short_time.band_levels(signals, window, 16, floor))
    for row in range(9):
        alone = short_time.band_levels(signals[row : row + 1], window, 16, floor[:1])
        assert_array_equal(np.array(alone)[:, 0], levels[:, row])
    signals.flags.writeable = False
    same = short_time.band_levels(
        np.asfortranarray(signals.astype(float)), window, 16, floor
    )
    assert_array_equal(same, levels)
