"""How alike specimens are: the exponent of residuals that specimens left out of training choose."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import log_softmax
from sklearn.base import clone

from ..core.fault_locations import FAULT_LOCATIONS
from ..kernels import posterior

#: Exponents that left-out specimens may choose, and the standard deviation of the
#: logarithm of the exponent over rigs, which counts as much as they do.
EXPONENTS = np.array([0.5, 1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0])
EXPONENT_DEVIATION = 0.7
_HEALTHY = FAULT_LOCATIONS.index("healthy")


def location_exponent(
    residual: Any,
    X: ArrayLike,
    y: NDArray[Any],
    specimens: NDArray[Any],
    locations: NDArray[Any],
    metadata: Mapping[str, Any],
) -> float:
    r"""Compute the exponent of residuals in the probabilities of locations of other specimens.

    Each specimen of a location with several is left out in turn, one of each location at a
    time. The others train the residuals. The exponent k maximises

    .. math::

        \sum_s \overline{\log p_k(\text{location} \mid s)}
        - \frac{(\log k / k_0)^2}{2 \sigma^2}

    over the left-out faulty specimens s, whose log probabilities are means over their
    rows. The last term is the exponent of other rigs: :math:`k_0` is that of
    :data:`skarxlag.kernels.posterior.LOCATION_EXPONENT`, with :math:`\sigma` = .7.

    Parameters
    ----------
    residual : estimator
        Transformer from rows to one residual for each condition. It is cloned.
    X : array-like of shape (n_rows, ...)
        Rows.
    y : ndarray of shape (n_rows,)
        Condition of each row.
    specimens : ndarray of shape (n_rows,)
        Identifier of the specimen of each row.
    locations : ndarray of int of shape (n_rows,)
        Location of the condition of each row, as an index into
        :data:`skarxlag.core.fault_locations.FAULT_LOCATIONS`. Other locations have larger
        numbers.
    metadata : mapping of str to array-like
        What ``residual.fit`` is given: scalars, or one value for each row.

    Returns
    -------
    float
        From .5 to 16. It is that of other rigs if no specimen can be left out.
    """
    by_location = [sorted(set(specimens[locations == p])) for p in np.unique(locations)]
    several = [names for names in by_location if len(names) > 1]
    distance = np.log(EXPONENTS / posterior.LOCATION_EXPONENT) / EXPONENT_DEVIATION
    total = -(distance**2) / 2
    for fold in range(max(map(len, several), default=0)):
        left = {names[fold] for names in several if fold < len(names)}
        is_left = np.isin(specimens, list(left))
        learner = clone(residual).fit(
            X[~is_left], y[~is_left], **_chosen(metadata, ~is_left)
        )
        known = dict(zip(y.tolist(), locations.tolist(), strict=True))
        learned = np.array([known[label] for label in learner.classes_.tolist()])
        speeds = {name: value for name, value in metadata.items() if name == "rpm"}
        levels = learner.transform(X[is_left], **_chosen(speeds, is_left))
        found = _log_probabilities(np.asarray(levels), learned, locations[is_left])
        for name in left:
            of_specimen = found[specimens[is_left] == name]
            counted = ~np.isnan(of_specimen[:, 0])
            if counted.any():
                total = total + of_specimen[counted].mean(axis=0)
    return float(EXPONENTS[total.argmax()])


def _chosen(metadata, rows):
    """Return the metadata of some rows; a scalar holds for all."""
    return {
        name: value if np.ndim(value) == 0 else np.asarray(value)[rows]
        for name, value in metadata.items()
    }


def _log_probabilities(levels, learned, true):
    """Log probability of the true location by row and exponent; NaN if it was not learned."""
    faults = np.unique(learned[learned != _HEALTHY])
    found = np.full((len(true), len(EXPONENTS)), np.nan)
    counted = np.flatnonzero(np.isin(true, faults))
    if len(faults) < 2 or len(counted) == 0:
        return found
    logs = posterior.logarithms(levels[counted])
    nearest = np.stack([logs[:, learned == p].min(axis=1) for p in faults], axis=1)
    at = np.searchsorted(faults, true[counted])
    for column, exponent in enumerate(EXPONENTS):
        by_location = log_softmax(-exponent * nearest, axis=1)
        found[counted, column] = by_location[np.arange(len(at)), at]
    return found
