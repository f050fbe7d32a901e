"""Probabilities of fault locations and conditions from residuals, for any specimen.

Residuals separate the conditions best for the specimens that were recorded. Another
specimen of the same fault resembles the recorded one less, and it resembles other
faults nearly as much. So each answer is certain as far as its row is one of a recorded
specimen, and for the rest it follows from residuals with a small exponent. The constants
were chosen by leaving rigs out, as the page on another bearing describes.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from .arrays import Array

#: Log odds of a recorded specimen for each neper by which the gap of the residuals
#: exceeds that of noise. The gap is the logarithm of the second smallest residual over
#: the smallest.
GAP_ODDS = 6.0
#: Log odds at the gap of noise, and the largest ones: a gap is never proof.
ODDS_OF_NOISE = -2.5
LARGEST_ODDS = 8.0
#: Log odds against a recorded specimen for each neper of the smallest residual above 1.
FAR_ODDS = 4.0
#: Exponents of the residuals: of the answers for another specimen, and of the
#: conditions of one location, which differ by specimen.
ANOTHER_EXPONENT = 8.0
CONDITION_EXPONENT = 32.0
#: Probability of an unknown condition in rows that are of no recorded specimen.
UNKNOWN_SHARE = 0.1
#: Log residual of an answer that is not there, above those of all numbers.
NO_ANSWER = 1e4
#: Share of the gap of noise that the rows of a recording have in common: they are of
#: one specimen.
COMMON_GAP = 0.3


class Posterior(NamedTuple):
    """Log probabilities of conditions, and whether rows are of recorded specimens.

    Parameters
    ----------
    log_probability : ndarray of shape (n_rows, n_conditions + 1)
        Natural logarithms of the probabilities of the conditions, and in the last
        column of an unknown condition.
    recorded : ndarray of shape (n_rows,)
        Probability that the row is of a specimen that was recorded.
    gaps : ndarray of shape (n_rows, 2)
        Second smallest log residual less the smallest, in the question whether there is
        a fault, and at which location; 0 if there is one answer.
    """

    log_probability: NDArray[np.float64]
    recorded: NDArray[np.float64]
    gaps: NDArray[np.float64]


def logarithms(residuals: Array) -> NDArray[np.float64]:
    """Compute the natural logarithms of residuals, also of 0.

    Parameters
    ----------
    residuals : ndarray
        At least 0.

    Returns
    -------
    ndarray of the same shape
        That of 0 is that of the smallest normal number.
    """
    residuals = residuals.astype(np.float64)
    return np.log(np.maximum(residuals, np.finfo(float).tiny))


def noise_gaps(residuals: Array, locations: Array, healthy: int) -> Array:
    """Compute the largest gaps of rows of noise in both questions.

    Parameters
    ----------
    residuals, locations, healthy
        As in `condition_log_probabilities`.

    Returns
    -------
    ndarray of shape (2,)
        Of the question whether there is a fault, and at which location; 0 if there is one
        answer.

    Examples
    --------
    >>> noise_gaps(np.array([[0.0, -0.7, 0.1], [0.1, 0.0, 0.0]]), np.array([0, 1, 2]), 0)
    array([0.7, 0.8])
    """
    none = np.zeros(2)
    found = condition_log_probabilities(residuals, locations, healthy, none)
    return found.gaps.max(axis=0)


def condition_log_probabilities(
    residuals: Array,
    locations: Array,
    healthy: int,
    gaps_of_noise: Array,
    prior: float = 0.5,
    n_rows: float | NDArray[np.float64] = 1.0,
) -> Posterior:
    r"""Compute the log probability of each condition, and that of an unknown one.

    Three questions are asked in turn: whether there is a fault, at which location, and
    which of the conditions of the location it is. The residual of a location is the
    smallest residual of its conditions, and that of a fault the smallest of its
    locations. With the smallest residual :math:`r_1` of a question, the second one
    :math:`r_2`, the gap :math:`g = \ln (r_2 / r_1)`, the gap :math:`g_0` that noise
    reaches, and the prior :math:`\pi`, the log odds that the row is of a recorded
    specimen are

    .. math::

        z = \min\Bigl(8,\; \ln\frac{\pi}{1 - \pi} - 2.5 + 6\,(g - g_0)
        - 4 \max(\ln r_1, 0)\Bigr).

    With :math:`q = 1 / (1 + e^{-z})`, answer a of the first two questions has the
    probability

    .. math:: p_a = q\,[a \text{ is nearest}] + (1 - q)\,\frac{r_a^{-8}}{\sum_b r_b^{-8}}.

    If there is a single answer, q is 0. The conditions of a location differ by specimen,
    so their probabilities are proportional to :math:`r^{-32}`. An unknown condition has
    the odds :math:`(1 - q) \cdot 0.1 / 0.9` against all known ones, with the larger q of
    the two questions.

    The rows of a recording are of one specimen. So the questions are asked once, about
    the mean of the logarithms over its n rows. The noise of the rows is independent in
    part, and the gap of noise is multiplied by :math:`\sqrt{0.3 + 0.7 / n}`.

    Parameters
    ----------
    residuals : ndarray of shape (n_rows, n_conditions)
        Natural logarithms of the residuals, or means of them.
    locations : ndarray of int64 of shape (n_conditions,)
        Number of the location of each condition; all numbers from 0 to the largest occur.
    healthy : int
        Number of the location of healthy conditions; -1 if there is none.
    gaps_of_noise : array-like of shape (2,)
        Largest gaps of noise, see `noise_gaps`.
    prior : float, default=0.5
        Probability that a row is of a recorded specimen, in (0, 1).
    n_rows : float or ndarray of shape (n_rows,), default=1.0
        Number n of rows that each mean is of. Less than 1 counts as 1.

    Returns
    -------
    Posterior
        Log probabilities, the probability of a recorded specimen, and the gaps.

    Examples
    --------
    A healthy condition, two of the inner race and one of the outer race:

    >>> residuals = np.log([[1.0, 0.5, 0.6, 0.9]])
    >>> found = condition_log_probabilities(residuals, np.array([0, 1, 1, 2]), 0, (0.4, 0.2))
    >>> np.exp(found.log_probability).round(2), found.recorded.round(2)
    (array([[0.  , 0.93, 0.  , 0.  , 0.06]]), array([0.46]))
    """
    # A question has two columns at least, so that each row has a second answer.
    is_at = locations == np.arange(max(locations.max() + 1, 2))[:, np.newaxis]
    nearest = np.where(is_at, residuals[:, np.newaxis], NO_ANSWER).min(axis=2)
    answers = np.full((2, *nearest.shape), NO_ANSWER)
    states, faults = answers
    faults[:] = nearest
    if healthy >= 0:
        states[:, 0] = nearest[:, healthy]
        faults[:, healthy] = NO_ANSWER
    states[:, 1] = faults.min(axis=1)

    smallest, second = np.sort(answers, axis=2)[..., :2].transpose(2, 0, 1)
    left = np.sqrt(COMMON_GAP + (1 - COMMON_GAP) / np.maximum(n_rows, 1.0))
    is_single = second == NO_ANSWER
    gap = np.where(is_single, 0.0, second - smallest)
    z = math.log(prior / (1 - prior)) + ODDS_OF_NOISE - FAR_ODDS * smallest.clip(0.0)
    z += GAP_ODDS * (gap - np.outer(gaps_of_noise, left))
    q = expit(np.where(is_single, -np.inf, np.minimum(z, LARGEST_ODDS)))

    below = smallest[..., np.newaxis] - answers
    is_nearest = below == 0
    shares = np.exp(ANOTHER_EXPONENT * below)
    of_others = (1 - q) / shares.sum(axis=2)
    of_nearest = np.log(q / is_nearest.sum(axis=2) + of_others)
    logs = np.log(of_others)[..., np.newaxis] + ANOTHER_EXPONENT * below
    states, faults = np.where(is_nearest, of_nearest[..., np.newaxis], logs)
    of_locations = states[:, 1:2] + faults
    if healthy >= 0:
        of_locations[:, healthy] = states[:, 0]

    recorded = q.max(axis=0)
    unknown = (1 - recorded) * UNKNOWN_SHARE / (1 - UNKNOWN_SHARE)
    below = CONDITION_EXPONENT * (nearest[:, locations] - residuals)
    shares = np.where(is_at, np.exp(below)[:, np.newaxis], 0.0).sum(axis=2)
    logs = np.empty((len(residuals), len(locations) + 1))
    logs[:, :-1] = of_locations[:, locations] + below - np.log(shares[:, locations])
    logs[:, -1] = np.log(unknown)
    logs -= np.log1p(unknown)[:, np.newaxis]
    return Posterior(logs, recorded, gap.T)


def decided_condition(
    probability: Array, locations: Array, healthy: int
) -> NDArray[np.intp]:
    """Return the condition that each row is decided for: healthy or not, location, condition.

    The most probable single condition need not be that one: a fault that is more
    probable than a healthy condition may be divided among several locations.

    Parameters
    ----------
    probability : ndarray of shape (n_rows, n_conditions)
        Probabilities of the conditions.
    locations, healthy
        As in `condition_log_probabilities`.

    Returns
    -------
    ndarray of int of shape (n_rows,)
        Indices of conditions.

    Examples
    --------
    >>> decided_condition(np.array([[0.4, 0.3, 0.3]]), np.array([0, 1, 2]), 0)
    array([1])
    """
    is_at = locations == np.arange(locations.max() + 1)[:, np.newaxis]
    of_locations = np.where(is_at, probability[:, np.newaxis], 0.0).sum(axis=2)
    if healthy >= 0:
        is_faulty = 2 * of_locations[:, healthy] < of_locations.sum(axis=1)
        of_locations[:, healthy] = np.where(is_faulty, -1.0, np.inf)
    decided_location = of_locations.argmax(axis=1)
    is_there = locations == decided_location[:, np.newaxis]
    return np.where(is_there, probability, -1.0).argmax(axis=1)


def with_largest(probability: Array, chosen: NDArray[np.intp]) -> Array:
    """Return probabilities of which a chosen one is the largest in each row.

    The chosen condition and all that are at least as probable get their mean.

    Parameters
    ----------
    probability : ndarray of shape (n_rows, n_conditions)
        Rows that sum to 1.
    chosen : ndarray of int of shape (n_rows,)
        Indices of conditions.

    Returns
    -------
    ndarray of shape (n_rows, n_conditions)
        Rows that sum to 1; the chosen condition exceeds the others by at least 1e-6 of
        itself if it did not exceed them before.

    Examples
    --------
    >>> with_largest(np.array([[0.5, 0.3, 0.2], [0.1, 0.8, 0.1]]), np.array([1, 1])).round(3)
    array([[0.4, 0.4, 0.2],
           [0.1, 0.8, 0.1]])
    """
    rows = np.arange(len(probability))
    of_chosen = probability[rows, chosen]
    is_raised = probability >= of_chosen[:, np.newaxis]
    mean = np.where(is_raised, probability, 0.0).sum(axis=1) / is_raised.sum(axis=1)
    changed = np.where(is_raised, mean[:, np.newaxis], probability)
    is_largest = changed.argmax(axis=1) == chosen
    changed[rows, chosen] *= np.where(is_largest, 1.0, 1 + 1e-6)
    return changed / changed.sum(axis=1, keepdims=True)


def decided(
    log_probability: Array,
    classes: Array,
    locations: Array,
    healthy: int,
) -> dict[str, Array]:
    """Return verdict, probability and score from the log probabilities of conditions.

    Parameters
    ----------
    log_probability : ndarray of shape (n_rows, n_classes + 1)
        That of each class, and of an unknown condition.
    classes : ndarray of shape (n_classes,)
        Labels.
    locations, healthy
        Locations of the classes, as in `condition_log_probabilities`.

    Returns
    -------
    dict of str to ndarray
        "verdict", the class that is decided for; "probability" of shape (n_rows,
        n_classes), in which the probability of an unknown condition is divided equally
        and the verdict is the largest; and "score", the logarithm of the probability,
        for two classes the second's less the first's.
    """
    with_unknown = np.exp(log_probability)
    of_classes = with_unknown[:, :-1]
    chosen = decided_condition(of_classes, locations, healthy)
    shared = of_classes + with_unknown[:, -1:] / len(classes)
    shared /= shared.sum(axis=1, keepdims=True)
    probability = with_largest(shared, chosen)
    score = np.log(probability)
    if len(classes) == 2:
        score = score[:, 1] - score[:, 0]
    return {"probability": probability, "verdict": classes[chosen], "score": score}
