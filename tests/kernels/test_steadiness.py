import numpy as np
import pytest

from skarxlag.kernels import steadiness


@pytest.mark.parametrize("n_rows", [1, 2, 3, 5, 8, 37, 64, 65, 100, 1000])
def test_sort_columns_sorts_each_column(n_rows):
    rows = np.random.default_rng(n_rows).integers(0, n_rows, size=(n_rows, 5)).astype(float)
    expected = np.sort(rows, axis=0)
    steadiness.sort_columns(rows)
    np.testing.assert_array_equal(rows, expected)


def test_sort_columns_sorts_zeros_and_ones():
    # A network that sorts every sequence of zeros and ones sorts everything.
    for n in range(2, 13):
        rows = np.array([[k >> i & 1 for k in range(2**n)] for i in range(n)], dtype=float)
        expected = np.sort(rows, axis=0)
        steadiness.sort_columns(rows)
        np.testing.assert_array_equal(rows, expected)


@pytest.mark.parametrize("segment", [4, 31, 128])
@pytest.mark.parametrize("hop", [1, 16, 300])
def test_windowed_segments_by_hand(segment, hop):
    signals, window = np.random.default_rng(0).normal(size=(2, 300)), np.arange(segment + 0.0)
    segments = steadiness.windowed_segments(signals, window, hop)
    starts = range(0, 300 - segment + 1, hop)
    literal = [[window * samples[s : s + segment] for s in starts] for samples in signals]
    np.testing.assert_array_equal(segments, literal)


@pytest.mark.parametrize("n_segments", [1, 2, 9, 68])
@pytest.mark.parametrize("n_bands", [1, 31, 32, 33, 63, 70])
def test_mean_and_median_against_numpy(n_segments, n_bands):
    rng = np.random.default_rng(1)
    shape = 3, n_segments, n_bands
    spectra = rng.normal(size=shape) + 1j * rng.normal(size=shape)
    floor = np.array([0.1, 0.2, 0.3])
    power = np.abs(spectra) ** 2 + floor[:, np.newaxis, np.newaxis]
    mean, median = steadiness.mean_and_median(spectra, floor)
    np.testing.assert_allclose(mean, np.mean(power, axis=1), rtol=1e-13)
    np.testing.assert_allclose(median, np.median(power, axis=1), rtol=1e-13)
