"""How a change of speed moves the cepstra of log spectra: three priors."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .compiled import compiled

#: Relative shift of frequency by which all that a log spectrum shows is moved, both ways.
_LOG_SHIFT = 0.1
#: Levels of white noise that is added, in dB of the mean power.
_NOISE_DB = (-20.0, -26.0)


def smooth_variance(n_coefficients: int, smooth: float, rough: float) -> NDArray[Any]:
    r"""Variance by which a change of speed moves each cosine coefficient of a log spectrum.

    :math:`c\,n^{-2} + f`: drift is smooth over frequency, and no coefficient is free of it.

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
    r"""Changes of log spectra when all that they show moves along the frequency axis.

    What follows the shaft moves with speed, what the structure rings at does not; which is which
    is not known.

    Parameters
    ----------
    log_spectra : ndarray of shape (n_spectra, n_frequencies)
        Log spectra at the midpoints of equal cells.

    Returns
    -------
    ndarray of shape (2 * n_spectra, n_frequencies)
        Changes when frequency is multiplied by :math:`e^{0.1}` and by :math:`e^{-0.1}`; the last
        value is held beyond the band.

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
    r"""Changes of log spectra when white noise is added, 20 and 26 dB below their mean power.

    What a bearing emits grows with speed, what the sensor adds does not: valleys fill or empty.

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


def whitened(features: NDArray[Any], whitener: NDArray[Any]) -> NDArray[Any]:
    """Features in coordinates in which their covariance is the identity.

    Parameters
    ----------
    features : ndarray of shape (n_rows, n_features)
        Rows.
    whitener : ndarray of shape (n_features, n_features)
        Lower triangular W with W W' the inverse of the covariance.

    Returns
    -------
    ndarray of shape (n_rows, n_features)
        Rows times W, summed in an order that does not depend on the number of rows.
    """
    # Whatever comes in, the loop is compiled for one kind of array only.
    features, whitener = (np.require(a, np.float64, ["C", "W"]) for a in (features, whitener))
    rows = np.zeros(features.shape)
    _add_products(features, whitener, rows)
    return rows


@compiled
def _add_products(features, whitener, rows):
    for row in range(features.shape[0]):
        target = rows[row]
        for i in range(features.shape[1]):
            feature, weights = features[row, i], whitener[i]
            for j in range(i + 1):
                target[j] += feature * weights[j]
