"""Probabilities and verdicts that scores of combs give, alone or together with spectra."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_softmax, logsumexp
from sklearn.utils import Bunch

from ..core.fault_locations import (
    FAULT_LOCATIONS,
    FAULTS,
    HEALTHY,
    NO_FINDING,
    NOT_IDENTIFIABLE,
    OWN_LOCATION,
)
from .comb_limits import ODDS, OF_NOISE, ComparedCombs, HealthyCombs

#: Probability that a fault shows its comb, beside spectra, chosen by leaving rigs out.
VISIBLE = 0.1
#: Probability that a fault shows its comb, if combs decide alone: of 7 values, .4 or .6
#: has the least log loss on recordings and stretches if one of six rigs is left out.
VISIBLE_ALONE = 0.6
_HEALTHY = FAULT_LOCATIONS.index(HEALTHY)


def comb_evidence(
    scores: NDArray[Any],
    class_locations: NDArray[Any],
    visible: float = VISIBLE,
) -> NDArray[Any]:
    r"""Compute the log probability of the fault location of each class from scores of combs.

    A fault shows its comb with the probability v. The odds of a fault at location p,
    relative to a row without a comb, are

    .. math:: 1 - v + v\, e^{k s_p}

    with the score :math:`s_p` and k = 8. The odds of a healthy row, and of a
    class with a location of its own, are 1. A missing comb is thus
    weak evidence against a fault.

    Parameters
    ----------
    scores : ndarray of shape (n_rows, 3)
        Scores of ball, inner and outer race, in nepers above those of rows without a
        comb.
    class_locations : ndarray of int of shape (n_classes,)
        Fault location of each class: 0 ball, 1 inner race, 2 outer race, 3 healthy, 4
        of its own.
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
    log_odds = np.zeros((len(scores), OWN_LOCATION + 1))
    log_odds[:, : len(FAULTS)] = np.logaddexp(
        np.log(visible) + ODDS * scores, np.log1p(-visible)
    )
    present = np.unique(class_locations)
    total = logsumexp(log_odds[:, present], axis=1, keepdims=True)
    return (log_odds - total)[:, class_locations]


def verdicts_by_combs(
    matches: Bunch,
    healthy: HealthyCombs,
    compared: ComparedCombs,
    classes: NDArray[Any],
    class_locations: NDArray[Any],
) -> Bunch:
    """Return the verdicts of combs alone.

    Parameters
    ----------
    matches : Bunch
        As `CombSearch.match` returns it. Rows whose combs are not used get equal
        probabilities.
    healthy : HealthyCombs
        What healthy rows of the machine show.
    compared : ComparedCombs
        Scores of combs, compared with those of healthy rows.
    classes : ndarray of shape (n_classes,)
        Labels.
    class_locations : ndarray of int of shape (n_classes,)
        As in `comb_evidence`.

    Returns
    -------
    Bunch
        "alarm", "verdict", "named", "score" and "probability", as
        `FaultOrderClassifier.diagnose` returns them.
    """
    scores = comb_evidence(
        compared.beyond_limit, class_locations, visible=VISIBLE_ALONE
    )
    scores[np.isnan(matches.rpm)] = 0.0
    best = scores.argmax(axis=1)
    verdict = classes[best]
    named = np.where(compared.is_close, NOT_IDENTIFIABLE, verdict.astype(object))
    if len(healthy.best) == 0:
        is_learned = class_locations[best] == OWN_LOCATION
        named[~compared.alarm & ~is_learned] = NO_FINDING
    is_pair = len(classes) == 2
    return Bunch(
        alarm=compared.alarm,
        verdict=verdict,
        named=named,
        score=scores[:, 1] - scores[:, 0] if is_pair else scores,
        probability=np.exp(log_softmax(scores, axis=1)),
    )


def evidence_beside_spectra(
    matches: Bunch,
    reference: NDArray[Any],
    class_locations: NDArray[Any],
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Compute the log probabilities that combs add to those by spectra.

    Scores count as far as they are above those of healthy rows and of noise.

    Parameters
    ----------
    matches : Bunch
        As `CombSearch.match` returns it.
    reference : ndarray of shape (3,)
        Mean scores of healthy rows.
    class_locations : ndarray of int of shape (n_classes,)
        As in `comb_evidence`.

    Returns
    -------
    log_probability : ndarray of shape (n_rows, n_classes + 1)
        That of the location of each class and, in the last column, of an unknown
        condition; 0 for rows whose combs are not used.
    of_fault : ndarray of shape (n_rows,)
        Probability of the most probable fault; NaN for rows whose combs are not used.
    """
    scores = matches.scores - np.maximum(reference, OF_NOISE)
    has_combs = ~np.isnan(matches.rpm)
    # An unknown condition need not show a comb.
    locations = np.append(class_locations, _HEALTHY)
    logs = comb_evidence(scores, locations)
    is_fault = locations < len(FAULTS)
    of_fault = np.exp(logs).max(axis=1, where=is_fault, initial=0.0)
    logs[~has_combs] = 0.0
    return logs, np.where(has_combs, of_fault, np.nan)
