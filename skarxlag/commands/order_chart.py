"""Chart of the report as SVG text: order spectra over references, with the orders of faults."""

from html import escape
from typing import Any

import numpy as np

from ..bearings import fault_lines
from .html_charts import LEFT, WIDTH, svg

_PANEL, _GAP, _TOP = 104, 22, 16
#: Height at the top of a panel for the names of faults.
_NAMES = 34
#: Orders from one tick to the next.
_TICK = 2
_DASHES = ("none", "1 2", "4 2", "2 2", "6 2 1 2")


def order_chart(view: dict[str, Any], class_of: dict[str, str], faults: dict[str, float]) -> str:
    """Order spectrum of a stretch over the reference of each of two conditions.

    Parameters
    ----------
    view : dict
        As `OrderView.drawn` gives it.
    class_of : dict of str to str
        Class of each condition.
    faults : dict of str to float
        Orders of the bearing's faults, as `fault_orders` gives them; empty where they are not
        known.

    Returns
    -------
    str
        An svg element with a panel for each condition.
    """
    highest = view["orders"][-1]

    def place(order):
        return LEFT + np.array(order) / highest * (WIDTH - LEFT)

    both = [
        each[kind] for each in view["conditions"].values() for kind in ("spectrum", "reference")
    ]
    low, high = np.floor(np.min(both) / 5) * 5, np.ceil(np.max(both) / 5) * 5
    parts, top, free = [], _TOP, _NAMES if faults else 0
    for name, each in view["conditions"].items():
        bottom = top + free + _PANEL
        title = f"{name}: {found_speed(each['factor'], view['rpm'])}"
        parts.append(f'<text x="{LEFT}" y="{top - 5}">{escape(title)}</text>')
        parts += _fault_marks(fault_lines(faults, highest), place, top, bottom)
        for kind, style in (
            ("reference", f'class="{class_of[name]}" stroke-width="2.5"'),
            ("spectrum", 'class="ink" stroke-width="1.2"'),
        ):
            y = bottom - _PANEL * (np.array(each[kind]) - low) / max(high - low, 1)
            points = " ".join(
                f"{a:.1f},{b:.1f}" for a, b in zip(place(view["orders"]), y, strict=True)
            )
            parts.append(f'<polyline points="{points}" {style}/>')
        parts.append(
            f'<path d="M{LEFT} {top}V{bottom}H{WIDTH}" class="axis"/>'
            f'<text x="{LEFT - 6}" y="{top + free + 8}" text-anchor="end">{high:g} dB</text>'
            f'<text x="{LEFT - 6}" y="{bottom}" text-anchor="end">{low:g} dB</text>'
        )
        top = bottom + _GAP
    bottom = top - _GAP
    for order in np.arange(0, highest - _TICK, _TICK):
        parts.append(
            f'<text x="{place(order):.1f}" y="{bottom + 13}" text-anchor="middle">{order:g}</text>'
        )
    parts.append(f'<text x="{WIDTH}" y="{bottom + 13}" text-anchor="end">order {highest:g}</text>')
    return svg("Order spectrum of a stretch", bottom + 20, "".join(parts))


def found_speed(factor: float, rpm: float | None) -> str:
    """Say which speed was found.

    Parameters
    ----------
    factor : float
        On the nominal speed, or on that of the training.
    rpm : float or None
        Nominal speed; None if it is not known.

    Returns
    -------
    str
        In words.

    Examples
    --------
    >>> found_speed(1.02, 600.0)
    '612 rpm found at nominal 600 rpm (factor 1.02)'
    >>> found_speed(0.8, None)
    'speed 0.80 times that of the training'
    """
    if rpm is None:
        return f"speed {factor:.2f} times that of the training"
    return f"{rpm * factor:.4g} rpm found at nominal {rpm:g} rpm (factor {factor:.2f})"


def _fault_marks(lines, place, top, bottom):
    """A line for each multiple of each fault, with the fault's name at the first."""
    dash_of = dict(zip(dict.fromkeys(fault for fault, _, _ in lines), _DASHES, strict=False))
    for fault, multiple, order in lines:
        x = place(order)
        yield (
            f'<path d="M{x:.1f} {top}V{bottom}" class="soft" stroke-width=".8" '
            f'stroke-dasharray="{dash_of[fault]}"/>'
        )
        if multiple == 1:
            yield (
                f'<text transform="translate({x - 2:.1f} {top + 2}) rotate(-90)" '
                f'text-anchor="end">{escape(fault)}</text>'
            )
