"""Limits on the features of healthy bearings at any speed, from rows at some speeds.

The features of a row are its mean cepstrum, its impulsiveness and, if the gain of the
sensor is fixed, its level.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr

from .arrays import Array
from .drift import along_axes, drift_covariance, joint_axes
from .healthy_rows import Rows
from .speed_references import (
    SAME_SPEED,
    group_means,
    slope_against_speed,
    speed_distance,
)

#: Slope against log speed of log impulsiveness and of log level, beforehand: mean and
#: deviation; and their drift over the unit distance.
SLOPES = (
    {"mean": -0.7, "deviation": 0.7, "drift": 0.4},
    {"mean": 1.5, "deviation": 0.75, "drift": 0.3},
)
#: Fewest and most blocks of time that the rows of one speed are divided into. Between
#: these, a block has this many rows.
FEWEST_BLOCKS = 5
MOST_BLOCKS = 10
MANY_ROWS = 30
#: Scales of the drift that are tried, each sqrt(2) times the one before.
SCALES = 2.0 ** np.arange(-3, 6.25, 0.5)
#: The scale that holds at left-out speeds is multiplied by this: k speeds support only
#: the rate 1 / (k + 1).
SAFETY = 2.0
#: Drift of a row after the recording that calibrates its speed, as a share of the drift
#: over the unit distance.
SAME_RECORDING = 0.05
#: Rates that every left-out speed must hold, whatever rate is stated later.
HELD_RATES = (0.01, 0.05)
#: Least deviations: of the score of cepstra, and of impulsiveness and level, in nepers.
_LEAST_SCORE_DEVIATION = 0.05
_LEAST_DEVIATION = 0.02
_TINY = np.finfo(np.float64).tiny


class HealthyRows(NamedTuple):
    """Features of healthy rows, their speeds and their weights.

    Attributes
    ----------
    rows : Rows
        Features.
    known_speeds : ndarray of shape (n_speeds,)
        Log speeds, ascending.
    at : ndarray of int of shape (n_rows,)
        Speed of each row. Rows of one speed are in the order of time.
    weights : ndarray of shape (n_rows,)
        Weight of each row in means and covariances, above 0; only ratios count. A block
        of time counts as one block whatever its rows weigh.
    """

    rows: Rows
    known_speeds: np.ndarray
    at: np.ndarray
    weights: np.ndarray

    def take(self, is_taken: NDArray[np.bool_]) -> "HealthyRows":
        """Return some of the rows, and the speeds that they have."""
        speeds, at = np.unique(self.at[is_taken], return_inverse=True)
        return HealthyRows(
            rows=self.rows.take(is_taken),
            known_speeds=self.known_speeds[speeds],
            at=at,
            weights=self.weights[is_taken],
        )


class Limits(NamedTuple):
    """Expected features of healthy rows, and their scatter.

    Attributes
    ----------
    known_speeds : ndarray of shape (n_speeds,)
        Log speeds, ascending.
    axes : ndarray of shape (n_features, n_features)
        Coordinates in which the drift is the identity and the scatter diagonal.
    variances : ndarray of shape (n_features,)
        Scatter of rows in these coordinates.
    references : ndarray of shape (n_speeds, n_features)
        Mean cepstra in these coordinates.
    means : ndarray of shape (n_speeds, n_values)
        Mean impulsiveness, and mean level if it is used.
    slopes : ndarray of shape (n_values, 2)
        Slope of these values against log speed, and its variance.
    deviations : ndarray of shape (n_values,)
        Standard deviation of these values between blocks of time that are left out.
    score_mean, score_deviation : float
        Mean and standard deviation of the score of cepstra, between the same blocks.
    n_blocks : int
        Number of these blocks.
    """

    known_speeds: np.ndarray
    axes: np.ndarray
    variances: np.ndarray
    references: np.ndarray
    means: np.ndarray
    slopes: np.ndarray
    deviations: np.ndarray
    score_mean: float
    score_deviation: float
    n_blocks: int


def time_blocks(at: Array) -> Array:
    """Divide the rows of each speed into blocks of time.

    Parameters
    ----------
    at : ndarray of int of shape (n_rows,)
        Speed of each row; rows of one speed are in the order of time.

    Returns
    -------
    ndarray of int of shape (n_rows,)
        Block of each row, 0 to 9 at most.

    Examples
    --------
    >>> time_blocks(np.array([0, 0, 1, 1, 1, 1, 1, 1]))
    array([0, 1, 0, 0, 1, 2, 3, 4])
    """
    block = np.zeros(len(at), dtype=int)
    for speed in range(at.max() + 1):
        rows = np.flatnonzero(at == speed)
        n_rows = len(rows)
        n_blocks = min(np.clip(n_rows // MANY_ROWS, FEWEST_BLOCKS, MOST_BLOCKS), n_rows)
        block[rows] = np.arange(n_rows) * n_blocks // n_rows
    return block


def parts_of_rows(at: Array, n_windows: int) -> int:
    """Return the number of parts of long rows, so that few rows make enough blocks of time.

    Two rows at one speed are two blocks. Student's t distribution for two blocks has
    one degree of freedom, and its limit for a rate of 1 % is 32 deviations. A row of
    many windows is long enough for several blocks.

    Parameters
    ----------
    at : ndarray of int of shape (n_rows,)
        Speed of each row.
    n_windows : int
        Windows in a row.

    Returns
    -------
    int
        At most `n_windows`; 1 if there are many rows, or rows have one window.

    Examples
    --------
    >>> parts_of_rows(np.array([0, 0]), 10), parts_of_rows(np.array([0, 0]), 1)
    (3, 1)
    """
    fewest = int(np.bincount(at).min())
    return min(-(-FEWEST_BLOCKS // fewest), n_windows)


def calibrate(healthy: HealthyRows) -> Limits:
    """Compute limits from healthy rows, of which at least two have one speed.

    The scatter of rows about their expected values is measured on blocks of time. In
    turn, one block of each speed is excluded from the means and covariances, and then
    compared with them.
    """
    rows, known_speeds, at, weights = healthy
    block = time_blocks(at)
    # Score of the cepstra, and distances of the values, from what the other blocks
    # predict.
    n_values = rows.values.shape[1]
    away = np.full((len(at), 1 + n_values), np.nan)
    for number in range(block.max() + 1):
        # A speed all of whose rows are left out has nothing to be compared with.
        is_other = (block != number) & np.isin(at, at[block == number])
        is_left_out = (block == number) & np.isin(at, at[is_other])
        if not is_left_out.any():
            continue
        others = healthy.take(is_other)
        expected = _expected(others)
        speed = np.searchsorted(others.known_speeds, known_speeds[at[is_left_out]])
        away[is_left_out, 0] = _cepstral_score(
            rows.take(is_left_out),
            expected["axes"],
            expected["references"][speed],
            expected["variances"] + SAME_SPEED,
        )
        away[is_left_out, 1:] = rows.values[is_left_out] - expected["means"][speed]
    is_compared = ~np.isnan(away[:, 0])
    away = away[is_compared]
    weights = weights[is_compared]
    code = (at * MOST_BLOCKS + block)[is_compared]
    code = np.unique(code, return_inverse=True)[1].reshape(-1)
    n_blocks = int(code.max()) + 1
    # Each block counts as one.
    share = weights / np.bincount(code, weights)[code] / n_blocks
    score_mean = share @ away[:, 0]
    away[:, 0] -= score_mean
    deviations = np.sqrt(share @ away**2 * n_blocks / (n_blocks - 1))
    return Limits(
        **_expected(healthy),
        deviations=np.maximum(deviations[1:], _LEAST_DEVIATION),
        score_mean=float(score_mean),
        score_deviation=float(max(deviations[0], _LEAST_SCORE_DEVIATION)),
        n_blocks=n_blocks,
    )


def _expected(healthy):
    """Compute the first fields of `Limits`, which are not measured on left-out blocks."""
    rows, known_speeds, at, weights = healthy
    n_windows, n_features = rows.cepstra.shape[1:]
    references = group_means(rows.cepstra.mean(axis=1), at, weights)
    about = rows.cepstra - references[at][:, np.newaxis]
    # A covariance holds squares, so a weight counts by its root.
    about = about * np.sqrt(weights)[:, np.newaxis, np.newaxis]
    about = about.reshape(-1, n_features)
    n_free = max(len(about) - len(known_speeds), 1)
    scatter = about.T @ about / (n_free * weights.mean())
    # Few windows state the variances more precisely than the correlations.
    weight = n_features / (n_features + len(about))
    variances = np.diag(np.diag(scatter))
    scatter = (1 - weight) * scatter + weight * variances
    spectral_shape = group_means(rows.spectral_shape, at, weights)
    steadiness = group_means(rows.steadiness, at, weights)
    drift = drift_covariance(spectral_shape, steadiness)
    axes, variances = joint_axes(scatter / n_windows, drift)
    means = group_means(rows.values, at, weights)
    slopes = [
        slope_against_speed(value, known_speeds, **prior)
        for value, prior in zip(means.T, SLOPES, strict=False)
    ]
    return {
        "known_speeds": known_speeds,
        "axes": axes,
        "variances": variances,
        "references": along_axes(references, axes),
        "means": means,
        "slopes": np.array(slopes),
    }


def _cepstral_score(rows, axes, expected, variances):
    """Return the log mean square distance of rows from their expectation."""
    distance = along_axes(rows.cepstra.mean(axis=1), axes) - expected
    return np.log(np.mean(distance**2 / variances, axis=1) + 1e-3)


def log_p_values(
    limits: Limits,
    rows: Rows,
    log_speed: Array,
    scale: float,
    *,
    two_sided: bool = False,
) -> Array:
    r"""Compute log p-values: the probability that a healthy row deviates at least as much.

    .. math::

        s_1 = \log \mathrm{mean}\, (d - \hat d)^T [S_w / m + (\kappa v + 0.09) D]^{-1} (d - \hat d),
        \qquad
        s_2 = \frac{g - \hat g}{\sqrt{s^2 + (\kappa v + 0.09) \sigma^2 + \kappa V_b e^2}}

    with :math:`v = \sqrt b`, b the variance of the Brownian motion at the row's speed,
    the scale :math:`\kappa` of the drift, and e the log speed beyond the known ones.
    The root is taken since two recordings differ in load and mounting, however close
    their speeds are. The constant 0.09 covers the drift of one recording over time.
    Both scores are compared with Student's t distribution over blocks of time. The
    result is the smallest probability, times their number (Bonferroni). The test of the
    impulsiveness is one-sided. The test of the level is two-sided, since a sensor may
    come loose.

    Parameters
    ----------
    limits : Limits
        From healthy rows.
    rows : Rows
        Any rows.
    log_speed : ndarray of shape (n_rows,)
        Their log speeds.
    scale : float
        Scale of the drift.
    two_sided : bool, default=False
        Whether less than the expected impulsiveness counts as well: a row without
        impacts is no row of a fault.

    Returns
    -------
    ndarray of shape (n_rows,)
        Natural logarithms, finite, at most 0.
    """
    at = speed_distance(log_speed, limits.known_speeds)
    drift = scale * np.sqrt(at.variance) + SAME_RECORDING + SAME_SPEED
    more = 1 + 1 / limits.n_blocks
    # Blocks of one recording are not independent, however many speeds there are.
    freedom = min(limits.n_blocks, MOST_BLOCKS) - 1
    spread = limits.variances + drift[:, np.newaxis]
    references = at.interpolate(limits.references)
    score = _cepstral_score(rows, limits.axes, references, spread)
    score = (score - limits.score_mean) / (limits.score_deviation * np.sqrt(more))
    tails = [stdtr(freedom, -score)]
    for j, prior in enumerate(SLOPES[: rows.values.shape[1]]):
        slope, slope_variance = limits.slopes[j]
        expected = at.interpolate(limits.means[:, j]) + slope * at.beyond
        spread = limits.deviations[j] ** 2 * more + drift * prior["drift"] ** 2
        spread += scale * slope_variance * at.beyond**2
        score = (rows.values[:, j] - expected) / np.sqrt(spread)
        # The second value is the level.
        if two_sided or j == 1:
            tails.append(2 * stdtr(freedom, -abs(score)))
        else:
            tails.append(stdtr(freedom, -score))
    least = np.maximum(np.min(tails, axis=0), _TINY)
    return np.minimum(np.log(least) + np.log(len(tails)), 0.0)


def drift_scale(healthy: HealthyRows, limits: Limits) -> tuple[float, Array]:
    """Find the scale of the drift at which every left-out speed holds `HELD_RATES`.

    Parameters
    ----------
    healthy : HealthyRows
        Rows of at least two speeds.
    limits : Limits
        Limits from all rows.

    Returns
    -------
    scale : float
        Twice the smallest of the tried scales that holds the rates.
    log_p_values : ndarray of shape (n_rows,)
        Log p-value of each row at that scale, if the means, covariances and slopes are
        those of the other speeds.
    """
    rows, known_speeds, at, weights = healthy
    left_out = [at == speed for speed in range(len(known_speeds))]
    others = [
        limits._replace(**_expected(healthy.take(~is_out))) for is_out in left_out
    ]

    def left_out_log_p_values(scale):
        logs = np.empty(len(at))
        for limits, is_out in zip(others, left_out, strict=True):
            log_speed = known_speeds[at[is_out]]
            logs[is_out] = log_p_values(limits, rows.take(is_out), log_speed, scale)
        return logs

    def holds(scale):
        logs = left_out_log_p_values(scale)
        return all(
            (flagged_shares(logs, at, np.log(rate), weights) <= rate).all()
            for rate in HELD_RATES
        )

    smallest = next(filter(holds, SCALES), SCALES[-1])
    scale = SAFETY * float(smallest)
    return scale, left_out_log_p_values(scale)


def flagged_shares(
    log_p_values: Array, at: Array, limit: float, weights: Array
) -> Array:
    """Return the share of the rows of each speed whose log p-value is below a limit."""
    is_flagged = log_p_values < limit
    return np.bincount(at, weights * is_flagged) / np.bincount(at, weights)
