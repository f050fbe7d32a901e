"""Kinematics of a rolling-element bearing: from its geometry to its defect frequencies."""

from dataclasses import dataclass
from numbers import Integral, Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "SKF_6205",
    "BearingGeometry",
    "contact_speed",
    "defect_frequencies",
    "fault_orders",
    "strike_rate",
]

METRES_PER_MM = 1e-3
#: Multiples of the order of each fault that figures mark. Repeated strikes of a fault show at
#: multiples of its order; those of the rings are the strongest.
_MULTIPLES = {"shaft": 1, "cage": 1, "outer": 3, "inner": 3, "ball": 2}


@dataclass(frozen=True)
class BearingGeometry:
    """Dimensions of a rolling-element bearing whose outer ring stands still.

    Parameters
    ----------
    n_elements : int
        Number of balls or rollers, at least 2.
    element_diameter : float
        Diameter of a ball or roller, in mm.
    pitch_diameter : float
        Diameter of the circle of the elements' centres, in mm; larger than
        `element_diameter`.
    contact_angle : float, default=0.0
        Contact angle in degrees, in [0, 90).

    Raises
    ------
    ValueError
        If a dimension is out of range.

    Examples
    --------
    >>> from skarxlag.bearings import BearingGeometry, defect_frequencies
    >>> bearing = BearingGeometry(n_elements=8, element_diameter=10.0, pitch_diameter=40.0)
    >>> float(defect_frequencies(bearing, 600)["outer"])
    30.0
    """

    n_elements: int
    element_diameter: float
    pitch_diameter: float
    contact_angle: float = 0.0

    def __post_init__(self) -> None:
        if not isinstance(self.n_elements, Integral) or self.n_elements < 2:
            raise ValueError(f"n_elements must be an integer of at least 2, got {self.n_elements}.")
        for name in ("element_diameter", "pitch_diameter", "contact_angle"):
            value = getattr(self, name)
            if not isinstance(value, Real) or not np.isfinite(value):
                raise ValueError(f"{name} must be a finite number, got {value!r}.")
        if not 0 < self.element_diameter < self.pitch_diameter:
            raise ValueError(
                "element_diameter must lie between 0 and pitch_diameter="
                f"{self.pitch_diameter}, got {self.element_diameter}."
            )
        if not 0 <= self.contact_angle < 90:
            raise ValueError(f"contact_angle must be in [0, 90) degrees, got {self.contact_angle}.")


# Drive-end bearing of the Case Western Reserve University bearing data centre, whose
# published dimensions are 9 balls of 0.3126 in on a pitch diameter of 1.537 in.
SKF_6205 = BearingGeometry(n_elements=9, element_diameter=7.940, pitch_diameter=39.04)


def _diameter_ratio(bearing):
    return (
        bearing.element_diameter
        * np.cos(np.deg2rad(bearing.contact_angle))
        / bearing.pitch_diameter
    )


def defect_frequencies(bearing: BearingGeometry, rpm: float | NDArray[Any]) -> dict[str, Any]:
    r"""Characteristic frequencies of a bearing with a stationary outer ring.

    With the shaft rate :math:`f_r`, n elements of diameter d on the pitch diameter
    D and :math:`\gamma = (d / D) \cos\alpha`, pure rolling gives [1]_

    .. math::

        f_{cage} = \frac{f_r}{2}(1 - \gamma), \quad
        f_{outer} = n f_{cage}, \quad
        f_{inner} = \frac{n f_r}{2}(1 + \gamma), \quad
        f_{spin} = \frac{f_r D}{2 d}(1 - \gamma^2).

    Parameters
    ----------
    bearing : BearingGeometry
        The bearing.
    rpm : float or ndarray
        Speed of the shaft, in revolutions per minute.

    Returns
    -------
    frequencies : dict
        "cage" (FTF), "outer" (BPFO), "inner" (BPFI) and "spin" (BSF), each in Hz and of
        the shape of `rpm`.

    References
    ----------
    .. [1] R. B. Randall, J. Antoni, "Rolling element bearing diagnostics - a tutorial",
       Mechanical Systems and Signal Processing 25 (2011), Eqs. 1-4.

    Examples
    --------
    >>> from skarxlag.bearings import SKF_6205, defect_frequencies
    >>> frequencies = defect_frequencies(SKF_6205, 60.0)
    >>> {name: round(float(value), 4) for name, value in frequencies.items()}
    {'cage': 0.3983, 'outer': 3.5848, 'inner': 5.4152, 'spin': 2.3567}
    """
    rate, ratio = rpm / 60, _diameter_ratio(bearing)
    cage = rate / 2 * (1 - ratio)
    return {
        "cage": cage,
        "outer": bearing.n_elements * cage,
        "inner": bearing.n_elements * rate / 2 * (1 + ratio),
        "spin": rate * bearing.pitch_diameter / (2 * bearing.element_diameter) * (1 - ratio**2),
    }


