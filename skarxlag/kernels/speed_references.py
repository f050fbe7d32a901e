"""References of conditions as functions of the shaft's speed, and what they say of the drift."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .group_means import group_means
from .speed_drift import drift_factor, speed_distance


def mean_by_speed(
    values: NDArray[Any], speed: NDArray[Any], group: NDArray[Any], weights: NDArray[Any]
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Compute the weighted mean of each group of rows at each speed.

    Parameters
    ----------
    values : ndarray of shape (n_rows, ...)
        Rows.
    speed, group : ndarray of int of shape (n_rows,)
        Index of the speed and of the group of each row. Each index occurs.
    weights : ndarray of shape (n_rows,)
        Weight of each row, above 0.

    Returns
    -------
    means : ndarray of shape (n_speeds, n_groups, ...)
        Means; 0 if a group has no row at a speed.
    recorded : ndarray of bool of shape (n_speeds, n_groups)
        Whether it has one.

    Examples
    --------
    >>> rows, speed, group = np.array([1.0, 3.0, 5.0]), np.array([0, 0, 1]), np.array([0, 0, 1])
    >>> mean_by_speed(rows, speed, group, np.ones(3))[0]
    array([[2., 0.],
           [0., 5.]])
    """
    n_speeds, n_groups = speed.max() + 1, group.max() + 1
    present, cell = np.unique(speed * n_groups + group, return_inverse=True)
    means = np.zeros((n_speeds * n_groups, *values.shape[1:]))
    means[present] = group_means(values, cell.reshape(-1), weights)
    recorded = np.isin(np.arange(len(means)), present).reshape(n_speeds, n_groups)
    return means.reshape(n_speeds, n_groups, *values.shape[1:]), recorded


def references_at(
    log_speed: NDArray[Any],
    known: NDArray[Any],
    means: NDArray[Any],
    recorded: NDArray[Any],
) -> tuple[NDArray[Any], NDArray[Any]]:
    r"""Interpolate the mean of each condition at speeds, and state the variance of its drift.

    The mean is linear in the logarithm of the speed between two speeds at which the condition was
    recorded, and constant outside. The variance is that of
    :func:`skarxlag.kernels.speed_drift.speed_distance`.

    Parameters
    ----------
    log_speed : ndarray of shape (n_rows,)
        Logarithms of speeds.
    known : ndarray of shape (n_speeds,)
        Logarithms of the training speeds, ascending.
    means : ndarray of shape (n_speeds, n_conditions, ...)
        Mean of each condition at each training speed.
    recorded : ndarray of bool of shape (n_speeds, n_conditions)
        Means that count. Every condition has one.

    Returns
    -------
    references : ndarray of shape (n_rows, n_conditions, ...)
        Means at the speeds.
    variance : ndarray of shape (n_rows,)
        Largest variance of the drift over the conditions.

    Examples
    --------
    >>> means = np.array([[1.0, 5.0], [3.0, 0.0]])
    >>> recorded = np.array([[True, True], [True, False]])
    >>> references, _ = references_at(np.array([0.5]), np.array([0.0, 1.0]), means, recorded)
    >>> references
    array([[2., 5.]])
    """
    references = np.empty((len(log_speed), *means.shape[1:]))
    variance = np.zeros(len(log_speed))
    for pattern in np.unique(recorded, axis=1).T:
        own = np.flatnonzero((recorded == pattern[:, np.newaxis]).all(axis=0))
        at = speed_distance(log_speed, known[pattern])
        references[:, own] = at.interpolate(means[pattern][:, own])
        variance = np.maximum(variance, at.variance)
    return references, variance


def drift_learned(known: NDArray[Any], means: NDArray[Any], recorded: NDArray[Any]) -> NDArray[Any]:
    r"""Compute by how much each mean misses what the other training speeds predict.

    Each difference is divided by the standard deviation that the Brownian motion states for its
    distance, so that its square is an observation of the drift over the unit distance.

    Parameters
    ----------
    known, means, recorded
        As in :func:`references_at`.

    Returns
    -------
    ndarray of shape (n_differences, ...)
        One difference for each condition and speed, for conditions of several speeds.

    Examples
    --------
    >>> known, recorded = np.array([0.0, 0.2, 0.4]), np.ones((3, 1), dtype=bool)
    >>> drift_learned(known, np.array([[0.0], [1.0], [2.0]]), recorded).round(2)
    array([-1.41,  0.  ,  1.41])
    """
    found = []
    for place, speed in enumerate(known):
        others = recorded & (np.arange(len(known)) != place)[:, np.newaxis]
        for c in np.flatnonzero(recorded[place] & others.any(axis=0)):
            own = others[:, c]
            at = speed_distance(speed[np.newaxis], known[own])
            difference = means[place, c] - at.interpolate(means[own, c])[0]
            found.append(difference / np.sqrt(drift_factor(at.variance)[0]))
    return np.array(found).reshape(len(found), *means.shape[2:])


def speeds_to_try(known: NDArray[Any]) -> NDArray[Any]:
    """Return the training speeds and the middle of every two neighbours, as logarithms.

    Parameters
    ----------
    known : ndarray of shape (n_speeds,)
        Logarithms of the training speeds, ascending.

    Returns
    -------
    ndarray of shape (2 * n_speeds - 1,)
        Logarithms of speeds, ascending.

    Examples
    --------
    >>> speeds_to_try(np.array([0.0, 1.0]))
    array([0. , 0.5, 1. ])
    """
    return np.interp(np.arange(0, len(known) - 0.5, 0.5), np.arange(len(known)), known)
