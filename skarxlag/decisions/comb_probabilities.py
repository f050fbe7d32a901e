"""Probabilities of fault locations, and limits of healthy rows, from scores of combs."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp
from scipy.stats import gumbel_r

from ..core.fault_locations import FAULT_LOCATIONS

#: Log odds of two fault locations for each neper between the scores of recordings that are
#: named, and the mean of these distances in nepers.
_CONFIDENCE_NAMED = 10.0
_MEAN_MARGIN = 1.6
#: Gumbel distribution of the best score of healthy rows, location and scale in nepers:
#: from 82 stretches of 1 s of three rigs, `python -m benchmarks.fault_orders --null`.
#: Scores of longer rows scatter less. The second location is that above the mean scores
#: of the same machine at other speeds.
HEALTHY_LOCATION = 0.86
OTHER_SPEED_LOCATION = 0.06
HEALTHY_SCALE = 0.31
#: Rows that `HEALTHY_SCALE` counts for when healthy rows of the machine are at hand.
_PRIOR_ROWS = 10
#: Settings of `comb_evidence`, chosen by leaving rigs out, by `python -m
#: benchmarks.fault_orders joint`: log odds for each neper, and probability that a fault
#: shows its comb.
ODDS = 8.0
VISIBLE = 0.1
#: Probability that a fault shows its comb, if combs decide alone, see `python -m
#: benchmarks.fault_orders --visible`: of 7 values, .4 or .6 has the least log loss on
#: recordings and stretches if one of six rigs is left out.
VISIBLE_ALONE = 0.6
#: Score of a row without a comb if no healthy row is known.
WITHOUT_COMB = 0.8
#: p-values are above 0.
LEAST_P = np.finfo(float).tiny


def least_margin(wrong_name_rate: float) -> float:
    r"""Compute the difference of two scores above which the better one may be named.

    Margins m of rows that are named have an exponential distribution with mean
    :math:`\bar m`. The name is wrong with the probability :math:`1 / (1 + e^{k m})`.
    The share of wrong names with a margin of at least :math:`m_0` is then at most
    :math:`\ln(1 + e^{-k m_0}) / (k \bar m)`, which is solved for :math:`m_0`.

    Parameters
    ----------
    wrong_name_rate : float
        Share of wrong names.

    Returns
    -------
    float
        In nepers, at least 0.

    Examples
    --------
    >>> [round(least_margin(rate), 2) for rate in (0.02, 0.002)]
    [0.1, 0.34]
    """
    share = np.expm1(wrong_name_rate * _CONFIDENCE_NAMED * _MEAN_MARGIN)
    return max(float(-np.log(share) / _CONFIDENCE_NAMED), 0.0)


def comb_evidence(
    scores: NDArray[Any],
    class_locations: NDArray[Any],
    odds: float = ODDS,
    visible: float = VISIBLE,
) -> NDArray[Any]:
    r"""Compute the log probability of the fault location of each class from scores of combs.

    A fault shows its comb with the probability v. The odds of a fault at location p,
    relative to a row without a comb, are

    .. math:: 1 - v + v\, e^{k s_p}

    with the score :math:`s_p`. The odds of a healthy row are 1. A missing comb is thus
    weak evidence against a fault.

    Parameters
    ----------
    scores : ndarray of shape (n_rows, 3)
        Scores of ball, inner and outer race, in nepers above those of rows without a
        comb.
    class_locations : ndarray of int of shape (n_classes,)
        Fault location of each class: 0 ball, 1 inner race, 2 outer race, 3 healthy.
    odds : float, default=8.0
        The log odds k of a neper.
    visible : float, default=0.1
        The probability v.

    Returns
    -------
    ndarray of shape (n_rows, n_classes)
        The same for all classes of a fault location.

    Examples
    --------
    >>> scores = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 2.0]])
    >>> np.exp(comb_evidence(scores, np.array([1, 2, 2, 3]))).round(3)
    array([[0.333, 0.333, 0.333, 0.333],
           [0.   , 1.   , 1.   , 0.   ]])
    """
    log_odds = np.zeros((len(scores), len(FAULT_LOCATIONS)))
    log_odds[:, :-1] = np.logaddexp(np.log(visible) + odds * scores, np.log1p(-visible))
    present = np.unique(class_locations)
    total = logsumexp(log_odds[:, present], axis=1, keepdims=True)
    return (log_odds - total)[:, class_locations]


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
