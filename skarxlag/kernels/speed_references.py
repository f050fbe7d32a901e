"""References of conditions as functions of the shaft's speed, and the variance of their drift.

Features are modelled as Brownian motion over x, the logarithm of the speed. Between two
speeds with known recordings this is a Brownian bridge, and outside them it is free
Brownian motion. Variances are stated for a change of speed by the factor 1.3, which is
called the unit distance.
"""

from typing import NamedTuple

import numpy as np

from .arrays import Array

#: A change of log speed in which the drift has its stated variance.
UNIT_DISTANCE = float(np.log(1.3))
#: A change of log speed over which log spectra drift as `smooth_variance` states, and
#: the least share of that drift, for recordings at one and the same speed.
_SPECTRAL_DISTANCE = 0.4
LEAST_DRIFT = 0.2
#: Speeds within this distance of each other count as one.
SAME_LOG_SPEED = 0.02


class Distance(NamedTuple):
    """Position of speeds relative to the known speeds.

    Attributes
    ----------
    lower, upper : ndarray of int of shape (n_rows,)
        Indices of the known speeds on either side. Outside the known range, both are
        the index of the nearest known speed.
    share : ndarray of shape (n_rows,)
        Weight of the upper one in a linear interpolation, from 0 to 1.
    variance : ndarray of shape (n_rows,)
        Variance of the Brownian motion, given the known speeds.
    beyond : ndarray of shape (n_rows,)
        Log speed above the highest known one, negative below the lowest, 0 between.
    """

    lower: np.ndarray
    upper: np.ndarray
    share: np.ndarray
    variance: np.ndarray
    beyond: np.ndarray

    def interpolate(self, known_values: Array) -> Array:
        """Interpolate values of the known speeds linearly, along the first axis."""
        n_further_axes = known_values.ndim - 1
        share = self.share.reshape(-1, *[1] * n_further_axes)
        below = known_values[self.lower]
        above = known_values[self.upper]
        return (1 - share) * below + share * above


def speed_distance(log_speed: Array, known_speeds: Array) -> Distance:
    r"""Compute the position of speeds relative to the known speeds, and the variance of the drift.

    Let h be the distance between two neighbouring known speeds, and t the position
    between them as a share of h. The Brownian bridge has the variance :math:`t (1 -
    t)\,h / L`, where L is the unit distance. Outside the known range, the variance of
    the Brownian motion is the distance from the nearest known speed, divided by L.

    Parameters
    ----------
    log_speed : ndarray of shape (n_rows,)
        Logarithms of speeds.
    known_speeds : ndarray of shape (n_speeds,)
        Logarithms of the known speeds, ascending.

    Returns
    -------
    Distance
        Neighbours, weights, variances and distances beyond the known range.

    Examples
    --------
    >>> at = speed_distance(np.log([1000.0, 1300.0, 2197.0]), np.log([1000.0, 1690.0]))
    >>> at.share.round(3)
    array([0. , 0.5, 1. ])
    >>> at.variance.round(3)
    array([0. , 0.5, 1. ])
    """
    inside = np.clip(log_speed, known_speeds[0], known_speeds[-1])
    first_upper = min(len(known_speeds) - 1, 1)
    upper = np.searchsorted(known_speeds[1:-1], inside) + first_upper
    lower = np.maximum(upper - 1, 0)
    step = known_speeds[upper] - known_speeds[lower]
    # There is no step if only one speed is known, and all shares are 0.
    share = inside - known_speeds[lower]
    np.divide(share, step, out=share, where=step > 0)
    beyond = log_speed - inside
    variance = share * (1 - share) * step + np.abs(beyond)
    return Distance(lower, upper, share, variance / UNIT_DISTANCE, beyond)


def drift_factor(variance: Array) -> Array:
    """Return the factor on the prior drift of log spectra, from the variance of the motion.

    The prior is stated for a change of log speed by 0.4. At least 20 % of it remain at
    a training speed, since two recordings at one speed differ, too.

    Parameters
    ----------
    variance : ndarray of shape (n_rows,)
        Variances of :func:`speed_distance`.

    Returns
    -------
    ndarray of shape (n_rows,)
        Factors, 1 for a distance of 0.4 from the nearest known speed.

    Examples
    --------
    >>> at = speed_distance(np.array([0.0, 0.2, 0.4]), np.zeros(1))
    >>> drift_factor(at.variance).round(3)
    array([0.2, 0.5, 1. ])
    """
    return np.maximum(variance * (UNIT_DISTANCE / _SPECTRAL_DISTANCE), LEAST_DRIFT)


