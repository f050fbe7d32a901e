"""Centring and scaling of windows, which is also safe for huge, tiny and constant windows."""

import numpy as np

from .arrays import Array

#: A channel whose largest and smallest value differ by less than twice this times the
#: largest absolute value is rounding, not signal.
ROUNDING = 8 * np.finfo(np.float64).eps


def centred(signals: Array) -> tuple[Array, Array]:
    """Subtract the mean of every row. A row that is constant up to rounding becomes zero.

    Parameters
    ----------
    signals : ndarray of shape (..., n_samples)
        Any finite values.

    Returns
    -------
    unit : ndarray of shape (..., n_samples)
        Centred rows divided by `peak`.
    peak : ndarray of shape (..., 1)
        Largest absolute value of the row, in the unit of the signal; 1 if the row is
        zero.
    """
    signals = np.ascontiguousarray(signals, dtype=np.float64)
    highest = signals.max(axis=-1, keepdims=True)
    lowest = signals.min(axis=-1, keepdims=True)
    peak = np.maximum(highest, -lowest)
    peak[peak == 0] = 1.0
    # Dividing in two steps: the reciprocal of a subnormal peak is infinite.
    unit = signals / peak
    unit -= unit.mean(axis=-1, keepdims=True)
    span = highest / peak - lowest / peak
    unit[span[..., 0] <= 2 * ROUNDING] = 0.0
    return unit, peak


def largest(signals: Array) -> Array:
    """Return the largest absolute value over the last axis, which is kept, without a copy."""
    highest = signals.max(axis=-1, keepdims=True)
    lowest = signals.min(axis=-1, keepdims=True)
    return np.maximum(highest, -lowest)


def unit_rms_windows(windows: Array) -> tuple[Array, Array]:
    """Centre every channel of each window, and divide it by the root mean square of the output.

    All channels of a window are divided by the same number, so that a linear model
    between the channels keeps its coefficients.

    Parameters
    ----------
    windows : ndarray of shape (n_windows, n_channels, n_samples)
        Channel 0 is the output.

    Returns
    -------
    scaled : ndarray of shape (n_windows, n_channels, n_samples)
        Scaled windows. The output has a root mean square of 1, or is zero if it was
        constant.
    rms : ndarray of shape (n_windows,)
        The divisor of each window, in the unit of the output; 1 for a constant output.
    """
    unit, peak = centred(windows)
    output = unit[:, 0]
    rms = np.sqrt(np.einsum("wk,wk->w", output, output) / output.shape[-1])
    constant = rms == 0
    rms[constant] = 1.0
    peak[constant, 0] = 1.0
    scale = peak / peak[:, :1]
    unit *= scale / rms[:, np.newaxis, np.newaxis]
    return unit, rms * peak[:, 0, 0]


def root_mean_square(signals: Array) -> Array:
    """Return the root mean square over the last axis, without overflow or underflow of squares."""
    peak = largest(signals)
    peak[peak == 0] = 1.0
    mean_square = np.mean((signals / peak) ** 2, axis=-1)
    return peak[..., 0] * np.sqrt(mean_square)


def fit_percentage(output: Array, predicted: Array) -> Array:
    r"""Return one minus the normalised root mean square error, in percent.

    :math:`100\,(1 - \|y - \hat y\| / \|y - \bar y\|)` is the usual measure of fit in
    system identification.

    Parameters
    ----------
    output, predicted : ndarray of shape (..., n_samples)
        Measured and predicted output, which are broadcast against each other.

    Returns
    -------
    ndarray of shape (...)
        100 if the prediction is exact, 0 if it is no better than the mean, and negative
        if it is worse. For a constant output it is 100.

    Examples
    --------
    >>> float(fit_percentage(np.array([1.0, -1.0, 1.0, -1.0]), np.array([1.0, -1.0, 1.0, 1.0])))
    0.0
    """
    output = np.asarray(output, dtype=np.float64)
    unit, peak = centred(output)
    spread = np.linalg.norm(unit, axis=-1)
    error = np.linalg.norm((output - predicted) / peak, axis=-1)
    is_constant = spread == 0
    relative_error = error / np.where(is_constant, 1.0, spread)
    return np.where(is_constant, 100.0, 100 * (1 - relative_error))
