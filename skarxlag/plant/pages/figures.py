"""Figures of the pages: paths of SVG, with labels that keep their size on narrow screens.

A figure is drawn into a box without a fixed shape. Paths are stretched to the width of
the page; labels are text of the page next to it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...verdicts.names import NO_SIGNAL, NO_VERDICT

#: Units of the paths, across and down.
WIDTH = 1000
HEIGHT = 240
#: Points of a curve across the figure, at most.
COLUMNS = 480
#: Labels on an axis, at least; there are up to 2.5 times as many.
_LEAST_TICKS = 3
#: Part of the range that stays free above and below the values.
_MARGIN = 0.05
#: Values beyond this size are not drawn.
_LARGEST = 1e150
#: A range of less than this share of the largest value is drawn like that of a constant.
_CONSTANT = 1e-9


@dataclass(frozen=True)
class Axis:
    """Axis of a figure.

    Parameters
    ----------
    label : str
        Quantity and unit.
    low, high : float
        Range, with low < high.
    """

    label: str
    low: float
    high: float

    @classmethod
    def around(cls, label: str, *values: NDArray[Any]) -> "Axis":
        """Return an axis that holds all finite values, with a margin."""
        joined = np.concatenate([np.ravel(part) for part in values])
        finite = joined[np.abs(joined) < _LARGEST]
        if len(finite) == 0:
            finite = np.zeros(1)
        low = float(finite.min())
        high = float(finite.max())
        margin = _MARGIN * (high - low)
        if margin <= _CONSTANT * abs(high) or margin == 0:
            margin = abs(high) or 1.0
        return cls(label, low - margin, high + margin)

    def share(self, values: Any) -> NDArray[Any]:
        """Return positions on the axis, from 0 to 1 within the range."""
        return (np.asarray(values, dtype=float) - self.low) / (self.high - self.low)

    @property
    def ticks(self) -> list[tuple[float, str]]:
        """Positions in percent of the axis, and texts.

        >>> Axis("Time (s)", 0.0, 1.0).ticks
        [(0.0, '0'), (20.0, '0.2'), (40.0, '0.4'), (60.0, '0.6'), (80.0, '0.8'), (100.0, '1')]
        """
        widest = (self.high - self.low) / _LEAST_TICKS
        decade = 10.0 ** np.floor(np.log10(widest))
        step = decade * max(factor for factor in (1, 2, 5) if factor * decade <= widest)
        first = np.ceil(self.low / step)
        last = np.floor(self.high / step)
        values = np.arange(first, last + 1) * step
        return self._labelled(values, [f"{value:.6g}" for value in values])

    def _labelled(self, values, texts):
        positions = (100 * self.share(values)).round(2)
        return list(zip(positions.tolist(), texts, strict=True))


@dataclass(frozen=True)
class Mark:
    """Curve or area of a figure.

    Parameters
    ----------
    path : str
        Path of SVG in units of the figure.
    style : str
        CSS class: its colour.
    label : str
        Text in the legend; empty: none.
    is_area : bool, default=False
        Whether the path is filled.
    """

    path: str
    style: str
    label: str
    is_area: bool = False


@dataclass(frozen=True)
class Rule:
    """Vertical lines of a figure.

    Parameters
    ----------
    positions : list of float
        In percent of the x axis.
    style : str
        CSS class: its colour and dashes.
    label : str
        Text above the first line.
    legend : str
        Text in the legend.
    """

    positions: list[float]
    style: str
    label: str
    legend: str


@dataclass(frozen=True)
class Figure:
    """Figure of a page.

    Parameters
    ----------
    title : str
        Caption.
    x, y : Axis
        The axes.
    marks : sequence of Mark
        Curves and areas, the lowest first.
    rules : sequence of Rule, default=()
        Vertical lines.
    note : str, default=""
        Sentences below the figure.
    """

    title: str
    x: Axis
    y: Axis
    marks: Sequence[Mark]
    rules: Sequence[Rule] = ()
    note: str = ""

    @property
    def alternative(self) -> str:
        """Text for those who cannot see the figure."""
        labels = [mark.label for mark in self.marks if mark.label]
        labels += [rule.legend for rule in self.rules]
        axes = f"{self.title}. {self.y.label} over {self.x.label.lower()}"
        return f"{axes}: {', '.join(labels)}." if labels else f"{axes}."


@dataclass(frozen=True)
class Strips:
    """Figure of several strips over one axis: shares over time, as heights.

    Parameters
    ----------
    title : str
        Caption.
    x : Axis
        The common axis.
    strips : sequence of Mark
        From top to bottom.
    """

    title: str
    x: Axis
    strips: Sequence[Mark]

    @property
    def alternative(self) -> str:
        """Text for those who cannot see the figure."""
        return f"{self.title}: {', '.join(strip.label for strip in self.strips)}."


def curve(x: Any, y: Any) -> str:
    """Return the path of a curve.

    Parameters
    ----------
    x, y : array-like of shape (n_points,)
        Positions on the axes, from 0 to 1. The curve is interrupted where one is not
        finite.

    Returns
    -------
    str
        The path.

    Examples
    --------
    >>> curve([0, 0.5, 1], [0, np.nan, 1])
    'M0 240M1000 0'
    """
    points, is_point = _in_units(x, y)
    is_start = is_point & ~np.concatenate([[False], is_point[:-1]])
    signs = np.where(is_start[is_point], "M", "L")
    return "".join(
        f"{sign}{across} {down}"
        for sign, (across, down) in zip(signs, points, strict=True)
    )


def _in_units(x, y):
    """Return the finite points in units of the figure, and which points are finite."""
    points = np.column_stack([np.asarray(x) * WIDTH, (1 - np.asarray(y)) * HEIGHT])
    is_point = np.isfinite(points).all(axis=1)
    # Points far outside would be drawn over other parts of the page.
    limited = np.clip(points[is_point], 0, [WIDTH, HEIGHT]).round().astype(int)
    return limited.tolist(), is_point


def area(x: Any, low: Any, high: Any) -> str:
    """Return the path around the area between two curves.

    Parameters
    ----------
    x, low, high : array-like of shape (n_points,)
        Positions on the axes, from 0 to 1. Points that are not finite are left out.

    Returns
    -------
    str
        The closed path.

    Examples
    --------
    >>> area([0, 1], [0, 0], [0.5, 1])
    'M0 240L1000 240L1000 0L0 120Z'
    """
    points = np.column_stack([x, low, high])
    x, low, high = points[np.isfinite(points).all(axis=1)].T
    around = curve([*x, *x[::-1]], [*low, *high[::-1]])
    return f"{around}Z" if around else ""


def steps(edges: Any, heights: Any) -> str:
    """Return the path around bars that touch each other.

    Parameters
    ----------
    edges : array-like of shape (n_bars + 1,)
        Borders of the bars, from 0 to 1.
    heights : array-like of shape (n_bars,)
        From 0 to 1.

    Returns
    -------
    str
        The closed path.

    Examples
    --------
    >>> steps([0, 0.5, 1], [1, 0])
    'M0 240L500 240L500 240L1000 240L1000 240L500 240L500 0L0 0Z'
    """
    x = np.repeat(edges, 2)[1:-1]
    return area(x, np.zeros(len(x)), np.repeat(heights, 2))


def verdict_strips(
    rows: pd.DataFrame,
    healthy: str,
    part: NDArray[np.int_],
    n_parts: int,
    noun: str,
    alarm: str,
) -> list[Mark]:
    """Return a strip for each verdict, and for the alarm if there is one.

    Their heights are the shares of rows in equal parts of an axis.

    Parameters
    ----------
    rows : DataFrame
        Columns ``verdict``, whose reason after a colon does not count, and ``alarm``
        with 1, 0 or NaN.
    healthy : str
        The healthy condition.
    part : ndarray of int of shape (n_rows,)
        Part of each row.
    n_parts : int
        Number of parts.
    noun : str
        What a row is; empty: not stated.
    alarm : str
        Label of the alarm.

    Returns
    -------
    list of Mark
        Faults first, then the healthy condition, then windows without a verdict. Parts
        without rows have the height 0.

    Examples
    --------
    >>> rows = pd.DataFrame({"verdict": ["good", "worn", "good"], "alarm": [0, 1, 0]})
    >>> marks = verdict_strips(rows, "good", np.array([0, 0, 1]), 2, "rows", "alarm")
    >>> for mark in marks:
    ...     print(mark.label, mark.path)
    worn: 1 of 3 rows M0 240L500 240L500 240L1000 240L1000 240L500 240L500 120L0 120Z
    good: 2 of 3 rows M0 240L500 240L500 240L1000 240L1000 0L500 0L500 120L0 120Z
    alarm: 1 of 3 rows M0 240L500 240L500 240L1000 240L1000 240L500 240L500 120L0 120Z
    """
    names = rows["verdict"].astype(str).str.partition(":")[0]
    verdicts = [
        (verdict_style(name, healthy), name, names == name)
        for name in names.value_counts().index
    ]
    # Styles are in the order of the strips, and so is the number of rows.
    facts = sorted(verdicts, key=itemgetter(0))
    if rows["alarm"].notna().any():
        facts.append(("fault", alarm, rows["alarm"] == 1))
    edges = np.linspace(0, 1, n_parts + 1)
    strips = []
    for style, name, holds in facts:
        shares = holds.groupby(part).mean().reindex(range(n_parts), fill_value=0.0)
        label = f"{name}: {holds.sum()} of {len(rows)} {noun}".rstrip()
        strips.append(Mark(steps(edges, shares), style, label, is_area=True))
    return strips


def verdict_style(verdict: str, healthy: str) -> str:
    """Return the style of a verdict: that of a fault, of healthy, or of no verdict.

    Examples
    --------
    >>> verdict_style("inner race", "normal"), verdict_style("no signal", "normal")
    ('fault', 'unclear')
    """
    if verdict == healthy:
        return "healthy"
    return "unclear" if verdict in (NO_SIGNAL, NO_VERDICT) else "fault"


def extremes(
    low: NDArray[Any], high: NDArray[Any], most: int = COLUMNS
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Reduce two series to the smallest and the largest values of equal parts.

    Parameters
    ----------
    low, high : ndarray of shape (n_values,)
        Series; the same one twice if there is only one.
    most : int, default=480
        Parts, at most.

    Returns
    -------
    low, high : ndarray of shape (n_parts,)
        NaN counts only if a part has no other value.

    Examples
    --------
    >>> values = np.array([1.0, 4.0, np.nan, 2.0])
    >>> extremes(values, values, 2)
    (array([1., 2.]), array([4., 2.]))
    """
    edges = np.linspace(0, len(low), min(most, len(low)), endpoint=False).astype(int)
    return np.fmin.reduceat(low, edges), np.fmax.reduceat(high, edges)
