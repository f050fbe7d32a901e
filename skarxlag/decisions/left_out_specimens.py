"""Specimens of conditions, and the exponent of residuals that left-out specimens choose."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import log_softmax
from sklearn.base import clone
from sklearn.utils import column_or_1d

from ..core.fault_locations import FAULT_LOCATIONS
from ..core.state import expect
from ..kernels import posterior

#: Exponents that left-out specimens may choose, and the standard deviation of the
#: logarithm of the exponent over rigs, which counts as much as they do.
EXPONENTS = np.array([0.5, 1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0])
EXPONENT_DEVIATION = 0.7
_HEALTHY = FAULT_LOCATIONS.index("healthy")


def specimens_of_rows(
    specimen: ArrayLike | None, n_rows: int
) -> NDArray[np.str_] | None:
    """Return the identifier of the specimen of each row as text, or None."""
    if specimen is None:
        return None
    names = column_or_1d(np.asarray(specimen, dtype=object))
    expected = f"{n_rows}, as X has rows"
    expect(len(names) == n_rows, "Length of specimen", len(names), expected)
    return names.astype(str)


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
    by_location = [
        sorted(set(specimens[locations == location]))
        for location in np.unique(locations)
    ]
    several = [names for names in by_location if len(names) > 1]
    distance = np.log(EXPONENTS / posterior.LOCATION_EXPONENT) / EXPONENT_DEVIATION
    total = -(distance**2) / 2
    location_of_label = dict(zip(y.tolist(), locations.tolist(), strict=True))
    for fold in range(max(map(len, several), default=0)):
        left_out = [names[fold] for names in several if fold < len(names)]
        is_left = np.isin(specimens, left_out)
        learner = clone(residual)
        learner.fit(X[~is_left], y[~is_left], **_of_rows(metadata, ~is_left))
        learned = np.array(
            [location_of_label[label] for label in learner.classes_.tolist()]
        )
        speeds = {name: value for name, value in metadata.items() if name == "rpm"}
        levels = learner.transform(X[is_left], **_of_rows(speeds, is_left))
        logs = _log_probabilities(np.asarray(levels), learned, locations[is_left])
        for name in sorted(set(left_out)):
            of_specimen = logs[specimens[is_left] == name]
            is_counted = ~np.isnan(of_specimen[:, 0])
            if is_counted.any():
                total = total + of_specimen[is_counted].mean(axis=0)
    return float(EXPONENTS[total.argmax()])


def _of_rows(metadata, rows):
    """Return the metadata of some rows; a scalar holds for all."""
    return {
        name: value if np.ndim(value) == 0 else np.asarray(value)[rows]
        for name, value in metadata.items()
    }


def _log_probabilities(levels, learned, true):
    """Log probability of the true location by row and exponent; NaN if it was not learned."""
    faults = np.unique(learned[learned != _HEALTHY])
    logs = np.full((len(true), len(EXPONENTS)), np.nan)
    rows = np.flatnonzero(np.isin(true, faults))
    if len(faults) < 2 or len(rows) == 0:
        return logs
    residuals = posterior.logarithms(levels[rows])
    nearest = np.stack(
        [residuals[:, learned == fault].min(axis=1) for fault in faults], axis=1
    )
    columns = np.searchsorted(faults, true[rows])
    for number, exponent in enumerate(EXPONENTS):
        of_faults = log_softmax(-exponent * nearest, axis=1)
        logs[rows, number] = of_faults[np.arange(len(rows)), columns]
    return logs
