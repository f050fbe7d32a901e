"""Probabilities of fault locations and conditions from residuals, for any specimen.

Residuals separate the conditions best for the specimens that were recorded. Another
specimen of the same fault resembles the recorded one less, and it resembles other
faults nearly as much. These functions ask two questions: whether there is a fault, and
which location it has. For each question they mix two answers: that for a specimen that was
recorded, and that for another one.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, log_expit, logit

from .arrays import Array
from .speed_references import LEAST_DRIFT

#: Exponents of the residuals in the probabilities of the answers. They are chosen by
#: leaving rigs out, as all constants of this module are, see ``python -m
#: benchmarks.another_bearing constants``. The first is that of a specimen that was
#: recorded. The others are those of another specimen, for the question whether there is
#: a fault, and for the question at which location.
RECORDED_EXPONENT = 32.0
FAULT_EXPONENT = 8.0
LOCATION_EXPONENT = 4.0
#: Log odds of a recorded specimen for each neper by which the gap of the residuals
#: exceeds that of noise. The gap is the logarithm of the second smallest residual over
#: the smallest.
GAP_ODDS = 5.0
#: Least gap of noise that is assumed, in the questions about the fault and about its
#: location.
LEAST_FAULT_GAP = 0.4
LEAST_LOCATION_GAP = 0.2
#: Range of these log odds: a gap is never proof.
_GAP_RANGE = (-6.0, 8.0)
#: Log odds against a recorded specimen for each neper by which the smallest residual
#: exceeds the second number.
FAR_ODDS = 8.0
FAR = 1.6
#: Odds of an unknown condition against another specimen of a known one, if the row is
#: no farther than other specimens are.
UNKNOWN_SHARE = 0.2
#: Log odds of an unknown condition for each neper by which the smallest residual
#: exceeds the second number, at a training speed. The drift of another speed hides a
#: part of the distance.
UNKNOWN_ODDS = 6.0
UNLIKE = 3.2


class Posterior(NamedTuple):
    """Log probabilities of conditions, and whether rows are of recorded specimens.

    Parameters
    ----------
    log_probability : ndarray of shape (n_rows, n_conditions + 1)
        Natural logarithms of the probabilities of the conditions, and in the last
        column of an unknown condition.
    recorded : ndarray of shape (n_rows,)
        Probability that the row is of a specimen that was recorded.
    """

    log_probability: NDArray[np.float64]
    recorded: NDArray[np.float64]


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


def recorded_log_odds(
    residuals: Array,
    noise_gap: float | NDArray[np.float64],
    prior: float = 0.5,
) -> Array:
    r"""Compute the log odds that rows are of a specimen that was recorded.

    .. math::

        \ln\frac{\pi}{1 - \pi} + 5\,(g - g_0)
        - 8 \max\bigl(\ln (r_1 / 1.6), 0\bigr)

    with the prior :math:`\pi`, the smallest residual :math:`r_1`, the gap :math:`g =
    \ln (r_2 / r_1)` to the second one, and the gap :math:`g_0` that noise reaches. The
    second term is limited to the range from -6 to 8. A row of a recorded specimen
    resembles one answer much more than any other.

    Parameters
    ----------
    residuals : ndarray of shape (n_rows, n_answers)
        Natural logarithms of the residuals of the answers to one question.
    noise_gap : float or ndarray of shape (n_rows,)
        The largest gap of noise, at least 0.
    prior : float, default=0.5
        The probability that a row is of a recorded specimen, in (0, 1).

    Returns
    -------
    ndarray of shape (n_rows,)
        Natural logarithms of odds.

    Examples
    --------
    >>> recorded_log_odds(np.log([[1.0, 2.0], [1.0, 1.1], [2.0, 4.0]]), 0.2).round(1)
    array([ 2.5, -0.5,  0.7])
    """
    two_smallest = np.sort(residuals, axis=1)[:, :2]
    smallest = two_smallest[:, 0]
    gap = two_smallest[:, -1] - smallest
    by_gap = np.clip(GAP_ODDS * (gap - noise_gap), *_GAP_RANGE)
    distance = np.maximum(smallest - np.log(FAR), 0.0)
    return logit(prior) + by_gap - FAR_ODDS * distance


def answer_log_probabilities(
    residuals: Array, exponent: float, recorded: Array
) -> Array:
    r"""Compute the log probability of each answer to a question.

    .. math:: q\,\frac{r_a^{-32}}{\sum r^{-32}} + (1 - q)\,\frac{r_a^{-k}}{\sum r^{-k}}

    with the probability q that the row is of a recorded specimen, and the exponent k of
    others.

    Parameters
    ----------
    residuals : ndarray of shape (n_rows, n_answers)
        Natural logarithms of the residuals.
    exponent : float
        The exponent k, at least 0.
    recorded : ndarray of shape (n_rows,)
        Log odds of q, see `recorded_log_odds`.

    Returns
    -------
    ndarray of shape (n_rows, n_answers)
        Natural logarithms; those of a row sum to 1 as probabilities.

    Examples
    --------
    >>> residuals = np.log([[1.0, 1.2]])
    >>> np.exp(answer_log_probabilities(residuals, 4.0, np.array([-20.0]))).round(2)
    array([[0.67, 0.33]])
    >>> np.exp(answer_log_probabilities(residuals, 4.0, np.array([20.0]))).round(2)
    array([[1., 0.]])
    """
    of_recorded = _log_softmax(-RECORDED_EXPONENT * residuals)
    of_others = _log_softmax(-exponent * residuals)
    if_recorded = log_expit(recorded)[:, np.newaxis] + of_recorded
    if_another = log_expit(-recorded)[:, np.newaxis] + of_others
    return np.logaddexp(if_recorded, if_another)


def _log_softmax(scores):
    """Return what `scipy.special.log_softmax` does, which takes as long as a row's spectra."""
    below_largest = scores - scores.max(axis=1, keepdims=True)
    total = np.exp(below_largest).sum(axis=1, keepdims=True)
    return below_largest - np.log(total)


