"""Instants and strengths of the strikes of a local bearing defect."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from skarxlag.bearings import METRES_PER_MM, contact_speed, defect_frequencies, strike_rate

__all__ = ["impact_velocity", "load_distribution_at", "simulate_strikes", "transit_time"]

POINT_CONTACT_EXPONENT = 1.5


def transit_time(bearing: Any, rpm: float, crack_mm: float) -> float:
    r"""Time from an element's entry into a crack to its impact on the far edge.

    The element hits the far edge when its centre is over the middle of a crack of
    width w, so after :math:`w / (2 v)` with the contact speed v [1]_.

    Parameters
    ----------
    bearing : BearingGeometry
        The bearing.
    rpm : float
        Speed of the shaft, in revolutions per minute.
    crack_mm : float
        Width of the crack along the rolling direction, in mm.

    Returns
    -------
    time : float
        In seconds.

    References
    ----------
    .. [1] N. Sawalhi, R. B. Randall, "Vibration response of spalled rolling element
       bearings: observations, simulations and signal processing techniques to track the
       spall size", Mechanical Systems and Signal Processing 25 (2011).

    Examples
    --------
    >>> from skarxlag.bearings import SKF_6205
    >>> from skarxlag.datasets.strikes import transit_time
    >>> round(transit_time(SKF_6205, 300.0, 3.0) * 1e3, 2)  # milliseconds
    5.1
    """
    return float(crack_mm * METRES_PER_MM / (2 * contact_speed(bearing, rpm)))


def impact_velocity(bearing: Any, rpm: float, crack_mm: float) -> float:
    r"""Velocity at which an element meets the far edge of a crack.

    An element of diameter d that rests on both edges of a crack of width w has turned
    by :math:`\arcsin(w / d)`, so the contact speed v has the component
    :math:`v w / d` along the line of the impact: it grows with the crack and the speed.

    Parameters
    ----------
    bearing : BearingGeometry
        The bearing.
    rpm : float
        Speed of the shaft, in revolutions per minute.
    crack_mm : float
        Width of the crack along the rolling direction, in mm.

    Returns
    -------
    velocity : float
        In m/s.

    Examples
    --------
    >>> from skarxlag.bearings import SKF_6205
    >>> from skarxlag.datasets.strikes import impact_velocity
    >>> round(impact_velocity(SKF_6205, 500.0, 3.0), 3)
    0.185
    """
    return float(contact_speed(bearing, rpm) * crack_mm / bearing.element_diameter)


def load_distribution_at(angle: float | NDArray[Any], load_distribution: float) -> NDArray[Any]:
    r"""Load of an element at an angle from the load's direction, relative to the largest.

    Stribeck's distribution with load distribution factor :math:`\epsilon` and the
    exponent 3/2 of a point contact [1]_,

    .. math:: q(\psi) = \max\left(0,\, 1 - \frac{1 - \cos\psi}{2 \epsilon}\right)^{3/2}.

    Parameters
    ----------
    angle : float or ndarray
        Angle from the direction of the load, in radians.
    load_distribution : float
        The factor epsilon, > 0; 0.5 is a bearing without clearance.

    Returns
    -------
    load : ndarray
        In [0, 1].

    References
    ----------
    .. [1] T. A. Harris, M. N. Kotzalas, "Rolling Bearing Analysis", 5th ed., 2006,
       chapter 7.

    Examples
    --------
    >>> import numpy as np
    >>> from skarxlag.datasets.strikes import load_distribution_at
    >>> load_distribution_at(np.array([0.0, np.pi]), 0.5)
    array([1., 0.])
    """
    unloaded = (1 - np.cos(angle)) / (2 * load_distribution)
    return np.clip(1 - unloaded, 0, None) ** POINT_CONTACT_EXPONENT


def _interval_sums(expected, slip, rng):
    """Instants after the first strike in mean intervals, for at least `expected` of them."""
    # The margin covers the accumulated slip, whose deviation grows as the square root.
    n_intervals = int(np.ceil(expected + 6 * slip * np.sqrt(expected) + 2))
    return np.concatenate([[0.0], np.cumsum(1 + slip * rng.standard_normal(n_intervals))])


def simulate_strikes(
    bearing: Any,
    rpm: float,
    location: str,
    *,
    duration: float,
    before: float,
    slip: float,
    load_distribution: float,
    rng: np.random.Generator,
) -> tuple[NDArray[Any], NDArray[Any]]:
    r"""Instants of the entries into a defect, and the load carried at each.

    The intervals are independent, :math:`(1 + s\,\xi) / f` with the defect's strike rate f,
    slip s and :math:`\xi` of unit variance, so that the deviation of the instants accumulates
    as that of real rolling elements does [1]_. The load zone stands still: a defect of the outer
    ring stays under the largest load, one of the inner ring turns through the zone with the
    shaft and one of a ball with the cage [2]_.

    Parameters
    ----------
    bearing : BearingGeometry
        The bearing.
    rpm : float
        Speed of the shaft, in revolutions per minute.
    location : {"outer", "inner", "ball"}
        Where the defect is.
    duration : float
        Time to cover, in seconds, from 0.
    before : float
        Time to cover before 0, in seconds. What happens from 0 on does not depend on it.
    slip : float
        Standard deviation of an interval relative to its mean, in [0, 0.1].
    load_distribution : float
        The factor of :func:`load_distribution_at`.
    rng : numpy.random.Generator
        Source of randomness.

    Returns
    -------
    times : ndarray of shape (n_strikes,)
        Instants of the entries in seconds, ascending.
    load : ndarray of shape (n_strikes,)
        Load at each instant relative to the largest, in [0, 1].

    References
    ----------
    .. [1] J. Antoni, R. B. Randall, "A stochastic model for simulation and diagnostics of
       rolling element bearings with localized faults", J. Vib. Acoust. 125 (2003).
    .. [2] P. D. McFadden, J. D. Smith, "Model for the vibration produced by a single point
       defect in a rolling element bearing", Journal of Sound and Vibration 96 (1984).

    Examples
    --------
    >>> import numpy as np
    >>> from skarxlag.bearings import SKF_6205
    >>> from skarxlag.datasets.strikes import simulate_strikes
    >>> times, load = simulate_strikes(
    ...     SKF_6205, 300.0, "outer", duration=10.0, before=0.0, slip=0.01, load_distribution=0.5,
    ...     rng=np.random.default_rng(0))
    >>> len(times), float(load.min())
    (179, 1.0)
    """
    rate = strike_rate(bearing, rpm, location)
    zone_phase, first = rng.uniform(size=2)
    ahead = first + _interval_sums(duration * rate, slip, rng)
    behind = first - 1 - _interval_sums(before * rate, slip, rng)
    times = np.concatenate([behind[::-1], ahead]) / rate
    times = times[(times >= -before) & (times < duration)]
    turns = {
        "outer": 0.0,
        "inner": rpm / 60,
        "ball": defect_frequencies(bearing, rpm)["cage"],
    }[location]
    angle = 0.0 if location == "outer" else 2 * np.pi * zone_phase
    return times, load_distribution_at(angle + 2 * np.pi * turns * times, load_distribution)
