"""Where to draw; matplotlib is imported here and only when it is needed."""

from typing import Any

import numpy as np
from numpy.typing import NDArray


def new_axes(n_rows: int) -> NDArray[Any]:
    """Axes of a new pyplot figure, one above the other.

    Parameters
    ----------
    n_rows : int
        How many.

    Returns
    -------
    ndarray of matplotlib Axes of shape (n_rows,)
        They share their horizontal axis.

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
    """Values of a time axis, and its label.

    Parameters
    ----------
    n_samples : int
        Length of the signal.
    sampling_rate : float or None
        In Hz. None: samples are counted.

    Returns
    -------
    ndarray of shape (n_samples,), str
        Milliseconds or samples, from 0.

    Examples
    --------
    >>> time_axis(3, 2000.0)
    (array([0. , 0.5, 1. ]), 'Time (ms)')
    """
    if sampling_rate is None:
        return np.arange(n_samples), "Sample"
    return 1e3 / sampling_rate * np.arange(n_samples), "Time (ms)"


def legend_beside(ax: Any, lines: Any) -> None:
    """Legend of these lines to the right of the axes, where it hides nothing."""
    ax.legend(
        handles=lines, loc="upper left", bbox_to_anchor=(1, 1), fontsize="small", frameon=False
    )


def readable_log_scale(ax: Any, values: NDArray[Any]) -> None:
    """Logarithmic vertical axis; plain numbers at equal steps where the values span little.

    Parameters
    ----------
    ax : matplotlib Axes
        Where.
    values : ndarray
        What will be drawn; zeros do not count.
    """
    from matplotlib import ticker

    ax.set_yscale("log")
    drawn = values[values > 0]
    if len(drawn) and drawn.max() < 20 * drawn.min():
        ax.yaxis.set_major_locator(ticker.MaxNLocator(8))
        ax.yaxis.set_major_formatter(ticker.FuncFormatter(lambda value, _: f"{value:g}"))
        ax.yaxis.set_minor_locator(ticker.NullLocator())