def unknown_log_odds(smallest: Array, recorded: Array, drift: Array) -> Array:
    r"""Compute the log odds of an unknown condition against all known ones.

    .. math::

        \ln (1 - q) + \ln\frac{0.2}{0.8}
        + 6 \max\left(\ln \frac{r_1 \sqrt{f / 0.2}}{3.2},\; 0\right)

    with the probability q of a recorded specimen, the smallest residual :math:`r_1`,
    and the factor f on the drift, 0.2 at a training speed. The residual of a row that
    no drift explains falls with the root of f.

    Parameters
    ----------
    smallest : ndarray of shape (n_rows,)
        Natural logarithms of the smallest residuals.
    recorded : ndarray of shape (n_rows,)
        Log odds of q, see `recorded_log_odds`.
    drift : ndarray of shape (n_rows,)
        Factors f, see :func:`skarxlag.kernels.speed_references.drift_factor`.

    Returns
    -------
    ndarray of shape (n_rows,)
        Natural logarithms of odds.

    Examples
    --------
    >>> unknown_log_odds(np.log([1.0, 6.4]), np.zeros(2), np.full(2, 0.2)).round(2)
    array([-2.08,  2.08])
    """
    at_training_speed = smallest + np.log(drift / LEAST_DRIFT) / 2
    beyond = np.maximum(at_training_speed - np.log(UNLIKE), 0.0)
    return log_expit(-recorded) + logit(UNKNOWN_SHARE) + UNKNOWN_ODDS * beyond


