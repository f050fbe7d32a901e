"""Measures of an estimate of a known signal: error, delay, bias, settling."""

import numpy as np
from scipy.signal import correlate, correlation_lags


def normalised_error(estimate, true):
    """Root-mean-square of the error relative to that of the true signal, over all windows.

    1 is as good as to estimate nothing at all.

    Parameters
    ----------
    estimate, true : ndarray of shape (n_windows, n_samples)
        Estimate and truth.

    Examples
    --------
    >>> normalised_error(np.array([[6.0, 4.0]]), np.array([[3.0, 4.0]]))
    0.6
    """
    return float(np.linalg.norm(estimate - true) / np.linalg.norm(true))


def delay(estimate, true):
    """Lag of the peak of the cross-correlation, summed over windows that are centred.

    Parameters
    ----------
    estimate, true : ndarray of shape (n_windows, n_samples)
        Estimate and truth.

    Returns
    -------
    lag : float
        In samples, above 0 where the estimate is late; NaN for a signal that is
        constant.
    correlation : float
        The peak, as a correlation coefficient.

    Examples
    --------
    >>> true = np.random.default_rng(0).normal(size=(2, 100))
    >>> lag, correlation = delay(3 * np.roll(true, 5, axis=1), true)
    >>> lag, round(correlation, 2)
    (5.0, 0.94)
    """
    a, b = (each - each.mean(axis=1, keepdims=True) for each in (estimate, true))
    size = np.linalg.norm(a) * np.linalg.norm(b)
    if np.linalg.norm(b) <= 1e-12 * np.linalg.norm(true) or size == 0:
        return np.nan, np.nan
    summed = sum(correlate(row_a, row_b) for row_a, row_b in zip(a, b, strict=True))
    peak = int(np.argmax(summed))
    lags = correlation_lags(estimate.shape[1], true.shape[1])
    return float(lags[peak]), float(summed[peak] / size)


def aligned(estimate, true, lag):
    """Both signals over the samples that remain once the estimate is moved back by `lag`."""
    lag = int(lag)
    if lag < 0:
        return estimate[:, :lag], true[:, -lag:]
    return estimate[:, lag:], true[:, : true.shape[1] - lag]


def bias(estimate, true):
    """Mean of the error relative to the root-mean-square of the true signal.

    Examples
    --------
    >>> bias(np.array([[1.5, -0.5]]), np.array([[1.0, -1.0]]))
    0.5
    """
    return float(np.mean(estimate - true) / np.sqrt(np.mean(true**2)))


def settling_time(estimate, size, onset, tolerance=0.05):
    """Samples after the onset until the estimate stays within a tolerance of a step.

    Parameters
    ----------
    estimate : ndarray of shape (n_samples,)
        Estimate, free of noise.
    size : float
        The step.
    onset : int
        Its first sample.
    tolerance : float, default=0.05
        Relative to the step.

    Examples
    --------
    >>> settling_time(np.array([0, 0, 0.5, 0.9, 0.96, 1.0]), size=1.0, onset=2)
    2
    """
    outside = np.flatnonzero(np.abs(estimate[onset:] - size) > tolerance * abs(size))
    return int(outside[-1]) + 1 if len(outside) else 0
