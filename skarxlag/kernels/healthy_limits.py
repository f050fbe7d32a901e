"""Limits on the log spectra of healthy rows at any speed, from rows at some speeds."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr

from .arrays import Array
from .drift import ROUGH, SMOOTH, smooth_variance
from .scaling import centred, root_mean_square
from .short_time import LENGTH
from .spectra import SPECTRUM_ORDER, cepstrum, own_spectra
from .speed_references import group_means, speed_distance

#: Fewest and most blocks of time that the rows of one speed are divided into. Between
#: these, a block has this many rows.
FEWEST_BLOCKS = 5
MOST_BLOCKS = 10
MANY_ROWS = 30
#: Scales of the drift that are tried, each sqrt(2) times the one before.
SCALES = 2.0 ** np.arange(-3, 6.25, 0.5)
#: The scale that holds at left-out speeds is multiplied by this: k speeds support only
#: the rate 1 / (k + 1).
SAFETY = 2.0**0.5
#: Rate that every left-out speed must hold, whatever rate is stated later.
HELD_RATE = 0.05
#: Drift of a recording over time, as a share of the drift over the unit distance.
SAME_SPEED = 0.03
#: Standard deviations of the drift of the mean steadiness and of the log level over the
#: unit distance, in nepers.
MEAN_DRIFT = (0.1, 0.3)
#: Least deviations: of the score, and of mean steadiness and level, in nepers.
_LEAST_SCORE_DEVIATION = 0.05
_LEAST_DEVIATION = 0.005
_TINY = np.finfo(np.float64).tiny


class Rows(NamedTuple):
    """Features of rows, where each row is a stretch of n_windows windows.

    Attributes
    ----------
    cepstra : ndarray of shape (n_rows, n_windows, n_cepstra)
        Cosine coefficients of the spectral shape of each window.
    means : ndarray of shape (n_rows, n_windows, n_means)
        Mean steadiness over the bands of each window, and its log root mean square if
        the level is used.
    """

    cepstra: np.ndarray
    means: np.ndarray

    def take(self, is_taken: NDArray[np.bool_]) -> "Rows":
        """Return some of the rows."""
        return Rows(*(feature[is_taken] for feature in self))

    def cut(self, n_parts: int) -> "Rows":
        """Return parts of the rows, each of as many windows as the others."""
        n_rows, n_windows = self.cepstra.shape[:2]
        length = n_windows // n_parts
        shape = n_rows * n_parts, length
        return Rows(
            *(
                feature[:, : n_parts * length].reshape(*shape, feature.shape[2])
                for feature in self
            )
        )


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
        Weight of each row in means and variances, above 0; only ratios count. A block
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


class Expected(NamedTuple):
    """Expected features of healthy rows at known speeds, and their scatter.

    Attributes
    ----------
    known_speeds : ndarray of shape (n_speeds,)
        Log speeds, ascending.
    references : ndarray of shape (n_speeds, n_cepstra)
        Mean cepstra.
    variances : ndarray of shape (n_cepstra,)
        Variances of the cepstra of single windows about these means.
    means : ndarray of shape (n_speeds, n_means)
        Mean steadiness, and mean log level if it is used.
    """

    known_speeds: np.ndarray
    references: np.ndarray
    variances: np.ndarray
    means: np.ndarray


class Limits(NamedTuple):
    """Expected features of healthy rows, and the distribution of their scores.

    Attributes
    ----------
    expected : Expected
        From all healthy rows.
    deviations : ndarray of shape (n_means,)
        Standard deviation of the means between blocks of time that are left out.
    score_mean, score_deviation : float
        Mean and standard deviation of the score between the same blocks.
    n_blocks : int
        Number of these blocks.
    """

    expected: Expected
    deviations: np.ndarray
    score_mean: float
    score_deviation: float
    n_blocks: int


def measure_windows(windows: Array, *, with_level: bool) -> tuple[Array, Array]:
    """Compute the features of windows.

    Parameters
    ----------
    windows : ndarray of shape (n_windows, n_samples)
        Windows in any unit, with any mean.
    with_level : bool
        Whether the level is used.

    Returns
    -------
    cepstra : ndarray of shape (n_windows, n_cepstra)
        Cosine coefficients of the spectral shape, in nepers of power.
    means : ndarray of shape (n_windows, n_means)
        Mean steadiness, and log root mean square if the level is used; finite.
    """
    unit, peak = centred(windows)
    spectra = own_spectra(unit, SPECTRUM_ORDER)
    means = spectra[:, 1].mean(axis=1, keepdims=True)
    if with_level:
        rms = np.maximum(root_mean_square(unit), _TINY)
        means = np.column_stack([means, np.log(rms) + np.log(peak[:, 0])])
    return cepstrum(spectra[:, 0]), means


def number_of_cepstra(window_length: int) -> int:
    """Return the number of cepstra of windows of a given length.

    Examples
    --------
    >>> number_of_cepstra(4800)
    125
    """
    return 2 * max(min(LENGTH, window_length) // 2 - 1, 1) - 1


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
    turn, one block of each speed is excluded from the means and variances, and then
    compared with them.
    """
    rows, known_speeds, at, weights = healthy
    block = time_blocks(at)
    # Score, and distances of the means, from what the other blocks predict.
    away = np.full((len(at), 1 + rows.means.shape[2]), np.nan)
    for number in range(block.max() + 1):
        # A speed all of whose rows are left out has nothing to be compared with.
        is_other = (block != number) & np.isin(at, at[block == number])
        is_left_out = (block == number) & np.isin(at, at[is_other])
        if is_left_out.any():
            left_out = rows.take(is_left_out)
            log_speed = known_speeds[at[is_left_out]]
            expected = _expected(healthy.take(is_other))
            away[is_left_out] = _away(expected, left_out, log_speed, SAME_SPEED)
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
        expected=_expected(healthy),
        deviations=np.maximum(deviations[1:], _LEAST_DEVIATION),
        score_mean=float(score_mean),
        score_deviation=float(max(deviations[0], _LEAST_SCORE_DEVIATION)),
        n_blocks=n_blocks,
    )


