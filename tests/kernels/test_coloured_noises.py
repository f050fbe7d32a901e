import numpy as np
from numpy.testing import assert_allclose, assert_array_equal
from scipy.signal import freqz, welch

from skarxlag.kernels.coloured_noises import (
    N_COSINES,
    N_NOISES,
    NAMED,
    coloured_noises,
)


def test_noises_are_the_same_at_each_call():
    assert_array_equal(coloured_noises((2, 999)), coloured_noises((2, 999)))


def test_named_noises_are_those_of_filters():
    frequency, power = welch(coloured_noises((1, 2**18))[:7, 0], nperseg=1024)
    for (zero, exponent), of_noise in zip(NAMED, power, strict=True):
        response = freqz([1, -zero], worN=2 * np.pi * frequency[20:-20])[1]
        rest = np.log(of_noise[20:-20]) - exponent * np.log(np.abs(response))
        assert rest.std() < 0.1


def test_log_spectra_of_the_others_are_random_sums_of_cosines():
    noises = coloured_noises((1, 2**16))
    frequency, power = welch(noises[len(NAMED) :, 0], nperseg=512)
    assert len(noises) == N_NOISES
    n = np.arange(N_COSINES + 1)
    cosines = np.cos(2 * np.pi * np.outer(frequency, n))[2:-2]
    log_power = np.log(power)[:, 2:-2]
    sizes, residues, *_ = np.linalg.lstsq(cosines, log_power.T, rcond=None)
    # The estimate of a periodogram varies by 1 / sqrt(256 segments).
    assert np.sqrt(residues.mean() / len(cosines)) < 0.1
    assert_allclose((n[1:, np.newaxis] * sizes[1:]).std(), 1, rtol=0.15)