def question_gaps(residuals: Array, locations: Array, healthy: int) -> Array:
    """Compute the gaps between the two nearest answers to both questions.

    Parameters
    ----------
    residuals, locations, healthy
        As in `condition_log_probabilities`.

    Returns
    -------
    ndarray of shape (n_rows, 2)
        Of the question whether there is a fault, and at which location; 0 if there is one
        answer.

    Examples
    --------
    >>> residuals = np.log([[1.0, 0.5, 1.0]])
    >>> question_gaps(residuals, np.array([0, 1, 2]), 0).round(2)
    array([[0.69, 0.69]])
    """
    nearest = _by_location(np.min, residuals, locations)
    of_faults = nearest[:, np.arange(nearest.shape[1]) != healthy]
    gaps = np.zeros((len(residuals), 2))
    if of_faults.shape[1] > 1:
        smallest = np.sort(of_faults, axis=1)
        gaps[:, 1] = smallest[:, 1] - smallest[:, 0]
    if healthy >= 0 and of_faults.shape[1] > 0:
        gaps[:, 0] = np.abs(nearest[:, healthy] - of_faults.min(axis=1))
    return gaps


def _by_location(function, values, locations):
    """Return a function of the columns of each location, which reduces axis 1."""
    of_locations = [
        function(values[:, locations == location], axis=1)
        for location in range(locations.max() + 1)
    ]
    return np.stack(of_locations, axis=1)


def condition_log_probabilities(
    residuals: Array,
    locations: Array,
    healthy: int,
    drift: Array,
    noise_gaps: tuple[float, float] = (0.0, 0.0),
    prior: float = 0.5,
    location_exponent: float = LOCATION_EXPONENT,
    n_rows: float | NDArray[np.float64] = 1.0,
) -> Posterior:
    r"""Compute the log probability of each condition, and that of an unknown one.

    Three questions are asked in turn: whether there is a fault, at which location, and
    which of the conditions of the location it is. The residual of an answer is the
    smallest residual of its conditions. The first two questions are answered by
    `answer_log_probabilities`. The conditions of a location differ by specimen, so the
    third has the exponent of a recorded specimen.

    Whether the specimen was recorded is the same for all rows of a recording. So the
    questions are asked once, about the mean of the logarithms over its n rows. The gap
    that noise reaches is then :math:`g_0 / \sqrt{n}`, because the noise of the rows is
    independent.

    Parameters
    ----------
    residuals : ndarray of shape (n_rows, n_conditions)
        Natural logarithms of the residuals, or means of them.
    locations : ndarray of int of shape (n_conditions,)
        Number of the location of each condition; all numbers from 0 to the largest occur.
    healthy : int
        Number of the location of healthy conditions; -1 if there is none.
    drift : ndarray of shape (n_rows,)
        Factors on the drift at the speeds of the rows.
    noise_gaps : tuple of two floats, default=(0.0, 0.0)
        Largest gaps of noise in the questions about the fault and about its location. At
        least .4 and .2 are used.
    prior : float, default=0.5
        Probability that a row is of a recorded specimen, in (0, 1).
    location_exponent : float, default=4.0
        Exponent of the residuals of locations for other specimens, at least 0.
    n_rows : float or ndarray of shape (n_rows,), default=1.0
        Number n of rows that each mean is of, above 0.

    Returns
    -------
    Posterior
        Log probabilities, and the probability of a recorded specimen.

    Examples
    --------
    A healthy condition, two of the inner race and one of the outer race:

    >>> residuals = np.log([[1.0, 0.5, 0.6, 0.9]])
    >>> found = condition_log_probabilities(residuals, np.array([0, 1, 1, 2]), 0, np.full(1, 0.2))
    >>> np.exp(found.log_probability).round(2), found.recorded.round(2)
    (array([[0.  , 0.96, 0.  , 0.01, 0.03]]), array([0.87]))
    """
    fault_gap = max(noise_gaps[0], LEAST_FAULT_GAP) / np.sqrt(n_rows)
    location_gap = max(noise_gaps[1], LEAST_LOCATION_GAP) / np.sqrt(n_rows)
    nearest = _by_location(np.min, residuals, locations)
    n_locations = nearest.shape[1]
    of_location = np.zeros((len(residuals), n_locations))
    is_fault = np.arange(n_locations) != healthy
    of_faults = nearest[:, is_fault]
    recorded = np.full(len(residuals), -np.inf)
    if of_faults.shape[1] > 0:
        recorded = recorded_log_odds(of_faults, location_gap, prior)
        answers = answer_log_probabilities(of_faults, location_exponent, recorded)
        of_location[:, is_fault] = answers
    if healthy >= 0 and of_faults.shape[1] > 0:
        of_nearest_fault = of_faults.min(axis=1)
        question = np.stack([nearest[:, healthy], of_nearest_fault], axis=1)
        of_question = recorded_log_odds(question, fault_gap, prior)
        answers = answer_log_probabilities(question, FAULT_EXPONENT, of_question)
        of_location[:, healthy] = answers[:, 0]
        of_location[:, is_fault] += answers[:, 1:]
        recorded = np.maximum(recorded, of_question)
    scores = np.empty((len(residuals), len(locations) + 1))
    for location in range(n_locations):
        conditions = np.flatnonzero(locations == location)
        among = _log_softmax(-RECORDED_EXPONENT * residuals[:, conditions])
        scores[:, conditions] = of_location[:, [location]] + among
    scores[:, -1] = unknown_log_odds(nearest.min(axis=1), recorded, drift)
    return Posterior(_log_softmax(scores), expit(recorded))


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
    of_locations = _by_location(np.sum, probability, locations)
    if healthy >= 0:
        is_faulty = 2 * of_locations[:, healthy] < of_locations.sum(axis=1)
        of_locations[is_faulty, healthy] = -1.0
        of_locations[~is_faulty, healthy] = np.inf
    decided_location = of_locations.argmax(axis=1)
    is_there = locations == decided_location[:, np.newaxis]
    return np.where(is_there, probability, -1.0).argmax(axis=1)