def _expected(healthy):
    """Return means and variances of healthy rows."""
    rows, known_speeds, at, weights = healthy
    references = group_means(rows.cepstra.mean(axis=1), at, weights)
    squares = (rows.cepstra - references[at][:, np.newaxis]) ** 2
    n_windows = squares.shape[1]
    n_free = max(len(at) * n_windows - len(known_speeds), 1)
    sums = weights @ squares.sum(axis=1)
    return Expected(
        known_speeds=known_speeds,
        references=references,
        variances=sums / (n_free * weights.mean()),
        means=group_means(rows.means.mean(axis=1), at, weights),
    )


def _away(expected, rows, log_speed, drift):
    """Return the score of rows, and the distances of their means, in columns."""
    at = speed_distance(log_speed, expected.known_speeds)
    n_windows = rows.cepstra.shape[1]
    of_drift = smooth_variance(rows.cepstra.shape[2], SMOOTH, ROUGH)
    variances = expected.variances / n_windows + np.multiply.outer(drift, of_drift)
    distance = rows.cepstra.mean(axis=1) - at.interpolate(expected.references)
    score = np.log(np.mean(distance**2 / variances, axis=1) + 1e-3)
    means = rows.means.mean(axis=1) - at.interpolate(expected.means)
    return np.column_stack([score, means])


def log_p_values(
    limits: Limits, rows: Rows, log_speed: Array, scale: float
) -> NDArray[np.float64]:
    r"""Compute log p-values: the probability that a healthy row deviates at least as much.

    .. math::

        s_1 = \log\,\frac1N \sum_{n=1}^{N} \frac{(d_n - \hat d_n)^2}
        {s_n^2 / m + (\kappa v + 0.03)\, D_n}, \qquad
        s_2 = \frac{g - \hat g}{\sqrt{s_g^2 + (\kappa v + 0.03)\, \sigma^2}}

    with :math:`v = \sqrt b`, b the variance of the Brownian motion at the row's speed,
    and the scale :math:`\kappa` of the drift. The root is taken since two recordings
    differ in load and mounting, however close their speeds are. The constant 0.03
    covers the drift of one recording over time. All scores are compared with Student's
    t distribution over blocks of time; those of g, the mean steadiness or the level,
    on both sides. The result is the smallest probability, times their number (Bonferroni).

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

    Returns
    -------
    ndarray of shape (n_rows,)
        Natural logarithms, finite, at most 0.
    """
    variance = speed_distance(log_speed, limits.expected.known_speeds).variance
    drift = scale * np.sqrt(variance) + SAME_SPEED
    away = _away(limits.expected, rows, log_speed, drift)
    more = 1 + 1 / limits.n_blocks
    freedom = limits.n_blocks - 1
    score = (away[:, 0] - limits.score_mean) / limits.score_deviation
    tails = [stdtr(freedom, -score / np.sqrt(more))]
    measures = zip(away[:, 1:].T, limits.deviations, MEAN_DRIFT, strict=False)
    for change, deviation, moved in measures:
        spread = np.sqrt(deviation**2 * more + drift * moved**2)
        tails.append(2 * stdtr(freedom, -abs(change) / spread))
    least = np.maximum(np.min(tails, axis=0), _TINY)
    return np.minimum(np.log(least) + np.log(len(tails)), 0.0)


def drift_scale(healthy: HealthyRows, limits: Limits) -> tuple[float, Array]:
    """Find the scale of the drift at which every left-out speed holds `HELD_RATE`.

    Parameters
    ----------
    healthy : HealthyRows
        Rows of at least two speeds.
    limits : Limits
        Limits from all rows.

    Returns
    -------
    scale : float
        `SAFETY` times the smallest of the tried scales that holds the rate, or the
        largest if none does.
    log_p_values : ndarray of shape (n_rows,)
        Log p-value of each row at that scale, if the means and variances are those of
        the other speeds.
    """
    rows, known_speeds, at, weights = healthy
    left_out = [at == speed for speed in range(len(known_speeds))]
    others = [
        limits._replace(expected=_expected(healthy.take(~is_out)))
        for is_out in left_out
    ]

    def left_out_log_p_values(scale):
        logs = np.empty(len(at))
        for other, is_out in zip(others, left_out, strict=True):
            log_speed = known_speeds[at[is_out]]
            logs[is_out] = log_p_values(other, rows.take(is_out), log_speed, scale)
        return logs

    def holds(scale):
        logs = left_out_log_p_values(scale)
        rates = flagged_shares(logs, at, np.log(HELD_RATE), weights)
        return np.all(rates <= HELD_RATE)

    scale = SAFETY * float(next(filter(holds, SCALES), SCALES[-1]))
    return scale, left_out_log_p_values(scale)


def flagged_shares(
    log_p_values: Array, at: Array, limit: float, weights: Array
) -> Array:
    """Return the share of the rows of each speed whose log p-value is below a limit."""
    is_flagged = log_p_values < limit
    return np.bincount(at, weights * is_flagged) / np.bincount(at, weights)
