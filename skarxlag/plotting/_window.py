"""Displays of one window: their data, colour and axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass, field
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ._axes import new_axes
from ._fitted import ordered_conditions
from ._style import NEUTRAL, condition_styles


@dataclass(repr=False, eq=False)
class WindowDisplay:
    """Display of one window that one model describes."""

    _: KW_ONLY
    model: str | None = None
    condition: str | None = None
    conditions: list[str] | None = None

    @classmethod
    def _of(cls, *data: Any, known: Sequence[Any] = (), conditions: Any, **labels: Any) -> Self:
        """Create a display with labels as text, and with the conditions in order."""
        known = [*known, labels["condition"]]
        for name in ("model", "condition"):
            labels[name] = None if labels[name] is None else str(labels[name])
        return cls(*data, **labels, conditions=ordered_conditions(known, conditions))

    def _color(self, other: str = NEUTRAL) -> str:
        """Return the colour of the window's condition, or another one if it has none."""
        styles = condition_styles(self.conditions or [])
        return styles[self.condition]["color"] if self.condition in styles else other

    def _of_model(self, text: str) -> str:
        return text if self.model is None else f"{text}, model of {self.model}"


@dataclass(repr=False, eq=False)
class TwoPanelDisplay(WindowDisplay):
    """Display of a window over time in two panels, the upper one with a legend."""

    _: KW_ONLY
    sampling_rate: float | None = None
    axes_: NDArray[Any] = field(init=False)
    figure_: Any = field(init=False)

    def _panels(self, axes: Any, n_samples: int) -> tuple[Any, Any, Any]:
        """Return the time and the two axes."""
        self.axes_ = new_axes(2) if axes is None else np.asarray(axes, dtype=object)
        self.figure_ = self.axes_[0].figure
        time = np.arange(n_samples)
        if self.sampling_rate is not None:
            time = 1e3 / self.sampling_rate * time
        label = "Sample" if self.sampling_rate is None else "Time (ms)"
        self.axes_[1].set(xlabel=label, xlim=(time[0], time[-1]))
        return time, self.axes_[0], self.axes_[1]


def legend_above(ax: Any) -> None:
    """Place the legend above the axes, in two columns."""
    style = {"ncols": 2, "fontsize": "small", "frameon": False, "borderaxespad": 0.2}
    ax.legend(loc="lower left", bbox_to_anchor=(0, 1), **style)
