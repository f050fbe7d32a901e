"""Three prior models of how a change of speed changes log spectra and their cepstra."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Relative shift of frequency by which all that a log spectrum shows is moved, both ways.
_LOG_SHIFT = 0.1
#: Levels of white noise that is added, in dB of the mean power.
_NOISE_DB = (-20.0, -26.0)


def smooth_variance(n_coefficients: int, smooth: float, rough: float) -> NDArray[Any]:
    r"""Return the variance that a change of speed adds to each cepstral coefficient.

    A cepstral coefficient is a cosine coefficient of the log spectrum. Its variance is
    :math:`c\,n^{-2} + f`. The first term describes changes that are smooth over frequency, and the
    second term gives every coefficient some variance.

    Parameters
    ----------
    n_coefficients : int
        Number of coefficients, n = 1, 2, ...
    smooth, rough : float
        The constants c and f, in squared nepers of power.

    Returns
    -------
    ndarray of shape (n_coefficients,)
        Variances.

    Examples
    --------
    >>> smooth_variance(3, smooth=0.36, rough=0.01)
    array([0.37, 0.1 , 0.05])
    """
    return smooth / np.arange(1.0, n_coefficients + 1) ** 2 + rough


def scaled_frequency(log_spectra: NDArray[Any]) -> NDArray[Any]:
    r"""Compute the changes of log spectra when the frequency axis is scaled.

    Components that follow the shaft move along the frequency axis with the speed, and resonances of
    the structure do not. It is not known which components of a spectrum are of which kind, so the
    whole spectrum is moved.

    Parameters
    ----------
    log_spectra : ndarray of shape (n_spectra, n_frequencies)
        Log spectra at the midpoints of equal cells.

    Returns
    -------
    ndarray of shape (2 * n_spectra, n_frequencies)
        Changes when the frequency is multiplied by :math:`e^{0.1}` and by :math:`e^{-0.1}`. Beyond
        the band, the last value is used.

    Examples
    --------
    >>> scaled_frequency(np.zeros((1, 4)))
    array([[0., 0., 0., 0.],
           [0., 0., 0., 0.]])
    """
    cells = np.arange(log_spectra.shape[1]) + 0.5
    return np.array(
        [
            np.interp(cells * np.exp(shift), cells, log_spectrum) - log_spectrum
            for shift in (_LOG_SHIFT, -_LOG_SHIFT)
            for log_spectrum in log_spectra
        ]
    )


def raised_noise(log_spectra: NDArray[Any]) -> NDArray[Any]:
    r"""Compute the changes of log spectra when white noise is added, 20 and 26 dB below mean power.

    The emission of a bearing grows with the speed, and the noise of the sensor does not. Relative
    to the emission, the noise floor in the valleys of the spectrum therefore changes with speed.

    Parameters
    ----------
    log_spectra : ndarray of shape (n_spectra, n_frequencies)
        Log spectra, natural logarithms of power.

    Returns
    -------
    ndarray of shape (2 * n_spectra, n_frequencies)
        Changes, at least 0.

    Examples
    --------
    >>> raised_noise(np.zeros((1, 2))).round(4)
    array([[0.01  , 0.01  ],
           [0.0025, 0.0025]])
    """
    mean = np.log(np.mean(np.exp(log_spectra), axis=1, keepdims=True))
    return np.concatenate(
        [
            np.logaddexp(log_spectra, mean + level * np.log(10) / 10) - log_spectra
            for level in _NOISE_DB
        ]
    )
