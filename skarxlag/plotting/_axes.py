"""Axes, legends and scales of the figures; matplotlib is imported only when a figure is drawn."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D


def new_axes(n_rows: int) -> NDArray[Any]:
    """Create a pyplot figure with axes one above the other.

    Parameters
    ----------
    n_rows : int
        Number of axes.

    Returns
    -------
    ndarray of matplotlib Axes of shape (n_rows,)
        The axes, which share their horizontal axis.

    Raises
    ------
    ImportError
        If matplotlib is not installed.
    """
    try:
        from matplotlib import pyplot
    except ImportError as error:
        raise ImportError("Plotting needs matplotlib: pip install 'skarxlag[plot]'") from error
    _, axes = pyplot.subplots(n_rows, sharex=True, squeeze=False, layout="constrained")
    return axes[:, 0]


def legend_beside(ax: "Axes", lines: "Sequence[Line2D]") -> None:
    """Place the legend of these lines to the right of the axes, so that it covers no data."""
    ax.legend(
        handles=lines, loc="upper left", bbox_to_anchor=(1, 1), fontsize="small", frameon=False
    )


def readable_log_scale(ax: "Axes", values: NDArray[Any]) -> None:
    """Make the vertical axis logarithmic.

    If the largest value is less than 20 times the smallest, the ticks are plain numbers at equal
    steps instead of powers of ten.

    Parameters
    ----------
    ax : matplotlib Axes
        The axes to change.
    values : ndarray
        The values that will be drawn. Zeros are ignored.
    """
    from matplotlib import ticker

    ax.set_yscale("log")
    drawn = values[values > 0]
    if len(drawn) and drawn.max() < 20 * drawn.min():
        ax.yaxis.set_major_locator(ticker.MaxNLocator(8))
        ax.yaxis.set_major_formatter(ticker.FuncFormatter(lambda value, _: f"{value:g}"))
        ax.yaxis.set_minor_locator(ticker.NullLocator())
