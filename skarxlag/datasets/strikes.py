"""Times and strengths of the strikes of a local bearing defect."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from skarxlag.bearings import (
    METRES_PER_MM,
    BearingGeometry,
    contact_speed,
    defect_frequencies,
)

POINT_CONTACT_EXPONENT = 1.5


def transit_time(bearing: BearingGeometry, rpm: float, crack_mm: float) -> float:
    r"""Return the time from an element's entry into a crack to its impact on the far edge.

    The element hits the far edge of a crack of width w when its centre is over the
    middle of the crack. With the contact speed v, this is the time :math:`w / (2 v)`
    after the entry [1]_.

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
        Time in seconds.

    References
    ----------
    .. [1] N. Sawalhi, R. B. Randall, "Vibration response of spalled rolling element
           bearings: observations, simulations and signal processing techniques to track
           the spall size", Mechanical Systems and Signal Processing 25 (2011).

    Examples
    --------
    >>> from skarxlag.bearings import SKF_6205
    >>> from skarxlag.datasets.strikes import transit_time
    >>> round(transit_time(SKF_6205, 300.0, 3.0) * 1e3, 2)  # milliseconds
    5.1
    """
    return float(crack_mm * METRES_PER_MM / (2 * contact_speed(bearing, rpm)))


def impact_velocity(bearing: BearingGeometry, rpm: float, crack_mm: float) -> float:
    r"""Return the velocity at which an element hits the far edge of a crack.

    An element of diameter d that rests on both edges of a crack of width w has turned
    by :math:`\arcsin(w / d)`. The contact speed v therefore has the component :math:`v
    w / d` along the line of the impact. This velocity grows with the width of the crack
    and with the speed.

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
        Velocity in m/s.

    Examples
    --------
    >>> from skarxlag.bearings import SKF_6205
    >>> from skarxlag.datasets.strikes import impact_velocity
    >>> round(impact_velocity(SKF_6205, 500.0, 3.0), 3)
    0.185
    """
    return float(contact_speed(bearing, rpm) * crack_mm / bearing.element_diameter)


def load_distribution_at(
    angle: float | NDArray[Any], load_distribution: float
) -> NDArray[Any]:
    r"""Return the load of an element, relative to the largest load in the bearing.

    The load at the angle :math:`\psi` from the direction of the load follows Stribeck's
    distribution with the load distribution factor :math:`\epsilon` and the exponent 3/2
    of a point contact [1]_:

    .. math:: q(\psi) = \max\left(0,\, 1 - \frac{1 - \cos\psi}{2 \epsilon}\right)^{3/2}.

    Parameters
    ----------
    angle : float or ndarray
        Angle from the direction of the load, in radians.
    load_distribution : float
        The factor :math:`\epsilon`, > 0. The value 0.5 describes a bearing without
        clearance.

    Returns
    -------
    load : ndarray
        Relative load, in [0, 1].

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
    """Return times since the first strike, in mean intervals, that reach at least `expected`."""
    # The margin covers the accumulated slip. Its standard deviation grows with the
    # square root of the number of intervals.
    n_intervals = int(np.ceil(expected + 6 * slip * np.sqrt(expected) + 2))
    return np.concatenate(
        [[0.0], np.cumsum(1 + slip * rng.standard_normal(n_intervals))]
    )


def simulate_strikes(
    rig: Any,
    rpm: float,
    location: str,
    duration: float,
    before: float,
    rng: np.random.Generator,
) -> tuple[NDArray[Any], NDArray[Any]]:
    r"""Simulate the times at which elements enter a defect, and the load at each time.

    The intervals between two entries are :math:`(1 + s\,\xi) / f`, where f is the
    strike rate of the defect, s is the slip, and :math:`\xi` is normal with unit
    variance. The intervals are independent, so their deviations accumulate over time,
    as they do for real rolling elements [1]_. The load zone does not move. A defect of
    the outer ring therefore always carries the largest load. A defect of the inner ring
    passes through the load zone with each revolution of the shaft, and a defect of a
    ball with each revolution of the cage [2]_.

    Parameters
    ----------
    rig : Rig
        The physical parameters, of which the bearing, the slip and the load
        distribution factor are used.
    rpm : float
        Speed of the shaft, in revolutions per minute.
    location : {"outer", "inner", "ball"}
        Location of the defect.
    duration : float
        Duration of the simulation from time 0 on, in seconds.
    before : float
        Duration of the simulation before time 0, in seconds. The strikes from time 0 on
        do not depend on it.
    rng : numpy.random.Generator
        Generator of the random phases and intervals.

    Returns
    -------
    times : ndarray of shape (n_strikes,)
        Times of the entries in seconds, in ascending order.
    load : ndarray of shape (n_strikes,)
        Load at each time relative to the largest load, in [0, 1].

    References
    ----------
    .. [1] J. Antoni, R. B. Randall, "A stochastic model for simulation and diagnostics
           of rolling element bearings with localized faults", J. Vib. Acoust. 125
           (2003).
    .. [2] P. D. McFadden, J. D. Smith, "Model for the vibration produced by a single
           point defect in a rolling element bearing", Journal of Sound and Vibration 96
           (1984).

    Examples
    --------
    >>> import numpy as np
    >>> from skarxlag.datasets.rig import Rig
    >>> from skarxlag.datasets.strikes import simulate_strikes
    >>> times, load = simulate_strikes(Rig(), 300.0, "outer", 10.0, 0.0, np.random.default_rng(0))
    >>> len(times), float(load.min())
    (179, 1.0)
    """
    frequencies = defect_frequencies(rig.bearing, rpm)
    rate = frequencies[location]
    zone_phase, first = rng.uniform(size=2)
    ahead = first + _interval_sums(duration * rate, rig.slip, rng)
    behind = first - 1 - _interval_sums(before * rate, rig.slip, rng)
    times = np.concatenate([behind[::-1], ahead]) / rate
    times = times[(times >= -before) & (times < duration)]
    if location == "outer":
        return times, np.ones(len(times))
    passes = rpm / 60 if location == "inner" else frequencies["cage"]
    angle = zone_phase + passes * times
    return times, load_distribution_at(2 * np.pi * angle, rig.load_distribution)