def with_largest(probability: Array, chosen: NDArray[np.intp]) -> Array:
    r"""Return the nearest probabilities of which a chosen one is the largest in each row.

    Where another condition is more probable than the chosen one, both get the level t,
    which all others are limited to: :math:`\sum_{c \ne c^*} \min(p_c, t) + t = 1`. This
    is the smallest change.

    Parameters
    ----------
    probability : ndarray of shape (n_rows, n_conditions)
        Rows that sum to 1.
    chosen : ndarray of int of shape (n_rows,)
        Indices of conditions.

    Returns
    -------
    ndarray of shape (n_rows, n_conditions)
        Rows that sum to 1; the chosen condition exceeds the others by at least 1e-9 of
        itself.

    Examples
    --------
    >>> with_largest(np.array([[0.4, 0.3, 0.3], [0.1, 0.8, 0.1]]), np.array([1, 1])).round(3)
    array([[0.35, 0.35, 0.3 ],
           [0.1 , 0.8 , 0.1 ]])
    """
    changed = probability.copy()
    rows = np.flatnonzero(probability.argmax(axis=1) != chosen)
    if len(rows) == 0:
        return changed
    others = probability[rows]
    others[np.arange(len(rows)), chosen[rows]] = np.inf
    # The chosen one comes last.
    ascending = np.sort(others, axis=1)
    sums = np.zeros(ascending.shape)
    sums[:, 1:] = np.cumsum(ascending[:, :-1], axis=1)
    # The level of the chosen one and of all but the first k of the others.
    levels = (1 - sums) / np.arange(ascending.shape[1], 0, -1)
    first = (levels <= ascending).argmax(axis=1)
    level = levels[np.arange(len(rows)), first]
    changed[rows] = np.minimum(probability[rows], level[:, np.newaxis])
    changed[rows, chosen[rows]] = level * (1 + 1e-6)
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
