import numpy as np
from numpy.testing import assert_allclose, assert_array_equal
from scipy.signal import welch

from skarxlag.kernels.coloured_noises import N_COSINES, N_NOISES, coloured_noises


def test_noises_are_the_same_at_each_call():
    assert_array_equal(coloured_noises((2, 999)), coloured_noises((2, 999)))


def test_log_spectra_vary_as_the_sum_of_their_cosines():
    noises = coloured_noises((1, 2**16))
    power = welch(noises, nperseg=512)[1][:, 0]
    assert len(power) == N_NOISES
    n = np.arange(1, N_COSINES + 1)
    # Near 0, in the middle and near half a cycle a sample.
    for cells in (slice(2, 6), slice(124, 132), slice(250, 254)):
        logs = np.log(power[:, cells]).mean(axis=1)
        share = (cells.start + cells.stop - 1) / 512
        expected = np.sum((np.cos(np.pi * n * share) / n) ** 2)
        # The variance of 16 noises is known to about a third.
        assert_allclose(logs.var(), expected, rtol=0.35)


def test_channels_of_a_noise_share_its_colour():
    first, second = welch(coloured_noises((2, 2**16)), nperseg=256)[1].transpose(
        1, 0, 2
    )
    assert_allclose(first[:, 4:-4], second[:, 4:-4], rtol=0.5)
