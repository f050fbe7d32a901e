"""Model of how the features of a healthy bearing change with speed.

The features are modelled as Brownian motion over x, the logarithm of the speed. Between two speeds
with known recordings this is a Brownian bridge, and outside them it is free Brownian motion. All
variances are stated for a change of speed by the factor 1.3, which is called the unit distance.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from .compiled import compiled
from .drift import raised_noise, scaled_frequency, smooth_variance
from .healthy_rows import N_COEFFICIENTS, log_spectra_cepstra

#: A change of log speed in which the drift has its stated variance.
UNIT_DISTANCE = float(np.log(1.3))
#: Drift between two recordings at one and the same speed, as a share of the drift over the unit
#: distance.
SAME_SPEED = 0.04
#: A change of log speed over which log spectra drift as `smooth_variance` states, and the least
#: share of that drift, for recordings at one and the same speed.
_SPECTRAL_DISTANCE, _LEAST_DRIFT = 0.4, 0.2
#: Speeds within this distance of each other count as one.
SAME_LOG_SPEED = 0.02


class Distance(NamedTuple):
    """Position of speeds relative to the known speeds.

    Attributes
    ----------
    lower, upper : ndarray of int of shape (n_rows,)
        Indices of the known speeds on either side. Outside the known range, both are the index of
        the nearest known speed.
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

    def interpolate(self, known_values: NDArray[Any]) -> NDArray[Any]:
        """Linear interpolation of what is known at the speeds, along the first axis."""
        share = self.share.reshape(-1, *(1,) * (known_values.ndim - 1))
        return (1 - share) * known_values[self.lower] + share * known_values[self.upper]


def speed_distance(log_speed: NDArray[Any], known: NDArray[Any]) -> Distance:
    r"""Compute the position of speeds relative to the known speeds, and the variance of the drift.

    Let h be the distance between two neighbouring known speeds, and t the position between them as
    a share of h. The Brownian bridge has the variance :math:`t (1 - t)\,h / L`, where L is the unit
    distance. Outside the known range, the variance of the Brownian motion is the distance from the
    nearest known speed, divided by L.

    Parameters
    ----------
    log_speed : ndarray of shape (n_rows,)
        Logarithms of speeds.
    known : ndarray of shape (n_speeds,)
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
    inside = np.clip(log_speed, known[0], known[-1])
    if len(known) == 1:
        lower = upper = np.zeros(len(inside), dtype=int)
        share = variance = np.zeros(len(inside))
    else:
        upper = np.clip(np.searchsorted(known, inside), 1, len(known) - 1)
        lower = upper - 1
        step = known[upper] - known[lower]
        share = (inside - known[lower]) / step
        variance = share * (1 - share) * step
    beyond = log_speed - inside
    return Distance(lower, upper, share, (variance + np.abs(beyond)) / UNIT_DISTANCE, beyond)


def drift_factor(variance: NDArray[Any]) -> NDArray[Any]:
    """Return the factor on the prior drift of log spectra, from the variance of the motion.

    The prior is stated for a change of log speed by 0.4. At least 20 % of it remain at a training
    speed, since two recordings at one speed differ, too.

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
    return np.maximum(variance * (UNIT_DISTANCE / _SPECTRAL_DISTANCE), _LEAST_DRIFT)


