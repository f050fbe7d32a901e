"""Limits that healthy rows set for the scores of combs, and scores compared with them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import gumbel_r
from sklearn.utils import Bunch

from ..core.fault_locations import FAULTS
from ..kernels.evidence import COMB_CORRELATION, effective_number

#: Logarithm of speed up to which rows count as rows of the same speed.
_SAME_SPEED = 0.05
#: Log odds of a fault for each neper of its score, chosen by leaving rigs out.
ODDS = 8.0
#: Lead of the best score over the second from which on it is named: of the two, the
#: second is then right with a probability of at most .1.
_LEAST_LEAD = np.log(0.9 / 0.1) / ODDS
#: Gumbel distribution of the best score of healthy rows of 100 revolutions, location and
#: scale in nepers. The limit at a rate of .02, 2.74, is that which six of seven rigs
#: choose without the seventh: 2.7 or 2.8. The second location is that above the mean scores
#: of the same machine at other speeds.
HEALTHY_LOCATION = 1.65
OTHER_SPEED_LOCATION = 0.06
HEALTHY_SCALE = 0.28
#: Rows that `HEALTHY_SCALE` counts for when healthy rows of the machine are at hand.
_PRIOR_ROWS = 10
#: Score that noise does not exceed, of any length and at any speed, with a probability
#: of .98. A score of 0, of impacts at a fraction of an order, is none of noise.
OF_NOISE = 1.0
#: Revolutions of rows that `HEALTHY_LOCATION` holds for, and revolutions below which it
#: falls no further.
_STATED_REVOLUTIONS = 100
_LEAST_REVOLUTIONS = 10
#: Nepers by which a comb at no order of the bearing may be above those of its faults,
#: and the largest score above the limit that counts if it is further above. With another
#: bearing than the stated one, or another speed, it is.
_STRONGER = 0.5
_MOST_BESIDE_OTHERS = 0.25
#: p-values are above 0.
LEAST_P = np.finfo(float).tiny


class HealthyCombs(NamedTuple):
    """Scores of combs in healthy rows.

    Parameters
    ----------
    reference : ndarray of shape (3,)
        Mean scores at ball, inner and outer race; 0 without rows.
    best : ndarray of shape (n_rows,)
        Largest scores above the reference, at least 0, ascending.
    speeds : ndarray of shape (n_rows,)
        Speeds of the rows, ascending.
    limit : float
        Limit of the largest score above the reference at these speeds, in nepers.
    """

    reference: NDArray[Any]
    best: NDArray[Any]
    speeds: NDArray[Any]
    limit: float


class ComparedCombs(NamedTuple):
    """Scores of combs, compared with those of healthy rows.

    Parameters
    ----------
    beyond_limit : ndarray of shape (n_rows, 3)
        Scores of ball, inner and outer race above the limit, at most .25 if impacts at
        no order of the bearing are more than .5 nepers stronger.
    ranking : ndarray of int of shape (n_rows, 2)
        Faults of the largest and of the second largest score above the reference.
    alarm : ndarray of bool of shape (n_rows,)
        Whether the largest is above the limit.
    is_close : ndarray of bool of shape (n_rows,)
        Whether there is an alarm, but the second largest is too close to name the
        largest.
    p_value : ndarray of shape (n_rows,)
        As `p_values_of_healthy` returns them.
    score_limits : ndarray of shape (n_rows,)
        Limits of the scores of the strongest faults themselves.
    """

    beyond_limit: NDArray[Any]
    ranking: NDArray[np.intp]
    alarm: NDArray[np.bool_]
    is_close: NDArray[np.bool_]
    p_value: NDArray[Any]
    score_limits: NDArray[Any]


def healthy_combs(
    scores: NDArray[Any], speeds: NDArray[Any], rate: float
) -> HealthyCombs:
    """Learn reference and limit from healthy rows.

    Parameters
    ----------
    scores : ndarray of shape (n_rows, 3)
        Scores of ball, inner and outer race.
    speeds : ndarray of shape (n_rows,)
        Speeds of the rows; NaN if a speed is not known.
    rate : float
        Share of healthy rows above the limit.

    Returns
    -------
    HealthyCombs
        Reference, scores, speeds and limit.
    """
    n_rows = len(scores)
    if n_rows == 0:
        return without_healthy(rate)
    reference = scores.mean(axis=0)
    # A row is nearer to a mean that it is a part of. Rows without any comb are equal.
    best = np.maximum((scores - reference).max(axis=1), 0.0)
    best = np.sort(best * n_rows / max(n_rows - 1, 1))
    speeds = np.sort(np.where(np.isnan(speeds), 1.0, speeds))
    return HealthyCombs(reference, best, speeds, limit_of_healthy(best, rate))


def without_healthy(rate: float) -> HealthyCombs:
    """Return the limit of other machines, which holds if no healthy row is known."""
    limit = limit_of_healthy(np.empty(0), rate)
    return HealthyCombs(np.zeros(len(FAULTS)), np.empty(0), np.empty(0), limit)


def length_allowance(n_revolutions: NDArray[Any]) -> NDArray[Any]:
    r"""Compute how much higher combs of healthy machines are than in 100 revolutions.

    .. math:: \tfrac{1}{2} \ln (\max(n, 10) / 100)

    Faint lines that every machine has stand the higher above noise, the longer the
    signal is.

    Parameters
    ----------
    n_revolutions : ndarray of shape (n_rows,)
        Revolutions n in each row. NaN, if the speed is not known, counts as 100.

    Returns
    -------
    ndarray of shape (n_rows,)
        In nepers.

    Examples
    --------
    >>> length_allowance(np.array([100.0, 10.0, 2.0])).round(3)
    array([ 0.   , -1.151, -1.151])
    """
    counted = np.maximum(n_revolutions, _LEAST_REVOLUTIONS)
    return np.nan_to_num(np.log(counted / _STATED_REVOLUTIONS) / 2)


def gain_of_rows(n_rows: float | NDArray[Any]) -> NDArray[Any]:
    """Return how much less the mean score of several rows of a machine scatters."""
    return np.sqrt(effective_number(n_rows, COMB_CORRELATION))


def compare_combs(
    matches: Bunch,
    healthy: HealthyCombs,
    n_rows: float | NDArray[Any],
    false_alarm_rate: float,
) -> ComparedCombs:
    """Compare scores of combs with those of healthy rows.

    Parameters
    ----------
    matches : Bunch
        As `CombSearch.match` returns it, or its means over several rows. Revolutions
        count if no healthy row of the machine is known, see `length_allowance`.
    healthy : HealthyCombs
        What healthy rows show.
    n_rows : float or ndarray of shape (n_rows,)
        Rows of which the scores are means, see `gain_of_rows`. They count at the speeds
        of healthy rows only, at which the reference is known.
    false_alarm_rate : float
        As in `FaultOrderClassifier`.

    Returns
    -------
    ComparedCombs
        The comparison.
    """
    distances = np.abs(np.log(matches.rpm[:, np.newaxis] / healthy.speeds))
    # The distance of an unknown speed is NaN.
    is_far = ~(distances.min(axis=1, initial=np.inf) <= _SAME_SPEED)
    elsewhere = limit_elsewhere(healthy.limit, false_alarm_rate)
    allowance = np.zeros(len(is_far))
    if len(healthy.best) == 0:
        allowance = length_allowance(matches.n_revolutions)
    limits = np.where(is_far, elsewhere, healthy.limit) + allowance
    certainty = np.where(is_far, 1.0, gain_of_rows(n_rows))
    excess = (matches.scores - healthy.reference) * certainty[:, np.newaxis]
    ranking = excess.argsort(axis=1, kind="stable")[:, :-3:-1]
    best, second = np.take_along_axis(excess, ranking, axis=1).T
    alarm = best > limits
    beyond = excess - limits[:, np.newaxis]
    is_doubted = matches.other_scores > matches.scores.max(axis=1) + _STRONGER
    surplus = np.maximum(beyond.max(axis=1) - _MOST_BESIDE_OTHERS, 0)
    beyond -= np.where(is_doubted, surplus, 0)[:, np.newaxis]
    return ComparedCombs(
        beyond,
        ranking,
        alarm,
        is_close=alarm & (best - second < _LEAST_LEAD),
        p_value=p_values_of_healthy(best - allowance, healthy.best, is_far),
        score_limits=healthy.reference[ranking[:, 0]] + limits / certainty,
    )


def limit_of_healthy(healthy: NDArray[Any], rate: float) -> float:
    """Return the score whose p-value is the rate, see `p_values_of_healthy`.

    Parameters
    ----------
    healthy : ndarray of shape (n_rows,)
        Best scores of healthy rows, ascending. Empty: those of other machines.
    rate : float
        Share of healthy rows above the limit.

    Returns
    -------
    float
        In nepers.
    """
    n_rows = len(healthy)
    if n_rows == 0:
        return float(gumbel_r.isf(rate, HEALTHY_LOCATION, HEALTHY_SCALE))
    n_above = int(rate * (n_rows + 1) + 1e-9)
    if n_above >= 1:
        return float(healthy[-min(n_above, n_rows)])
    return float(healthy[-1] - _tail_scale(healthy) * np.log(rate * (n_rows + 1)))


def limit_elsewhere(limit: float, rate: float) -> float:
    """Return the score that healthy rows exceed at a rate at speeds without healthy rows."""
    return max(limit, float(gumbel_r.isf(rate, OTHER_SPEED_LOCATION, HEALTHY_SCALE)))


def p_values_of_healthy(
    best: NDArray[Any], healthy: NDArray[Any], is_far: NDArray[np.bool_]
) -> NDArray[Any]:
    """Compute the share of healthy rows with a larger best score.

    Above the best scores of all healthy rows, the share follows an exponential tail.

    Parameters
    ----------
    best : ndarray of shape (n,)
        Best scores.
    healthy : ndarray of shape (n_rows,)
        Best scores of healthy rows, ascending. Empty: those of other machines.
    is_far : ndarray of bool of shape (n,)
        Whether no healthy row had such a speed.

    Returns
    -------
    ndarray of shape (n,)
        In (0, 1].
    """
    n_rows = len(healthy)
    if n_rows == 0:
        return np.maximum(gumbel_r.sf(best, HEALTHY_LOCATION, HEALTHY_SCALE), LEAST_P)
    n_above = n_rows - np.searchsorted(healthy, best)
    beyond = np.maximum(best - healthy[-1], 0) / _tail_scale(healthy)
    here = np.exp(-beyond) * (1 + n_above) / (1 + n_rows)
    elsewhere = np.where(
        is_far, gumbel_r.sf(best, OTHER_SPEED_LOCATION, HEALTHY_SCALE), 0.0
    )
    return np.maximum(np.maximum(here, elsewhere), LEAST_P)


def _tail_scale(healthy):
    """Return the root mean square of the Gumbel scales of these and of other machines."""
    variances = [6 * np.var(healthy) / np.pi**2, HEALTHY_SCALE**2]
    n_rows = [len(healthy), _PRIOR_ROWS]
    return float(np.sqrt(np.average(variances, weights=n_rows)))