def group_speeds(log_speed: Array) -> tuple[Array, Array]:
    """Group the lowest speed and those up to 2 % above it, then the others in the same way.

    Parameters
    ----------
    log_speed : ndarray of shape (n_rows,)
        Logarithms of speeds.

    Returns
    -------
    known_speeds : ndarray of shape (n_speeds,)
        Mean log speed of each group, ascending. A group spans 2 % at most.
    at : ndarray of int of shape (n_rows,)
        Group of each row.

    Examples
    --------
    >>> speeds, at = group_speeds(np.log([1000.0, 1500.0, 1010.0]))
    >>> np.exp(speeds).round(), at
    (array([1005., 1500.]), array([0, 1, 0]))
    """
    lowest: list[float] = []
    for value in np.unique(log_speed):
        if not lowest or value - lowest[-1] > SAME_LOG_SPEED:
            lowest.append(value)
    at = np.searchsorted(lowest, log_speed, side="right") - 1
    means = np.bincount(at, log_speed) / np.bincount(at)
    return means, at


def group_means(values: Array, group: Array, weights: Array) -> Array:
    """Compute the weighted mean of each group of rows.

    Parameters
    ----------
    values : ndarray of shape (n_rows, ...)
        Rows.
    group : ndarray of int of shape (n_rows,)
        Group of each row, 0 to n_groups - 1, each with a row.
    weights : ndarray of shape (n_rows,)
        Weight of each row, above 0.

    Returns
    -------
    ndarray of shape (n_groups, ...)
        Means.

    Examples
    --------
    >>> group_means(np.array([1.0, 2.0, 5.0]), np.array([1, 0, 0]), np.array([1.0, 2.0, 1.0]))
    array([3., 1.])
    """
    means = []
    for number in range(group.max() + 1):
        rows = group == number
        means.append(np.average(values[rows], axis=0, weights=weights[rows]))
    return np.stack(means)


def filled_references(known_speeds: Array, means: Array, recorded: Array) -> Array:
    """Return means of each condition at all training speeds, also at those without a recording.

    The mean of a condition is linear in the logarithm of the speed between two speeds
    at which the condition was recorded, and constant outside.

    Parameters
    ----------
    known_speeds : ndarray of shape (n_speeds,)
        Logarithms of the training speeds, ascending.
    means : ndarray of shape (n_speeds, n_conditions, ...)
        Means; those that were not recorded may have any value.
    recorded : ndarray of bool of shape (n_speeds, n_conditions)
        Means that count. Every condition has one.

    Returns
    -------
    ndarray of shape (n_speeds, n_conditions, ...)
        Means. Between two training speeds, they are interpolated.

    Examples
    --------
    >>> recorded = np.array([[True], [False], [True]])
    >>> means = np.array([[1.0], [0.0], [2.0]])
    >>> filled_references(np.array([0.0, 0.5, 1.0]), means, recorded).ravel()
    array([1. , 1.5, 2. ])
    """
    filled = np.empty_like(means)
    for c, is_known in enumerate(recorded.T):
        at = speed_distance(known_speeds, known_speeds[is_known])
        filled[:, c] = at.interpolate(means[is_known, c])
    return filled


def drift_variance(log_speed: Array, known_speeds: Array, recorded: Array) -> Array:
    """Return the largest variance of :func:`speed_distance` over the conditions.

    Parameters
    ----------
    log_speed : ndarray of shape (n_rows,)
        Logarithms of speeds.
    known_speeds, recorded
        As in :func:`filled_references`.

    Returns
    -------
    ndarray of shape (n_rows,)
        Variances.
    """
    # Conditions that were recorded at the same speeds have the same variance.
    patterns = {tuple(column) for column in recorded.T.tolist()}
    of_patterns = [
        speed_distance(log_speed, known_speeds[np.array(is_known)]).variance
        for is_known in patterns
    ]
    return np.max(of_patterns, axis=0)


def drift_learned(known_speeds: Array, means: Array, recorded: Array) -> Array:
    r"""Compute by how much each mean misses what the other training speeds predict.

    Each difference is divided by the standard deviation that the Brownian motion states
    for its distance, so that its square is an observation of the drift over the unit
    distance.

    Parameters
    ----------
    known_speeds, recorded
        As in :func:`filled_references`.
    means : ndarray of shape (n_speeds, n_conditions, ...)
        Mean of each condition at each training speed.

    Returns
    -------
    ndarray of shape (n_differences, ...)
        One difference for each condition and speed, for conditions of several speeds.

    Examples
    --------
    >>> known_speeds, recorded = np.array([0.0, 0.2, 0.4]), np.ones((3, 1), dtype=bool)
    >>> drift_learned(known_speeds, np.array([[0.0], [1.0], [2.0]]), recorded).round(2)
    array([-1.41,  0.  ,  1.41])
    """
    differences = []
    for i, speed in enumerate(known_speeds):
        others = recorded.copy()
        others[i] = False
        for c in np.flatnonzero(recorded[i] & others.any(axis=0)):
            rest = others[:, c]
            at = speed_distance(speed[np.newaxis], known_speeds[rest])
            difference = means[i, c] - at.interpolate(means[rest, c])[0]
            factor = drift_factor(at.variance)[0]
            differences.append(difference / np.sqrt(factor))
    return np.array(differences).reshape(len(differences), *means.shape[2:])
