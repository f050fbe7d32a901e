"""Style of the figures: new axes, legends, and the colours and markers of the conditions.

matplotlib is imported only when a figure is drawn.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes as Axes
else:
    Axes = Any

#: Grey with similar contrast to white and to a dark page, for elements that are not a
#: condition.
NEUTRAL = "#7a7a7a"

#: Colours of the conditions. Each has a contrast of at least 3 with white and with a
#: dark page. They differ from each other and from `NEUTRAL` in normal, deuteranopic and
#: protanopic vision. A random search that maximised the smallest distance between two
#: colours found them. The tests check these properties.
PALETTE = (
    "#2aa564",
    "#6982ff",
    "#cb7207",
    "#960efc",
    "#c82b31",
    "#f839bd",
    "#336d8e",
    "#b304c0",
)
_INKS = (
    "text.color",
    "axes.edgecolor",
    "axes.labelcolor",
    "xtick.color",
    "ytick.color",
)
_PAPERS = ("figure.facecolor", "axes.facecolor", "savefig.facecolor")
#: matplotlib settings for images without a background, readable on a white and on a
#: dark page.
ANY_PAGE = dict.fromkeys(_INKS, NEUTRAL) | dict.fromkeys(_PAPERS, "none")
#: Line styles that can be distinguished without colour.
LINE_STYLES = (
    "-",
    "--",
    "-.",
    ":",
    (0, (6, 1, 1, 1, 1, 1)),
    (0, (3, 1)),
    (0, (8, 3)),
    (0, (1, 1)),
)
#: Properties of a condition that a line without markers has.
LINE = ("color", "linestyle")
LEGEND = {"fontsize": "small", "frameon": False}
MARKERS = ("o", "s", "^", "d", "v", "P", "X", "<")


def condition_styles(conditions: Sequence[Any]) -> dict[str, Any]:
    """Assign a colour, a line style and a marker to each condition, by its position.

    Parameters
    ----------
    conditions : sequence of label
        Conditions in the order of the rig's ``target_names``, the healthy one first.
        From the ninth condition on, the colours repeat with another line style and
        marker.

    Returns
    -------
    dict of str to dict of str to object
        The properties ``color``, ``linestyle`` and ``marker`` of each condition, with
        the names and values that matplotlib uses.

    Examples
    --------
    >>> styles = condition_styles(["Normal", "Ball"])
    >>> styles["Normal"]["marker"], styles["Ball"]["marker"]
    ('o', 's')
    """
    styles = {}
    for position, name in enumerate(conditions):
        n_repeats, colour = divmod(position, len(PALETTE))
        shape = (colour + n_repeats) % len(LINE_STYLES)
        styles[str(name)] = {
            "color": PALETTE[colour],
            "linestyle": LINE_STYLES[shape],
            "marker": MARKERS[shape],
        }
    return styles


def color_of(condition: Any, conditions: Sequence[Any], other: str = NEUTRAL) -> str:
    """Return the colour of a condition, or another colour if the condition is None."""
    if condition is None:
        return other
    return condition_styles(conditions)[str(condition)]["color"]


def ink() -> str:
    """Return the text colour of the current style, for lines that belong to no condition."""
    from matplotlib import rcParams

    return rcParams["text.color"]


class Display:
    """Base of the displays: a figure with one or more axes one above the other."""

    def _set_axes(self, axes: Any, n_rows: int = 1) -> NDArray[Any]:
        """Use these axes, or those of a new pyplot figure if None, and return them."""
        if axes is None:
            try:
                from matplotlib import pyplot
            except ImportError as error:
                fix = "pip install 'skarxlag[plot]'"
                raise ImportError(f"Plotting needs matplotlib: {fix}") from error
            _, axes = pyplot.subplots(
                n_rows, sharex=True, squeeze=False, layout="constrained"
            )
        self.axes_: NDArray[Any] = np.asarray(axes, dtype=object).reshape(n_rows)
        self.ax_: Any = self.axes_[0]
        self.figure_: Any = self.ax_.figure
        return self.axes_


class AxesDisplay(Display):
    """Base of the displays that fill one axes. A subclass draws into it in `_draw`."""

    def plot(self, ax: Axes | None = None) -> Self:
        """Draw the plot.

        Parameters
        ----------
        ax : matplotlib Axes or None, default=None
            Axes to plot into. If None, new axes are created.

        Returns
        -------
        display
            The display, after drawing.
        """
        self._set_axes(ax)
        self._draw(self.ax_)
        return self


def legend_beside(ax: Axes, lines: Sequence[Any]) -> None:
    """Place the legend of these lines to the right of the axes, so that it covers no data."""
    ax.legend(handles=lines, loc="upper left", bbox_to_anchor=(1, 1), **LEGEND)
