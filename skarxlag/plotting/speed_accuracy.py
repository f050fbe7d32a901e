"""Plot of the accuracy across shaft speeds."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field
from typing import TYPE_CHECKING, Any, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from sklearn.base import clone
from sklearn.utils import check_consistent_length

from ..model_selection import SpeedSplit
from ._style import condition_styles, new_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(repr=False, eq=False)
class SpeedAccuracyDisplay:
    """Plot the accuracy against the shaft speed of the test, one line for each training speed.

    Parameters
    ----------
    accuracy : ndarray of shape (n_train, n_test)
        Share of correct verdicts for each pair of speeds; NaN if there is no verdict.
    train_rpm : ndarray of shape (n_train,)
        Speeds at which the diagnoser was calibrated, in revolutions per minute.
    test_rpm : ndarray of shape (n_test,)
        Speeds at which the diagnoser was tested, in revolutions per minute.
    name : str or None, default=None
        Name of the diagnoser, for the legend.

    Attributes
    ----------
    lines_ : list of matplotlib Line2D
        One for each training speed.
    ax_, figure_ : matplotlib Axes and Figure
        Axes and figure that hold the plot.

    Examples
    --------
    >>> display = SpeedAccuracyDisplay.from_predictions(
    ...     ["a", "b", "a", "b"], ["a", "b", "a", "a"],
    ...     train_rpm=[300] * 4, test_rpm=[300, 300, 500, 500],
    ... )
    >>> display.accuracy
    array([[1. , 0.5]])
    """

    accuracy: NDArray[Any]
    _: KW_ONLY
    train_rpm: NDArray[Any]
    test_rpm: NDArray[Any]
    name: str | None = None
    lines_: list[Any] = field(init=False)
    ax_: Any = field(init=False)
    figure_: Any = field(init=False)

    @classmethod
    def from_estimator(
        cls,
        estimator: Any,
        X: ArrayLike,
        y: ArrayLike,
        *,
        rpm: ArrayLike,
        recording: ArrayLike | None = None,
        train_rpm: float | None = None,
        name: str | None = None,
        ax: Axes | None = None,
    ) -> Self:
        """Fit a clone at each training speed, test it at the other speeds and plot the accuracy.

        Parameters
        ----------
        estimator : estimator
            The diagnoser. It need not be fitted, because clones are fitted.
        X : array-like of shape (n_windows, ...)
            Windows.
        y : array-like of shape (n_windows,)
            Conditions.
        rpm : array-like of shape (n_windows,)
            Nominal shaft speed of each window, in revolutions per minute.
        recording : array-like of shape (n_windows,) or None, default=None
            Recording of each window. If given, clones are fitted on the first half of each
            recording and tested on the second half, and the training speed is tested, too. See
            `SpeedSplit`.
        train_rpm : float or None, default=None
            The only training speed. If None, every speed is the training speed in turn.
        name : str or None, default=None
            Name for the legend. If None, the name of the estimator's class.
        ax : matplotlib Axes or None, default=None
            Axes to plot into. If None, new axes are created.

        Returns
        -------
        SpeedAccuracyDisplay
            The display, after drawing.
        """
        X, y, rpm = np.asarray(X), np.asarray(y), np.asarray(rpm, dtype=float)
        splitter = SpeedSplit(train_rpm=train_rpm, same_speed=recording is not None)
        groups = rpm if recording is None else np.column_stack([rpm, recording])
        splits = list(splitter.split(X, groups=groups))
        predicted, fitted, fitted_at = [], None, None
        for train, test in splits:
            if rpm[train[0]] != fitted_at:
                fitted_at = rpm[train[0]]
                fitted = clone(estimator).fit(X[train], y[train])
            predicted.append(fitted.predict(X[test]))
        tested = np.concatenate([test for _, test in splits])
        return cls.from_predictions(
            y[tested],
            np.concatenate(predicted),
            train_rpm=np.concatenate([np.full(len(test), rpm[train[0]]) for train, test in splits]),
            test_rpm=rpm[tested],
            name=type(estimator).__name__ if name is None else name,
            ax=ax,
        )

    @classmethod
    def from_predictions(
        cls,
        y_true: ArrayLike,
        y_pred: ArrayLike,
        *,
        train_rpm: ArrayLike,
        test_rpm: ArrayLike,
        name: str | None = None,
        ax: Axes | None = None,
    ) -> Self:
        """Compute the accuracy of verdicts and plot it.

        Parameters
        ----------
        y_true, y_pred : array-like of shape (n_verdicts,)
            True and predicted conditions.
        train_rpm, test_rpm : array-like of shape (n_verdicts,)
            Calibration speed and test speed of each verdict, in revolutions per minute.
        name : str or None, default=None
            Name for the legend.
        ax : matplotlib Axes or None, default=None
            Axes to plot into. If None, new axes are created.

        Returns
        -------
        SpeedAccuracyDisplay
            The display, after drawing.
        """
        check_consistent_length(y_true, y_pred, train_rpm, test_rpm)
        verdicts = pd.DataFrame({"train": np.asarray(train_rpm), "test": np.asarray(test_rpm)})
        verdicts["right"] = np.asarray(y_true) == np.asarray(y_pred)
        table = verdicts.pivot_table("right", index="train", columns="test", aggfunc="mean")
        accuracy = table.to_numpy(dtype=float)
        train, test = table.index.to_numpy(), table.columns.to_numpy()
        return cls(accuracy, train_rpm=train, test_rpm=test, name=name).plot(ax=ax)

    def plot(self, ax: Axes | None = None, *, name: str | None = None, **line_kw: Any) -> Self:
        """Draw the plot.

        Parameters
        ----------
        ax : matplotlib Axes or None, default=None
            Axes to plot into. If None, new axes are created.
        name : str or None, default=None
            Name for the legend. If None, the attribute `name` of the display.
        **line_kw : dict
            Keyword arguments that ``Axes.plot`` receives.

        Returns
        -------
        SpeedAccuracyDisplay
            The display, after drawing. Hollow markers are tests at the training speed.
        """
        ax = new_axes(1)[0] if ax is None else ax
        name = self.name if name is None else name
        prefix = "" if name is None else f"{name}, "
        self.lines_ = []
        # Lines of earlier displays on these axes keep their styles; new lines take the next ones.
        n_before = len(ax.get_legend_handles_labels()[0])
        styles = list(condition_styles(range(n_before + len(self.train_rpm))).values())[n_before:]
        for accuracy, speed, own in zip(self.accuracy, self.train_rpm, styles, strict=True):
            known = np.isfinite(accuracy)
            style = own | {"label": f"{prefix}calibrated at {speed:g} rpm"} | line_kw
            (line,) = ax.plot(self.test_rpm[known], accuracy[known], **style)
            same = known & (self.test_rpm == speed)
            ax.plot(
                self.test_rpm[same],
                accuracy[same],
                linestyle="none",
                marker=line.get_marker(),
                color=line.get_color(),
                markerfacecolor=ax.get_facecolor(),
                zorder=3,
            )
            self.lines_.append(line)
        ax.set(xlabel="Shaft speed of the test (rpm)", ylabel="Accuracy", ylim=(0, 1.03))
        ax.set_xticks(self.test_rpm)
        ax.grid(alpha=0.3)
        ax.legend()
        self.ax_, self.figure_ = ax, ax.figure
        return self
