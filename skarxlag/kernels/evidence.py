"""Evidence of several windows that depend on each other."""

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr, ndtri

from .arrays import Array

#: Smallest probability of a condition in a window. Without it, a single window could
#: veto a condition for the whole recording.
SMALLEST_PROBABILITY = 1e-6
#: Correlation of the probabilities of two windows of one recording, for classifiers
#: that do not join windows: they share specimen, mounting, load and the error of the
#: model at this speed. It was chosen on real rigs with earlier probabilities.
CORRELATION = 0.7
#: Correlation of the p-values of two windows of one recording: they share the error of
#: the limits at this speed. Of 0.5, 0.8 and 1, it had the fewest false alarms and
#: missed no fault on UESTC, SpectraQuest and the self-built rig, with limits from rows
#: of 1 s at one speed, asked at the others.
P_VALUE_CORRELATION = 0.8
#: The same for the p-values of the nearest condition, whose limits move less with the
#: speed: most unknown conditions are rejected at training speeds only.
NEAREST_CORRELATION = 0.5
#: The same for the combs of windows of one machine at one speed, chosen on runs to
#: failure: bearings change while they run in.
COMB_CORRELATION = 0.2
#: Range of the p-values that are combined: beyond it they are not accurate.
_ACCURATE_P = (1e-300, 0.999)


def effective_number(n_windows: ArrayLike, correlation: float = CORRELATION) -> Array:
    r"""Return the number of independent windows with as much evidence as correlated ones.

    .. math:: n / (1 + (n - 1) \varrho)

    with the correlation :math:`\varrho` of two windows of a recording.

    Parameters
    ----------
    n_windows : array-like
        Numbers of windows n, above 0.
    correlation : float, default=0.7
        :math:`\varrho`, from 0 to 1.

    Returns
    -------
    ndarray
        Effective numbers, at most :math:`1 / \varrho`.

    Examples
    --------
    >>> effective_number([1, 3], correlation=0.5).tolist()
    [1.0, 1.5]
    """
    n = np.asarray(n_windows, dtype=np.float64)
    # Fading evidence may weigh less than one window.
    return n / (1 + np.maximum(n - 1, 0) * correlation)


def combined_p_value(
    p_values: ArrayLike, correlation: float = P_VALUE_CORRELATION
) -> float:
    r"""Combine the p-values of the windows of a recording, which depend on each other.

    Stouffer's method for correlated tests:
    :math:`p = \Phi(\sqrt{n_e}\; \overline{\Phi^{-1}(p_w)})` with the effective number
    :math:`n_e` of windows, see `effective_number`.

    Parameters
    ----------
    p_values : array-like of shape (n_windows,)
        Values in (0, 1]; NaN is left out.
    correlation : float, default=0.8
        Correlation of two windows of a recording, from 0 to 1.

    Returns
    -------
    float
        The p-value of the recording; NaN if there are no p-values.

    References
    ----------
    M. J. Strube (1985), "Combining and comparing significance levels from
    nonindependent hypothesis tests", Psychological Bulletin 97(2), 334-341.

    Examples
    --------
    >>> round(combined_p_value([0.01]), 4), round(combined_p_value([0.01] * 100), 4)
    (0.01, 0.0047)
    """
    scores = p_value_score(p_values)
    scores = scores[~np.isnan(scores)]
    if len(scores) == 0:
        return np.nan
    return combined_score(scores.mean(), len(scores), correlation)


def p_value_score(p_values: ArrayLike) -> Array:
    """Return standard normal quantiles of p-values, which are limited to the accurate range."""
    return ndtri(np.clip(p_values, *_ACCURATE_P))


def combined_score(
    mean: float, n_windows: float, correlation: float = P_VALUE_CORRELATION
) -> float:
    """Return the p-value of `n_windows` correlated windows with this mean of `p_value_score`."""
    n_independent = effective_number(n_windows, correlation)
    return float(ndtr(np.sqrt(n_independent) * mean))
