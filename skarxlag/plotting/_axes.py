"""Axes, legends and scales of the figures; matplotlib is imported only when a figure is drawn."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
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


def time_axis(n_samples: int, sampling_rate: float | None) -> tuple[NDArray[Any], str]:
    """Compute the values and the label of a time axis.

    Parameters
    ----------
    n_samples : int
        Length of the signal.
    sampling_rate : float or None
        Sampling rate in Hz. If None, the axis counts samples.

    Returns
    -------
    ndarray of shape (n_samples,), str
        Time in milliseconds, or sample number, starting from 0; and the label of the axis.

    Examples
    --------
    >>> time_axis(3, 2000.0)
    (array([0. , 0.5, 1. ]), 'Time (ms)')
    """
    if sampling_rate is None:
        return np.arange(n_samples), "Sample"
    return 1e3 / sampling_rate * np.arange(n_samples), "Time (ms)"


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
