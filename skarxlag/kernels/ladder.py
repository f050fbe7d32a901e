"""Thresholds, rungs and confidences of the ladder (equations 23-32)."""

import math

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import log_softmax

from .arrays import Array

#: Natural logarithms that stand for a level of zero and for no bound above.
_LOG_ZERO = -745.0
_LOG_INFINITE = 745.0
#: Nepers that a level on a cut scores less on the rung above it.
_TIE = 1e-9


def rows_that_hold(rate: float) -> int:
    """Return the number of rows that hold a false-alarm rate without any assumption.

    A further row of the same kind exceeds all of n rows with the probability 1 / (n +
    1).

    Parameters
    ----------
    rate : float
        False-alarm rate, in (0, 1).

    Returns
    -------
    int
        The smallest n with 1 / (n + 1) <= rate.

    Examples
    --------
    >>> rows_that_hold(0.01)
    99
    """
    # 1 / rate may be a whole number but for rounding.
    return math.ceil(round(1 / rate - 1, 6))


def false_alarm_threshold(levels: Array, weights: Array, rate: float) -> float:
    """Return the level that a healthy window exceeds with at most the stated probability.

    The threshold is the order statistic ceil((n + 1)(1 - rate)) of n healthy levels. If
    the windows are exchangeable, a new window exceeds it with a probability of at most
    `rate` (conformal prediction). With fewer than 1 / rate - 1 levels, the threshold is
    the largest level, and the probability is 1 / (n + 1).

    Parameters
    ----------
    levels : ndarray of shape (n_windows,)
        Healthy levels.
    weights : ndarray of shape (n_windows,)
        Number of windows that each level stands for, above 0; n is their sum.
    rate : float
        False-alarm rate, in (0, 1).

    Returns
    -------
    float
        The threshold, in the unit of the levels.

    Examples
    --------
    >>> false_alarm_threshold(np.arange(1.0, 100.0), np.ones(99), rate=0.05)
    95.0
    """
    order, counted = _counted_in_order(levels, weights)
    # (n + 1)(1 - rate) may be a whole number but for rounding.
    rank = (counted[-1] + 1) * (1 - rate) - 1e-9
    index = min(np.searchsorted(counted, rank), len(order) - 1)
    return float(levels[order[index]])


def weighted_median(levels: Array, weights: Array) -> float:
    """Return the weighted median of levels, where each level stands for a number of windows.

    Parameters
    ----------
    levels, weights : ndarray of shape (n_windows,)
        Levels, and the number of windows that each level stands for, above 0.

    Returns
    -------
    float
        The middle level, or the mean of the two middle levels.

    Examples
    --------
    >>> weighted_median(np.array([3.0, 1.0, 2.0]), np.array([1.0, 2.0, 1.0]))
    1.5
    """
    order, counted = _counted_in_order(levels, weights)
    half = counted[-1] / 2
    middle = [np.searchsorted(counted, half, side) for side in ("left", "right")]
    return float(np.mean(levels[order[middle]]))


def _counted_in_order(levels, weights):
    """Return the indices that sort the levels, and the cumulative number of windows."""
    order = np.argsort(levels, kind="stable")
    return order, np.cumsum(weights[order])


def log_level(levels: Array) -> Array:
    """Return the natural logarithm of levels, which is finite for a level of 0, too."""
    levels = np.asarray(levels, dtype=np.float64)
    return np.log(levels, out=np.full(levels.shape, _LOG_ZERO), where=levels > 0)


def rung_scores(levels: Array, cuts: Array) -> Array:
    """Compute the signed log distance of levels to the bounds of each rung, positive inside.

    Rung i contains the levels in (cuts[i-1], cuts[i]]. This is Eq. (32), with a rule
    for equality, which the paper does not state.

    Parameters
    ----------
    levels : ndarray of shape (n_windows,)
        Residual levels, at least 0.
    cuts : ndarray of shape (n_rungs - 1,)
        Thresholds between neighbouring rungs, ascending.

    Returns
    -------
    ndarray of shape (n_windows, n_rungs)
        Scores in nepers.

    Examples
    --------
    >>> rung_scores(np.array([1.0, 4.0]), np.array([2.0])).round(3)
    array([[ 0.693, -0.693],
           [-0.693,  0.693]])
    """
    level = log_level(levels)[:, np.newaxis]
    bounds = np.concatenate([[_LOG_ZERO - 1], log_level(cuts), [_LOG_INFINITE]])
    above_lower = level - bounds[:-1] - _TIE
    below_upper = bounds[1:] - level
    return np.minimum(above_lower, below_upper)


def relative_scores(levels: Array) -> Array:
    """Compute how far each residual of a window lies below the geometric mean of all, in nepers.

    Parameters
    ----------
    levels : ndarray of shape (n_windows, n_models)
        Residual levels, at least 0.

    Returns
    -------
    ndarray of shape (n_windows, n_models)
        Scores. A factor that is common to all models cancels.

    Examples
    --------
    >>> relative_scores(np.array([[1.0, 4.0], [10.0, 40.0]])).round(3)
    array([[ 0.693, -0.693],
           [ 0.693, -0.693]])
    """
    level = log_level(levels)
    return level.mean(axis=1, keepdims=True) - level


def confidence_scale(scores: Array, target: Array, weights: Array) -> float:
    r"""Fit the factor :math:`\beta` for which softmax of the scaled scores is a confidence.

    The factor maximises the likelihood of the targets. The targets are smoothed as in
    Platt (1999): the probability of the true class is set to (n + 1)/(n + 2) for a
    class of n windows. The factor therefore stays finite even if all scores are
    correct.

    Parameters
    ----------
    scores : ndarray of shape (n_windows, n_classes)
        Scores; a larger score means a more likely class.
    target : ndarray of shape (n_windows,)
        Column of the true class.
    weights : ndarray of shape (n_windows,)
        Number of windows that each row stands for, above 0.

    Returns
    -------
    float
        The factor, from :math:`e^{-10}` to :math:`e^{10}`.
    """
    n_classes = scores.shape[1]
    if n_classes == 1:
        return 1.0
    counts = np.bincount(target, weights, minlength=n_classes)
    doubt = 1 / (counts[target] + 2)
    doubt_of_others = doubt / (n_classes - 1)
    smoothed = np.repeat(doubt_of_others[:, np.newaxis], n_classes, axis=1)
    smoothed[np.arange(len(target)), target] = 1 - doubt

    def loss(log_factor):
        log_confidence = log_softmax(np.exp(log_factor) * scores, axis=1)
        cross_entropy = -np.sum(smoothed * log_confidence, axis=1)
        return np.average(cross_entropy, weights=weights)

    best = minimize_scalar(loss, bounds=(-10, 10), method="bounded")
    return float(np.exp(best.x))
