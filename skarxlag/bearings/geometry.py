"""Kinematics of a rolling-element bearing: from its geometry to its defect frequencies."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.state import expect
from ..core.validation import ABOVE_0, check_count, check_real
from .designations import catalogue_name

METRES_PER_MM = 1e-3


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
    TypeError, ValueError
        If a dimension is no number, or out of range.

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
        check_count(self.n_elements, "n_elements", 2)
        check_real(self.pitch_diameter, "pitch_diameter", **ABOVE_0)
        check_real(
            self.element_diameter,
            "element_diameter",
            **ABOVE_0 | {"max_val": self.pitch_diameter},
        )
        right_angle = {"min_val": 0, "max_val": 90, "include_boundaries": "left"}
        check_real(self.contact_angle, "contact_angle", **right_angle)

    @property
    def diameter_ratio(self) -> float:
        r"""The ratio :math:`\gamma` of `defect_frequencies`."""
        cosine = np.cos(np.deg2rad(self.contact_angle))
        return self.element_diameter * cosine / self.pitch_diameter


#: Forms in which a bearing is given, see `bearing_orders`.
BearingLike = str | BearingGeometry | Mapping[str, float]

# Drive-end bearing of the Case Western Reserve University bearing data centre, whose
# published dimensions are 9 balls of 0.3126 in on a pitch diameter of 1.537 in.
SKF_6205 = BearingGeometry(n_elements=9, element_diameter=7.940, pitch_diameter=39.04)


def _catalogue():
    """Read the bearings of the catalogue and their types, by name."""
    path = Path(__file__).with_name("catalogue.csv")
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    bearings = {row["name"]: _of_row(row) for row in rows}
    return bearings, {row["name"]: row["type"] for row in rows}


def _of_row(row):
    if row["element_diameter"]:
        dimensions = (
            row["element_diameter"],
            row["pitch_diameter"],
            row["contact_angle"],
        )
        return BearingGeometry(int(row["elements"]), *map(float, dimensions))
    return {name: float(row[name]) for name in _SHEET_ORDERS if row[name]}


#: Orders that a row of the catalogue may hold, of a bearing whose dimensions are not
#: published.
_SHEET_ORDERS = "outer", "inner", "spin", "cage"
#: Bearings by name, upper case without spaces and hyphens: dimensions, or orders. The
#: file `catalogue.csv` in this folder holds the source of each. Another maker's bearing
#: of the same name may have other rolling elements, and orders that differ by 1 to 2 %.
BEARINGS: dict[str, BearingGeometry | dict[str, float]]
BEARINGS, _TYPES = _catalogue()
#: Names of orders in a maker's sheet.
_SHEET = {"bpfo": "outer", "bpfi": "inner", "ftf": "cage", "twice spin": "ball"}


def defect_frequencies(
    bearing: BearingGeometry, rpm: float | NDArray[Any]
) -> dict[str, Any]:
    r"""Compute the frequencies at which defects of a bearing cause impacts.

    With the shaft rate :math:`f_r`, n elements of diameter d on the pitch diameter D,
    :math:`\gamma = (d / D) \cos\alpha` and an outer ring that stands still, pure
    rolling gives [1]_

    .. math::

        f_{cage} = \frac{f_r}{2}(1 - \gamma), \quad
        f_{outer} = n f_{cage}, \quad
        f_{inner} = \frac{n f_r}{2}(1 + \gamma), \quad
        f_{spin} = \frac{f_r D}{2 d}(1 - \gamma^2), \quad
        f_{ball} = 2 f_{spin}.

    Every element that passes hits a defect of a ring. A defect of an element hits both
    rings in each revolution of the element.

    Parameters
    ----------
    bearing : BearingGeometry
        The bearing.
    rpm : float or ndarray
        Speed of the shaft, in revolutions per minute.

    Returns
    -------
    dict of str to float or ndarray
        "cage" (FTF), "outer" (BPFO), "inner" (BPFI), "spin" (BSF) and "ball" (2 BSF),
        each in Hz and of the shape of `rpm`.

    See Also
    --------
    bearing_orders : Return these frequencies as multiples of the shaft rate.

    References
    ----------
    .. [1] R. B. Randall, J. Antoni, "Rolling element bearing diagnostics - a tutorial",
           Mechanical Systems and Signal Processing 25 (2011), Eqs. 1-4.

    Examples
    --------
    >>> from skarxlag.bearings import SKF_6205, defect_frequencies
    >>> frequencies = defect_frequencies(SKF_6205, 60.0)
    >>> {name: round(float(value), 4) for name, value in frequencies.items()}
    {'cage': 0.3983, 'outer': 3.5848, 'inner': 5.4152, 'spin': 2.3567, 'ball': 4.7135}
    """
    rate = rpm / 60
    ratio = bearing.diameter_ratio
    cage = rate / 2 * (1 - ratio)
    spin = (
        rate * bearing.pitch_diameter / (2 * bearing.element_diameter) * (1 - ratio**2)
    )
    return {
        "cage": cage,
        "outer": bearing.n_elements * cage,
        "inner": bearing.n_elements * rate / 2 * (1 + ratio),
        "spin": spin,
        "ball": 2 * spin,
    }


def bearing_orders(bearing: BearingLike, gear_ratio: float = 1.0) -> dict[str, float]:
    r"""Return the orders of the shaft at which faults of a bearing show in an envelope spectrum.

    An order is a frequency divided by that of the shaft, so these numbers hold at every
    speed. They are those of :func:`~skarxlag.bearings.defect_frequencies` with
    :math:`f_r = 1`. Slip of the rolling elements moves the orders of real bearings by 1
    to 2 %.

    Parameters
    ----------
    bearing : BearingLike
        A name in `skarxlag.bearings.BEARINGS`, such as "6205" or "ER-12K",
        also with its maker and the usual suffixes, such as "SKF 6205-2RS1/C3";
        dimensions; or orders: "outer" and "inner" (or "BPFO" and "BPFI") are needed.
        "spin" (or "twice spin") and "cage" (or "FTF") follow from them if they are
        missing. A text may also hold dimensions, as in "9,7.94,39.04", or orders, as in
        "outer=3.585,inner=5.415".
    gear_ratio : float, default=1.0
        Revolutions of the bearing's shaft for each revolution of the shaft whose speed
        is given, above 0.

    Returns
    -------
    dict of str to float
        "shaft"; "cage" (FTF); "outer" (BPFO) and "inner" (BPFI), the orders at which
        elements hit a fault of a ring; "spin" (BSF), the revolutions of an element
        about its axis; and "ball" (2 BSF), the order of impacts of a fault of an
        element. All are multiplied by the gear ratio.

    Raises
    ------
    TypeError
        If `bearing` is of another type.
    ValueError
        If the name or a suffix is not known, or a number is out of its range.

    Examples
    --------
    >>> from skarxlag import BearingGeometry, bearing_orders
    >>> bearing = BearingGeometry(n_elements=9, element_diameter=7.94, pitch_diameter=39.04)
    >>> {name: round(order, 4) for name, order in bearing_orders(bearing).items()}
    {'shaft': 1.0, 'cage': 0.3983, 'outer': 3.5848, 'inner': 5.4152, 'spin': 2.3567, 'ball': 4.7135}
    >>> orders = bearing_orders({"BPFO": 3.585, "BPFI": 5.415})
    >>> round(orders["cage"], 3), round(orders["spin"], 3)
    (0.398, 2.357)
    >>> round(bearing_orders("6205", gear_ratio=2)["outer"], 2)
    7.17
    """
    if isinstance(bearing, str):
        bearing = _parsed(bearing)
    if isinstance(bearing, BearingGeometry):
        orders = {"shaft": 1.0, **defect_frequencies(bearing, 60.0)}
    elif isinstance(bearing, Mapping):
        orders = _from_sheet(bearing)
    else:
        raise TypeError(
            f"bearing must be a name, a BearingGeometry or orders by name, got {bearing!r}."
        )
    return {name: float(order * gear_ratio) for name, order in orders.items()}


def _parsed(text):
    """Return the bearing that a text states: a name, dimensions, or orders."""
    try:
        if "=" in text:
            pairs = [part.split("=") for part in text.split(",")]
            return {key.strip(): float(value) for key, value in pairs}
        if "," in text:
            return _of_dimensions(text.split(","))
    except (ValueError, TypeError) as error:
        raise _unknown(text, f" ({error})") from error
    name = catalogue_name(text, _TYPES)
    if name is None:
        raise _unknown(text, _similar_names(text))
    return BEARINGS[name]


def _of_dimensions(numbers):
    count, *dimensions = numbers
    if not 2 <= len(dimensions) <= 3:
        raise ValueError(f"{len(numbers)} numbers")
    return BearingGeometry(int(count), *map(float, dimensions))


def _similar_names(text):
    """Name the bearings of the catalogue that have the same last three digits."""
    digits = re.search(r"\d{3,}", text)
    similar = [name for name in BEARINGS if digits and digits[0][-3:] in name]
    return f" (of the same size: {', '.join(similar)})" if similar else ""


def _unknown(text, reason):
    return ValueError(
        f"bearing {text!r} is not known{reason}; expected one of {', '.join(BEARINGS)}, "
        "ELEMENTS,ELEMENT_DIAMETER,PITCH_DIAMETER[,CONTACT_ANGLE] such as 9,7.94,39.04, or "
        "orders such as outer=3.585,inner=5.415."
    )


def _from_sheet(sheet):
    """Complete the orders of a maker's sheet by the kinematics."""
    given = {}
    for name, value in sheet.items():
        key = name.lower().replace("_", " ")
        key = _SHEET.get(key, key)
        is_order = key in ("outer", "inner", "spin", "ball", "cage", "shaft")
        expected = (
            "outer (BPFO), inner (BPFI), cage (FTF), and spin or twice_spin, either of "
            "which is BSF in some sheets"
        )
        expect(is_order, "Order", name, expected)
        check_real(value, f"order {name!r}", **ABOVE_0)
        given[key] = float(value)
    has_both = given.keys() >= {"outer", "inner"}
    expected = "at least outer (BPFO) and inner (BPFI)"
    expect(has_both, "Orders", sorted(sheet), expected)
    outer = given["outer"]
    inner = given["inner"]
    expected = f"above {outer:g}, the order of the outer race, because the outer ring stands still"
    expect(inner > outer, "inner", inner, expected)
    ratio = (inner - outer) / (inner + outer)
    spin = given.get("spin", given.get("ball", (1 - ratio**2) / ratio) / 2)
    return {
        "shaft": 1.0,
        "cage": given.get("cage", outer / (outer + inner)),
        "outer": outer,
        "inner": inner,
        "spin": spin,
        "ball": 2 * spin,
    }


def contact_speed(
    bearing: BearingGeometry, rpm: float | NDArray[Any]
) -> float | NDArray[Any]:
    r"""Compute the speed at which the contact point runs along a surface.

    In pure rolling this speed is the same along both rings and around the element,
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
    radius = bearing.pitch_diameter / 2 * METRES_PER_MM
    return np.pi * rpm / 60 * radius * (1 - bearing.diameter_ratio**2)


def bearing_list(bearing: BearingLike | Sequence[BearingLike]) -> list[BearingLike]:
    """Return all bearings, also if one is given without a sequence around it."""
    if isinstance(bearing, str | Mapping) or not isinstance(bearing, Sequence):
        return [bearing]
    expect(len(bearing) > 0, "bearing", bearing, "at least one bearing")
    return list(bearing)
