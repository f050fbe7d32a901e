"""Centring and scaling of windows, safe for huge, tiny and constant ones."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

#: A channel whose values differ by less than this times its largest value is rounding, not signal.
ROUNDING = 8 * np.finfo(np.float64).eps


def centred(signals: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Take the mean off every row, and off rows that are constant everything.

    Parameters
    ----------
    signals : ndarray of shape (..., n_samples)
        Any finite values.

    Returns
    -------
    unit : ndarray of shape (..., n_samples)
        Centred rows divided by `peak`.
    peak : ndarray of shape (..., 1)
        Largest value of the row, in the unit of the signal; 1 where the row is zero.
    """
    signals = np.ascontiguousarray(signals, dtype=np.float64)
    peak = largest(signals)
    peak[peak == 0] = 1.0
    # Dividing in two steps: the reciprocal of a subnormal peak is infinite.
    unit = signals / peak
    unit -= unit.mean(axis=-1, keepdims=True)
    unit[largest(unit)[..., 0] <= ROUNDING] = 0.0
    return unit, peak


def largest(signals: Any) -> Any:
    """Largest size over the last axis, which is kept; without a copy of the signals."""
    highest = np.max(signals, axis=-1, keepdims=True)
    return np.maximum(highest, -np.min(signals, axis=-1, keepdims=True))


def unit_rms_windows(windows: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Windows centred by channel and divided by the root-mean-square of their output.

    All channels of a window are divided by one number, so a linear model between them keeps its
    coefficients.

    Parameters
    ----------
    windows : ndarray of shape (n_windows, n_channels, n_samples)
        Channel 0 is the output.

    Returns
    -------
    scaled : ndarray of shape (n_windows, n_channels, n_samples)
        Output of unit root-mean-square, or of zeros where it was constant.
    rms : ndarray of shape (n_windows,)
        What was divided by, in the unit of the output; 1 for a constant output.
    """
    unit, peak = centred(windows)
    rms = np.sqrt(np.einsum("wk,wk->w", unit[:, 0], unit[:, 0]) / unit.shape[-1])
    constant = rms == 0
    rms[constant] = 1.0
    peak[constant, 0] = 1.0
    unit[:, 0] /= rms[:, np.newaxis]
    ratio = peak[:, 1:] / peak[:, :1]
    unit[:, 1:] *= ratio / rms[:, np.newaxis, np.newaxis]
    return unit, rms * peak[:, 0, 0]


def root_mean_square(signals: Any) -> Any:
    """Root-mean-square over the last axis without overflow or underflow of the squares."""
    peak = largest(signals)
    peak[peak == 0] = 1.0
    return peak[..., 0] * np.sqrt(np.mean((signals / peak) ** 2, axis=-1))


def fit_percentage(output: NDArray[Any], predicted: NDArray[Any]) -> NDArray[Any]:
    r"""One minus the normalised root-mean-square error, in percent.

    :math:`100\,(1 - \|y - \hat y\| / \|y - \bar y\|)`, as system identification reports a fit.

    Parameters
    ----------
    output, predicted : ndarray of shape (..., n_samples)
        Measured and predicted output; they broadcast against each other.

    Returns
    -------
    ndarray of shape (...)
        100 where the prediction is exact, 0 where it is no better than the mean, negative where
        it is worse; 100 where the output is constant.

    Examples
    --------
    >>> float(fit_percentage(np.array([1.0, -1.0, 1.0, -1.0]), np.array([1.0, -1.0, 1.0, 1.0])))
    0.0
    """
    output = np.asarray(output, dtype=np.float64)
    unit, peak = centred(output)
    spread = np.linalg.norm(unit, axis=-1)
    constant = spread == 0
    error = np.linalg.norm((output - predicted) / peak, axis=-1)
    return np.where(constant, 100.0, 100 * (1 - error / np.where(constant, 1.0, spread)))