def group_speeds(log_speed: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Group speeds that differ by at most 2 %.

    Parameters
    ----------
    log_speed : ndarray of shape (n_rows,)
        Logarithms of speeds.

    Returns
    -------
    known : ndarray of shape (n_speeds,)
        Mean log speed of each group, ascending. A group spans 2 % at most.
    at : ndarray of int of shape (n_rows,)
        Group of each row.

    Examples
    --------
    >>> known, at = group_speeds(np.log([1000.0, 1500.0, 1010.0]))
    >>> np.exp(known).round(), at
    (array([1005., 1500.]), array([0, 1, 0]))
    """
    distinct, place = np.unique(log_speed, return_inverse=True)
    group, first, number = np.zeros(len(distinct), dtype=int), distinct[0], 0
    for i, value in enumerate(distinct):
        if value - first > SAME_LOG_SPEED:
            first, number = value, number + 1
        group[i] = number
    at = group[place.reshape(-1)]
    return np.bincount(at, log_speed) / np.bincount(at), at


def slope_against_speed(
    values: NDArray[Any], known: NDArray[Any], *, mean: float, deviation: float, drift: float
) -> tuple[float, float]:
    r"""Estimate the slope of a value against log speed, and the variance of this slope.

    For Brownian motion with a trend, only the two end points contain information about the trend.
    The estimate is :math:`(g_k - g_1) / (x_k - x_1)` with the variance
    :math:`\sigma^2 / (L\,(x_k - x_1))`. Bayes' rule for normal distributions combines it with the
    prior of the slope.

    Parameters
    ----------
    values : ndarray of shape (n_speeds,)
        The value at the known speeds.
    known : ndarray of shape (n_speeds,)
        Logarithms of the known speeds, ascending.
    mean, deviation : float
        Prior mean and prior standard deviation of the slope.
    drift : float
        Standard deviation :math:`\sigma` of the motion over the unit distance L.

    Returns
    -------
    slope, variance : float
        Posterior mean and variance of the slope.

    Examples
    --------
    >>> slope_against_speed(np.array([2.0]), np.array([0.0]), mean=1.0, deviation=0.5, drift=1.0)
    (1.0, 0.25)
    """
    weight = UNIT_DISTANCE / drift**2
    precision = 1 / deviation**2 + weight * (known[-1] - known[0])
    seen = mean / deviation**2 + weight * (values[-1] - values[0])
    return float(seen / precision), float(1 / precision)


def drift_covariance(
    colour: NDArray[Any],
    steadiness: NDArray[Any],
    *,
    smooth: float,
    rough: float,
    frequency: float,
    noise: float,
) -> NDArray[Any]:
    """Compute the covariance of the change of cepstra when the speed changes by the unit distance.

    The model has three causes of change: smooth and rough drift over frequency, a scaled frequency
    axis, and a rising noise floor. The last two are computed from the mean log spectra.

    Parameters
    ----------
    colour, steadiness : ndarray of shape (n_speeds, ...)
        Mean log spectra.
    smooth, rough : float
        Constants of `skarxlag.kernels.drift.smooth_variance`.
    frequency, noise : float
        Weights of the scaled frequency axis and of the raised noise floor.

    Returns
    -------
    ndarray of shape (n_features, n_features)
        The covariance, which is positive definite for `rough` above 0.
    """
    scaled = log_spectra_cepstra(scaled_frequency(colour), scaled_frequency(steadiness))
    raised = raised_noise(colour)
    raised = log_spectra_cepstra(raised, np.zeros((len(raised), steadiness.shape[1])))
    sizes = min(N_COEFFICIENTS, colour.shape[1] - 1), steadiness.shape[1] - 1
    variance = np.concatenate([smooth_variance(n, smooth, rough) for n in sizes])
    return (
        np.diag(variance)
        + frequency * scaled.T @ scaled / len(scaled)
        + noise * raised.T @ raised / len(raised)
    )


def joint_axes(scatter: NDArray[Any], drift: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
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
    if len(drift) == 0:
        return np.empty((0, 0)), np.empty(0)
    variances, axes = linalg.eigh(scatter, drift)
    return axes, np.maximum(variances, 0.0)


def along_axes(rows: NDArray[Any], axes: NDArray[Any]) -> NDArray[Any]:
    """Multiply rows by axes, with sums whose order does not depend on the number of rows.

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
    rows, axes = (np.require(a, np.float64, ["C", "W"]) for a in (rows, axes))
    product = np.zeros((len(rows), axes.shape[1]))
    _add_products(rows, axes, product)
    return product


@compiled
def _add_products(rows, axes, product):
    for row in range(rows.shape[0]):
        target = product[row]
        for i in range(axes.shape[0]):
            value, axis = rows[row, i], axes[i]
            for j in range(axes.shape[1]):
                target[j] += value * axis[j]