def fault_orders(bearing: BearingGeometry) -> dict[str, float]:
    r"""Orders of the shaft at which faults of a bearing show in the spectrum of the envelope.

    An order is a frequency divided by that of the shaft, so these numbers hold at every speed. They
    are those of :func:`defect_frequencies` with :math:`f_r = 1`. Slip of the rolling elements moves
    the orders of real bearings by 1 to 2 % [1]_.

    Parameters
    ----------
    bearing : BearingGeometry
        The bearing.

    Returns
    -------
    dict of str to float
        "shaft", which is 1; "cage" (FTF); "outer" (BPFO) and "inner" (BPFI), the orders at which a
        fault of a ring is struck; "spin" (BSF), the turns of an element about its own axis; and
        "ball", which is twice that, since a fault of an element strikes both rings in each turn.

    References
    ----------
    .. [1] R. B. Randall, J. Antoni, "Rolling element bearing diagnostics - a tutorial",
       Mechanical Systems and Signal Processing 25 (2011), Eqs. 1-4.

    Examples
    --------
    >>> from skarxlag import BearingGeometry, fault_orders
    >>> bearing = BearingGeometry(n_elements=9, element_diameter=7.94, pitch_diameter=39.04)
    >>> {name: round(order, 4) for name, order in fault_orders(bearing).items()}
    {'shaft': 1.0, 'cage': 0.3983, 'outer': 3.5848, 'inner': 5.4152, 'spin': 2.3567, 'ball': 4.7135}
    """
    orders = {name: float(order) for name, order in defect_frequencies(bearing, 60.0).items()}
    return {"shaft": 1.0, **orders, "ball": 2 * orders["spin"]}


def fault_lines(orders: dict[str, float], highest: float) -> list[tuple[str, int, float]]:
    """Lines that mark faults in an order spectrum: the first multiples of the order of each.

    Parameters
    ----------
    orders : dict of str to float
        Orders of the faults, as `fault_orders` gives them. Faults may be missing.
    highest : float
        Highest order of the spectrum.

    Returns
    -------
    list of (str, int, float)
        Fault, multiple and order of each line.

    Examples
    --------
    >>> fault_lines({"shaft": 1.0, "outer": 3.5, "ball": 4.75}, highest=8.0)
    [('shaft', 1, 1.0), ('outer', 1, 3.5), ('outer', 2, 7.0), ('ball', 1, 4.75)]
    """
    return [
        (fault, multiple, orders[fault] * multiple)
        for fault, most in _MULTIPLES.items()
        for multiple in range(1, most + 1)
        if fault in orders and orders[fault] * multiple <= highest
    ]


def strike_rate(
    bearing: BearingGeometry, rpm: float | NDArray[Any], location: str
) -> float | NDArray[Any]:
    """Strikes a second of a defect at one location.

    A defect of a ring is struck by every element that passes. A defect of an element
    strikes both rings in each turn of the element, so twice the spin frequency.

    Parameters
    ----------
    bearing : BearingGeometry
        The bearing.
    rpm : float or ndarray
        Speed of the shaft, in revolutions per minute.
    location : {"outer", "inner", "ball"}
        Where the defect is.

    Returns
    -------
    rate : float or ndarray
        Mean strike rate in Hz.

    Examples
    --------
    >>> from skarxlag.bearings import SKF_6205, strike_rate
    >>> round(float(strike_rate(SKF_6205, 300.0, "ball")), 2)
    23.57
    """
    frequencies = defect_frequencies(bearing, rpm)
    return 2 * frequencies["spin"] if location == "ball" else frequencies[location]


def contact_speed(bearing: BearingGeometry, rpm: float | NDArray[Any]) -> float | NDArray[Any]:
    r"""Speed at which the contact point runs along a surface.

    In pure rolling it is the same along both rings and around the element,
    :math:`v = \pi f_r (D / 2) (1 - \gamma^2)` in the symbols of
    :func:`defect_frequencies`.

    Parameters
    ----------
    bearing : BearingGeometry
        The bearing.
    rpm : float or ndarray
        Speed of the shaft, in revolutions per minute.

    Returns
    -------
    speed : float or ndarray
        Speed of the contact, in m/s.

    Examples
    --------
    >>> from skarxlag.bearings import SKF_6205, contact_speed
    >>> round(float(contact_speed(SKF_6205, 300.0)), 4)
    0.2939
    """
    ratio = _diameter_ratio(bearing)
    radius = bearing.pitch_diameter / 2 * METRES_PER_MM
    return np.pi * rpm / 60 * radius * (1 - ratio**2)
