"""Noises of many colours, which hold no condition and probe a classifier."""

import numpy as np
from numpy.typing import NDArray
from scipy import fft

#: Number of noises.
N_NOISES = 16
#: Zero a and exponent b of the first noises: brown, pink, white, blue and violet, and
#: two of first order. The second of them is white noise behind a model of first order.
NAMED = ((1.0, -2), (1.0, -1), (0.0, 0), (1.0, 1), (1.0, 2), (0.5, -2), (0.5, 2))
#: Number of cosines in the random log spectra of the others.
N_COSINES = 16


def coloured_noises(shape: tuple[int, int]) -> NDArray[np.float64]:
    r"""Return Gaussian noises of many colours, the same at each call.

    Of seven noises, the power at the angular frequency :math:`\omega` is proportional to
    :math:`|1 - a e^{-j \omega}|^b`. With a = 1 and b = -2, -1, 1 and 2 they are brown,
    pink, blue and violet, and with b = 0 white. The others have random smooth spectra.
    Their log spectrum is :math:`\sum_{n=1}^{16} a_n \cos(n \omega)`, with normally
    distributed :math:`a_n` of standard deviation 1 / n nepers.

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
    sizes = rng.normal(size=(N_NOISES - len(NAMED), N_COSINES)) / n
    noises = rng.normal(size=(N_NOISES, *shape))
    angles = np.linspace(0, np.pi, shape[1] // 2 + 1)
    zeros, exponents = np.transpose(NAMED)
    response = np.abs(1 - np.outer(zeros, np.exp(-1j * angles)))
    named = exponents[:, np.newaxis] * np.log(np.maximum(response, 1 / shape[1]))
    smooth = sizes @ np.cos(np.outer(n, angles))
    log_power = np.concatenate([named, smooth])[:, np.newaxis]
    spectra = fft.rfft(noises) * np.exp(log_power / 2)
    return fft.irfft(spectra, shape[1])
