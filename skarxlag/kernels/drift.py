"""Change of log spectra with speed: its covariance, and the axes along which it is discounted."""

from typing import Any

import numpy as np
from scipy import linalg
from scipy.spatial.distance import cdist

from .arrays import Array

#: Drift of log spectra in squared nepers of power, as `smooth_variance` has it.
SMOOTH = 0.3
ROUGH = 0.01
#: Relative shift of frequency by which all that a log spectrum shows is moved, both
#: ways.
_LOG_SHIFT = 0.1


def smooth_variance(n_coefficients: int, smooth: float, rough: float) -> Array:
    r"""Return the variance that a change of speed adds to each cepstral coefficient.

    A cepstral coefficient is a cosine coefficient of the log spectrum. Its variance is
    :math:`c\,n^{-2} + f`. The first term describes changes that are smooth over
    frequency, and the second term gives every coefficient some variance.

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


def scaled_frequency(log_spectra: Array) -> Array:
    r"""Compute the changes of log spectra when the frequency axis is scaled.

    Components that follow the shaft move along the frequency axis with the speed, and
    resonances of the structure do not. It is not known which components of a spectrum
    are of which kind, so the whole spectrum is moved.

    Parameters
    ----------
    log_spectra : ndarray of shape (n_spectra, n_frequencies)
        Log spectra at the midpoints of equal cells.

    Returns
    -------
    ndarray of shape (2 * n_spectra, n_frequencies)
        Changes when the frequency is multiplied by :math:`e^{0.1}` and by
        :math:`e^{-0.1}`. Beyond the band, the last value is used.

    Examples
    --------
    >>> scaled_frequency(np.zeros((1, 4)))
    array([[0., 0., 0., 0.],
           [0., 0., 0., 0.]])
    """
    cells = np.arange(log_spectra.shape[1]) + 0.5
    changes = []
    for shift in (_LOG_SHIFT, -_LOG_SHIFT):
        points = cells * np.exp(shift)
        changes += [np.interp(points, cells, row) - row for row in log_spectra]
    return np.array(changes)


def joint_axes(scatter: Array, drift: Array) -> tuple[Array, Array]:
    """Compute coordinates in which the scatter is diagonal and the drift is the identity.

    Parameters
    ----------
    scatter : ndarray of shape (n_features, n_features)
        Positive semidefinite.
    drift : ndarray of shape (n_features, n_features)
        Positive definite.

    Returns
    -------
    axes : ndarray of shape (n_features, n_features)
        Matrix V with V' drift V = I and V' scatter V diagonal.
    variances : ndarray of shape (n_features,)
        That diagonal, ascending, at least 0.
    """
    variances, axes = linalg.eigh(scatter, drift)
    # A copy of a model may have this layout only, and in another one sums are rounded
    # otherwise.
    return np.ascontiguousarray(axes), np.maximum(variances, 0.0)


def along_axes(rows: Array, axes: Array) -> Array:
    """Multiply rows by axes, one by one, so that no product depends on the number of rows.

    Parameters
    ----------
    rows : ndarray of shape (n_rows, n_features)
        Rows.
    axes : ndarray of shape (n_features, n_axes)
        Axes.

    Returns
    -------
    ndarray of shape (n_rows, n_axes)
        Their product.
    """
    return (rows[..., np.newaxis, :] @ axes)[..., 0, :]


def squared_distances(
    rows: Array,
    axes: Array,
    references: Any,
    precisions: Any,
    indices: Any,
) -> Array:
    r"""Compute the mean of :math:`p_k (V^T x - m)_k^2` over the axes k, for each row x.

    Parameters
    ----------
    rows : ndarray of shape (n_rows, n_features)
        Rows.
    axes : ndarray of shape (n_features, n_axes)
        The matrix V.
    references : ndarray of shape (n_references, n_classes, n_axes)
        The references m, for example at several speeds.
    precisions : ndarray of shape (n_references, n_axes)
        The reciprocal variances p.
    indices : ndarray of int of shape (n_tried, n_rows)
        References that each row is compared with.

    Returns
    -------
    ndarray of shape (n_tried, n_rows, n_classes)
        The means; 0 without axes.

    Examples
    --------
    >>> rows, references = np.array([[3.0, 5.0]]), np.ones((1, 1, 2))
    >>> precisions, index = np.array([[1.0, 0.5]]), np.zeros((1, 1), int)
    >>> squared_distances(rows, np.eye(2), references, precisions, index)
    array([[[6.]]])
    """
    along = along_axes(rows, axes)
    squares = np.zeros((*indices.shape, references.shape[1]))
    if axes.shape[1] == 0:
        return squares
    for of_tried, tried in zip(squares, indices, strict=True):
        for index in np.unique(tried):
            is_compared = tried == index
            of_tried[is_compared] = cdist(
                along[is_compared],
                references[index],
                "sqeuclidean",
                w=precisions[index],
            )
    return squares / axes.shape[1]
