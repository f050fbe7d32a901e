"""How far cepstra scatter within a condition, and how far a change of speed moves them."""

import numpy as np

from .compiled import compiled
from .spectra import cepstrum

#: Relative shifts of frequency that a change of speed may cause, as natural logarithms.
_LOG_SHIFTS = np.array([-0.25, -0.12, -0.05, -0.02, 0.02, 0.05, 0.12, 0.25])


def shrunk_scatter(deviations):
    r"""Covariance of centred rows, shrunk to its diagonal (Schaefer and Strimmer 2005).

    The share of the diagonal is :math:`\sum_{i \ne j} \mathrm{Var}(s_{ij}) / \sum_{i \ne j}
    s_{ij}^2`, which minimises the expected squared error.

    Parameters
    ----------
    deviations : ndarray of shape (n_rows, n_features)
        Rows less the mean of their condition.

    Returns
    -------
    ndarray of shape (n_features, n_features)
        Positive semi-definite.

    Examples
    --------
    >>> shrunk_scatter(np.array([[1.0, 1.0], [-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]]))
    array([[1., 0.],
           [0., 1.]])
    """
    n_rows = len(deviations)
    scatter = deviations.T @ deviations / n_rows
    squares = deviations**2
    variance = (squares.T @ squares / n_rows - scatter**2) / n_rows
    between = ~np.eye(len(scatter), dtype=bool)
    size = np.sum(scatter[between] ** 2)
    share = np.clip(np.sum(variance[between]) / size, 0.0, 1.0) if size > 0 else 1.0
    return (1 - share) * scatter + share * np.diag(np.diag(scatter))


def smooth_drift(n_coefficients, drift, floor):
    r"""Variance by which a change of speed moves each cosine coefficient of a log spectrum.

    :math:`c\,n^{-2} + f`: drift is smooth over frequency, and no coefficient is free of it.

    Parameters
    ----------
    n_coefficients : int
        Number of coefficients, n = 1, 2, ...
    drift, floor : float
        The constants c and f, in squared nepers of power.

    Returns
    -------
    ndarray of shape (n_coefficients,)
        Variances.

    Examples
    --------
    >>> smooth_drift(3, drift=0.36, floor=0.01)
    array([0.37, 0.1 , 0.05])
    """
    return drift / np.arange(1.0, n_coefficients + 1) ** 2 + floor


def shift_drift(log_spectra):
    r"""Changes of cepstra when all that log spectra show moves along the frequency axis.

    What follows the shaft moves with speed, what the structure rings at does not: neither is
    known, so both the shift and no shift must be likely.

    Parameters
    ----------
    log_spectra : ndarray of shape (n_spectra, n_frequencies)
        Mean log spectrum of each condition.

    Returns
    -------
    ndarray of shape (8 * n_spectra, n_frequencies - 1)
        One change of cepstrum a row: frequency multiplied by exp of -0.25 to 0.25.
    """
    n_frequencies = log_spectra.shape[1]
    cells = np.arange(n_frequencies) + 0.5
    moved = np.array(
        [
            np.interp(cells * np.exp(shift), cells, log_spectrum) - log_spectrum
            for log_spectrum in log_spectra
            for shift in _LOG_SHIFTS
        ]
    )
    return cepstrum(moved)


@compiled
def whitened(features, whitener):
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
    n_rows, n_features = features.shape
    rows = np.zeros((n_rows, n_features))
    for row in range(n_rows):
        for i in range(n_features):
            feature = features[row, i]
            for j in range(i + 1):
                rows[row, j] += feature * whitener[i, j]
    return rows
