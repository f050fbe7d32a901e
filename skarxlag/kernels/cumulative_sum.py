"""Page's cumulative sum of windows above a threshold: its step, its limit and its run length."""

from bisect import bisect_left
from functools import lru_cache

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve

#: Limits beyond this are of no practical use: an alarm would take thousands of windows.
_LARGEST_LIMIT = 2**16


def reference_step(healthy_rate: float, faulty_rate: float) -> int:
    r"""Compute the step m of the cumulative sum from the rates of healthy and of faulty windows.

    The log-likelihood ratio of two Bernoulli sequences increases by a fixed amount with
    a window that exceeds the threshold. It decreases by another fixed amount with a
    window that does not. If the ratio is scaled so that it decreases by 1, it increases
    by :math:`m - 1`. A share of :math:`1 / m` of windows above the threshold thus
    leaves the sum unchanged in the mean. Here

    .. math::

        m = \ln\frac{p_1 (1 - p_0)}{p_0 (1 - p_1)} \Big/ \ln\frac{1 - p_0}{1 - p_1}

    is rounded to an integer, so that the sum is an integer, too (Reynolds and Stoumbos
    1999).

    Parameters
    ----------
    healthy_rate, faulty_rate : float
        Shares :math:`p_0 < p_1`, in (0, 1), of windows that exceed the threshold.

    Returns
    -------
    int
        m, at least 2 and below :math:`1 / p_0`.

    Raises
    ------
    ValueError
        If the healthy rate is not below the other one, or not below one half.

    Examples
    --------
    >>> reference_step(0.01, 0.5)
    7
    """
    if not healthy_rate < min(faulty_rate, 0.5):
        raise ValueError(
            f"healthy windows exceed the threshold at a rate of {healthy_rate:g}, expected below "
            f"faulty_rate={faulty_rate:g} and below 0.5"
        )
    share_below = 1 - faulty_rate
    healthy_share_below = 1 - healthy_rate
    log_odds_above = np.log(
        faulty_rate * healthy_share_below / (healthy_rate * share_below)
    )
    log_odds_below = np.log(healthy_share_below / share_below)
    # With a larger step, the sum of healthy windows would rise in the mean.
    largest = int(np.ceil(1 / healthy_rate)) - 1
    return max(2, min(round(log_odds_above / log_odds_below), largest))


def mean_run_length(limit: int, step: int, rate: float, persistence: float) -> float:
    r"""Compute the mean number of windows until the sum reaches its limit, starting from 0.

    The sum changes to :math:`s + m - 1` with a window that exceeds the threshold, and
    to :math:`\max(s - 1, 0)` with one that does not. Windows above the threshold occur
    in runs. They are modelled as a Markov chain: `persistence` is the probability that
    a window exceeds the threshold after one that did, and `rate` is the share of such
    windows in the long run. The sum and the last window together are a Markov chain,
    too. The mean times until its absorption solve a linear system (Brook and Evans
    1972).

    Parameters
    ----------
    limit : int
        Limit of the sum, at least 1.
    step : int
        m, at least 2.
    rate : float
        Share of windows that exceed the threshold, in (0, 1).
    persistence : float
        Probability in (0, 1) that a window exceeds after one that did.

    Returns
    -------
    float
        Mean number of windows.

    Examples
    --------
    If one window is enough and every tenth window exceeds the threshold:

    >>> round(mean_run_length(1, 2, 0.1, 0.1), 9)
    10.0
    """
    after_quiet = rate * (1 - persistence) / (1 - rate)
    below, above = (
        sparse.eye_array(limit + step, k=k, format="lil")[:limit, :limit]
        for k in (-1, step - 1)
    )
    below[0, 0] = 1
    chances = np.array([[after_quiet], [persistence]])
    moves = sparse.hstack(
        [sparse.kron(1 - chances, below), sparse.kron(chances, above)]
    )
    staying = sparse.eye_array(2 * limit) - moves
    lengths = spsolve(staying.tocsc(), np.ones(2 * limit))
    return float(lengths[0])


@lru_cache
def alarm_limit(run_length: float, step: float, rate: float, persistence: float) -> int:
    """Find the smallest limit at which healthy windows raise an alarm rarely enough.

    Parameters
    ----------
    run_length : float
        Smallest acceptable mean number of healthy windows until an alarm.
    step, rate, persistence
        Parameters of `mean_run_length`. The sum of healthy windows must decrease in the
        mean.

    Returns
    -------
    int
        The limit.

    Raises
    ------
    ValueError
        If no limit of practical use satisfies the requirement.

    Examples
    --------
    >>> limit = alarm_limit(1e6, 7, 0.01, 0.01)
    >>> mean_run_length(limit - 1, 7, 0.01, 0.01) < 1e6 <= mean_run_length(limit, 7, 0.01, 0.01)
    True
    """

    def length(limit):
        return mean_run_length(limit, step, rate, persistence)

    high = 1
    while length(high) < run_length:
        high *= 2
        if high > _LARGEST_LIMIT:
            raise ValueError(
                f"healthy windows that exceed the threshold at a rate of {rate:g} and follow each "
                f"other with probability {persistence:g} allow no alarm that is false only once in "
                f"{run_length:.3g} windows; expected rarer or less persistent ones."
            )
    # The limit lies above half of `high`, which is too low.
    return bisect_left(range(high), run_length, lo=high // 2 + 1, key=length)
