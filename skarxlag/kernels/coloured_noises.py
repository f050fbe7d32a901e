"""Noises of random colour, which carry no condition and probe what a classifier says of them."""

import numpy as np
from numpy.typing import NDArray
from scipy import fft

#: Number of noises.
N_NOISES = 16
#: Number of cosines in their random log spectra.
N_COSINES = 16


def coloured_noises(shape: tuple[int, int]) -> NDArray[np.float64]:
    r"""Return Gaussian noises with random smooth spectra, the same at each call.

    The log spectrum of a noise is :math:`\sum_{n=1}^{16} a_n \cos(\pi n f)` over the
    frequencies f from 0 to 1, with normally distributed :math:`a_n` of standard
    deviation 1 / n nepers.

    Parameters
    ----------
    shape : tuple of two ints
        Channels and samples of each noise.

    Returns
    -------
    ndarray of shape (16, n_channels, n_samples)
        Noises.

    Examples
    --------
    >>> coloured_noises((1, 4800)).shape
    (16, 1, 4800)
    """
    rng = np.random.default_rng(0)
    n = np.arange(1, N_COSINES + 1)
    sizes = rng.normal(size=(N_NOISES, 1, N_COSINES)) / n
    noises = rng.normal(size=(N_NOISES, *shape))
    frequencies = np.linspace(0, 1, shape[1] // 2 + 1)
    cosines = np.cos(np.pi * np.outer(n, frequencies))
    log_power = sizes @ cosines
    spectra = fft.rfft(noises) * np.exp(log_power / 2)
    return fft.irfft(spectra, shape[1])
