"""Plot of the accuracy across shaft speeds."""

from __future__ import annotations

from dataclasses import KW_ONLY, InitVar, dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from ._style import AxesDisplay, condition_styles


@dataclass(repr=False, eq=False)
class SpeedAccuracyDisplay(AxesDisplay):
    """Plot the accuracy against the shaft speed of the test, one line for each training speed.

    Hollow markers are tests at the training speed.

    Parameters
    ----------
    y_true, y_pred : array-like of shape (n_verdicts,)
        True and predicted conditions, for example those of `evaluate`.
    train_rpm, test_rpm : array-like of shape (n_verdicts,), or float
        Calibration speed and test speed of each verdict, in revolutions per minute.
    name : str or None, default=None
        Name of the diagnoser, for the legend.

    Attributes
    ----------
    accuracy : ndarray of shape (n_train, n_test)
        Share of correct verdicts for each pair of speeds; NaN if there is no verdict.
    train_rpm, test_rpm : ndarray of shape (n_train,), and (n_test,)
        The different speeds, ascending.
    lines_ : list of matplotlib Line2D
        One for each training speed.
    ax_, figure_ : matplotlib Axes and Figure
        Axes and figure that hold the plot.

    Examples
    --------
    >>> display = SpeedAccuracyDisplay(
    ...     ["a", "b", "a", "b"], ["a", "b", "a", "a"], train_rpm=300, test_rpm=[300, 300, 500, 500]
    ... )
    >>> display.plot().accuracy
    array([[1. , 0.5]])
    """

    y_true: InitVar[ArrayLike]
    y_pred: InitVar[ArrayLike]
    _: KW_ONLY
    train_rpm: ArrayLike
    test_rpm: ArrayLike
    name: str | None = None

    def __post_init__(self, y_true: ArrayLike, y_pred: ArrayLike) -> None:
        columns = {
            "true": y_true,
            "predicted": y_pred,
            "train_rpm": self.train_rpm,
            "test_rpm": self.test_rpm,
        }
        # The index of a table is not that of another one.
        verdicts = pd.DataFrame(
            {name: np.asarray(values) for name, values in columns.items()}
        )
        is_right = verdicts["true"] == verdicts["predicted"]
        speeds = [verdicts["train_rpm"], verdicts["test_rpm"]]
        table = is_right.groupby(speeds).mean().unstack("test_rpm")
        self.accuracy: NDArray[Any] = table.to_numpy(dtype=float)
        self.train_rpm = table.index.to_numpy()
        self.test_rpm = table.columns.to_numpy()

    def _draw(self, ax):
        prefix = "" if self.name is None else f"{self.name}, "
        self.lines_: list[Any] = []
        # Lines of earlier displays on these axes keep their styles; new lines take the
        # next ones.
        n_before = len(ax.get_legend_handles_labels()[0])
        styles = condition_styles(range(n_before + len(self.train_rpm)))
        hollow = {
            "linestyle": "none",
            "markerfacecolor": ax.get_facecolor(),
            "zorder": 3,
        }
        for row, speed in enumerate(self.train_rpm):
            style = styles[str(n_before + row)]
            accuracy = self.accuracy[row]
            is_tested = np.isfinite(accuracy)
            is_same = is_tested & (self.test_rpm == speed)
            style["label"] = f"{prefix}calibrated at {speed:g} rpm"
            self.lines_ += ax.plot(
                self.test_rpm[is_tested], accuracy[is_tested], **style
            )
            ax.plot(
                self.test_rpm[is_same],
                accuracy[is_same],
                **style | hollow | {"label": None},
            )
        ax.set(
            xlabel="Shaft speed of the test (rpm)", ylabel="Accuracy", ylim=(0, 1.03)
        )
        ax.set_xticks(self.test_rpm)
        ax.grid(alpha=0.3)
        ax.legend()
