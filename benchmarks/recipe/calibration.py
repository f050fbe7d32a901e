"""Measures of how well stated probabilities agree with the share of right verdicts."""

import numpy as np


def expected_calibration_error(confidence, correct, n_bins=10):
    """Compute the mean distance of confidence and accuracy over equal bins.

    Bins are weighted by their number of verdicts. Naeini, Cooper and Hauskrecht (2015),
    AAAI, 2901-2907.

    Parameters
    ----------
    confidence : array of shape (n_verdicts,)
        Stated probability of the verdict, in [0, 1].
    correct : array of bool of shape (n_verdicts,)
        Whether the verdict is right.
    n_bins : int, default=10
        Number of bins.

    Returns
    -------
    error : float

    Examples
    --------
    >>> expected_calibration_error(np.array([0.9, 0.9, 0.6]), np.array([True, True, False]))
    0.267
    """
    where = np.minimum((np.asarray(confidence) * n_bins).astype(int), n_bins - 1)
    excess = np.bincount(
        where, weights=np.asarray(confidence) - np.asarray(correct, dtype=float)
    )
    return round(float(np.abs(excess).sum() / len(where)), 3)
