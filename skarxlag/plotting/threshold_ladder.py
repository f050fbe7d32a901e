"""Plot of the residual levels of many windows, with the thresholds of the ladder."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass, field
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.pipeline import Pipeline
from sklearn.utils import check_consistent_length

from ..kernels.ladder import relative_scores
from ..kernels.scaling import root_mean_square
from ._axes import legend_beside, new_axes, readable_log_scale
from ._fitted import condition_names, deltas_of, is_bank, ordered_conditions
from ._style import LINE, condition_styles, ink

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_DECISIONS = ("detection", "isolation")
#: Width of the gap between two conditions, as a share of the number of windows.
_GAP = 0.02


@dataclass(repr=False, eq=False)
class ThresholdLadderDisplay:
    r"""Plot the residual levels of many windows by condition, with the thresholds.

    The plot depends on the decision.

    - Detection (Figure 11 of the paper, Eqs. 23 and 24): the levels of the healthy model's
      residual are drawn with the detection threshold :math:`\Gamma`.
    - Isolation by one residual (Eq. 32): the same levels are drawn on the rungs. A rung is the
      range of levels that is assigned to one condition, and it is drawn as a band. A window is
      assigned the condition whose band contains its level. The upper end of a rung is the
      isolation threshold :math:`\Delta` of its condition.
    - Isolation by a bank, which has one model for each condition: all residuals are relative to
      the geometric mean of the window's residuals. The plot shows the relative residual of the
      model of the true condition, with the :math:`\Delta` of this condition. It also shows the
      rival, which is the smallest relative residual of the other models. The verdict is correct
      if the rival lies above the residual of the true condition.

    Parameters
    ----------
    levels : ndarray of shape (n_windows,)
        Level of each window.
    y : ndarray of str of shape (n_windows,)
        True conditions.
    rivals : ndarray of shape (n_windows,) or None, default=None
        Rival of each window, for a bank.
    detection_threshold : float or None, default=None
        Detection threshold :math:`\Gamma`.
    isolation_thresholds : dict of str to float or None, default=None
        Isolation threshold :math:`\Delta` of each condition. Without rivals, these are the upper
        ends of the rungs in ascending order, and that of the highest rung is infinite.
    conditions : list of str
        Conditions from left to right. Their order determines their colours.

    Attributes
    ----------
    lines_ : dict of str to matplotlib Line2D
        Line of the levels of each condition.
    rival_line_ : matplotlib Line2D or None
        Line of the rivals.
    threshold_lines_ : dict of str to matplotlib Line2D
        Lines of the thresholds, by label.
    bands_ : dict of str to matplotlib Rectangle
        Band of each condition's rung. It is empty for a bank and for detection.
    ax_, figure_ : matplotlib Axes and Figure
        Axes and figure that hold the plot.

    See Also
    --------
    ResidualDisplay : Plot the residual of one window.

    Examples
    --------
    >>> display = ThresholdLadderDisplay.from_predictions(
    ...     ["good", "good", "worn"], [0.4, 0.5, 1.2],
    ...     isolation_thresholds={"good": 0.6, "worn": float("inf")},
    ... )
    >>> list(display.threshold_lines_), list(display.bands_)
    (['$\\Delta$ good'], ['good', 'worn'])
    """

    levels: NDArray[Any]
    y: NDArray[Any]
    _: KW_ONLY
    rivals: NDArray[Any] | None = None
    detection_threshold: float | None = None
    isolation_thresholds: dict[str, float] | None = None
    conditions: list[str]
    lines_: dict[str, Any] = field(init=False)
    rival_line_: Any = field(init=False)
    threshold_lines_: dict[str, Any] = field(init=False)
    bands_: dict[str, Any] = field(init=False)
    ax_: Any = field(init=False)
    figure_: Any = field(init=False)

    @classmethod
    def from_estimator(
        cls,
        estimator: Any,
        X: ArrayLike,
        y: ArrayLike,
        *,
        decision: str | None = None,
        conditions: Sequence[Any] | None = None,
        ax: Axes | None = None,
    ) -> Self:
        r"""Compute the levels of windows with a fitted diagnoser, and plot them.

        Parameters
        ----------
        estimator : Pipeline or ThresholdLadder
            The fitted diagnoser.
        X : array-like of shape (n_windows, ...)
            Windows if `estimator` is a Pipeline, residual levels otherwise.
        y : array-like of shape (n_windows,)
            True conditions.
        decision : {"detection", "isolation"} or None, default=None
            The decision to show. If None, isolation is shown, or detection if the estimator knows
            one condition only.
        conditions : sequence of label or None, default=None
            All conditions. Their order determines their colours. If None, the conditions that the
            estimator knows come first, starting with the healthy one, followed by others in `y`.
        ax : matplotlib Axes or None, default=None
            Axes to plot into. If None, new axes are created.

        Returns
        -------
        ThresholdLadderDisplay
            The display, after drawing.

        Raises
        ------
        ValueError
            If `decision` is not one of these, isolation is requested of an estimator that knows
            one condition, a bank has no model for a condition in `y`, or `conditions` omits a
            condition.
        """
        is_pipeline = isinstance(estimator, Pipeline)
        decide = estimator[-1] if is_pipeline else estimator
        levels = np.abs(np.asarray(estimator[:-1].transform(X) if is_pipeline else X))
        isolates = len(decide.classes_) > 1
        if decision is None:
            decision = "isolation" if isolates else "detection"
        if decision not in _DECISIONS or (decision == "isolation" and not isolates):
            possible = _DECISIONS if isolates else _DECISIONS[:1]
            raise ValueError(f"decision={decision!r}, expected one of {possible}.")
        y = np.asarray(y).astype(str)
        own = {"detection_threshold": decide.detection_threshold_}
        if not is_bank(decide):
            shown = root_mean_square(levels)
            if decision == "isolation":
                own["isolation_thresholds"] = deltas_of(decide)
        elif decision == "detection":
            shown = levels[:, decide.healthy_index_]
        else:
            shown, rivals = _own_and_rival(levels, y, [str(name) for name in decide.classes_])
            own = {"rivals": rivals, "isolation_thresholds": deltas_of(decide)}
        known = [*condition_names(estimator), *dict.fromkeys(y.tolist())]
        return cls.from_predictions(
            y, shown, **own, conditions=ordered_conditions(known, conditions), ax=ax
        )

    @classmethod
    def from_predictions(
        cls,
        y_true: ArrayLike,
        levels: ArrayLike,
        *,
        rivals: ArrayLike | None = None,
        detection_threshold: float | None = None,
        isolation_thresholds: dict[str, Any] | None = None,
        conditions: Sequence[Any] | None = None,
        ax: Axes | None = None,
    ) -> Self:
        r"""Plot levels that were computed elsewhere.

        Parameters
        ----------
        y_true : array-like of shape (n_windows,)
            True conditions.
        levels : array-like of shape (n_windows,)
            Level of each window.
        rivals : array-like of shape (n_windows,) or None, default=None
            Rival of each window, for a bank: the smallest level of the other models.
        detection_threshold : float or None, default=None
            Detection threshold :math:`\Gamma`.
        isolation_thresholds : dict of label to float or None, default=None
            Isolation threshold :math:`\Delta` of each condition. Without rivals, these are the
            upper ends of the rungs in ascending order.
        conditions : sequence of label or None, default=None
            All conditions. Their order determines their colours. If None, the conditions in
            `isolation_thresholds` come first, followed by others in `y_true`.
        ax : matplotlib Axes or None, default=None
            Axes to plot into. If None, new axes are created.

        Returns
        -------
        ThresholdLadderDisplay
            The display, after drawing.

        Raises
        ------
        ValueError
            If the lengths differ, `levels` has more than one axis, the upper ends of the rungs do
            not ascend, or `conditions` omits a condition.
        """
        y, levels = np.asarray(y_true).astype(str), np.asarray(levels)
        if levels.ndim != 1:
            raise ValueError(
                f"levels has the shape {levels.shape}, expected one level a window: (n_windows,)."
            )
        check_consistent_length(y, levels, rivals)
        deltas = {str(name): float(d) for name, d in (isolation_thresholds or {}).items()}
        if rivals is None and np.any(np.diff([d for d in deltas.values() if np.isfinite(d)]) < 0):
            raise ValueError(
                f"isolation_thresholds={deltas} must ascend: they are the upper ends of rungs."
            )
        display = cls(
            levels,
            y,
            rivals=None if rivals is None else np.asarray(rivals),
            detection_threshold=detection_threshold,
            isolation_thresholds=deltas,
            conditions=ordered_conditions([*deltas, *dict.fromkeys(y.tolist())], conditions),
        )
        return display.plot(ax=ax)

    def plot(self, ax: Axes | None = None, **line_kw: Any) -> Self:
        """Draw the plot.

        Parameters
        ----------
        ax : matplotlib Axes or None, default=None
            Axes to plot into. If None, new axes are created.
        **line_kw : dict
            Keyword arguments that ``Axes.plot`` receives for the levels.

        Returns
        -------
        ThresholdLadderDisplay
            The display, after drawing.
        """
        ax = new_axes(1)[0] if ax is None else ax
        self.lines_, self.threshold_lines_, self.bands_ = {}, {}, {}
        self.rival_line_ = None
        styles = condition_styles(self.conditions)
        places = self._places()
        readable_log_scale(ax, self.levels)
        self._plot_levels(ax, places, styles, line_kw)
        if self.detection_threshold is not None:
            self._threshold(ax, r"$\Gamma$", self.detection_threshold, color=ink(), linestyle="--")
        if self.isolation_thresholds and self.rivals is None:
            self._plot_rungs(ax, styles)
        elif self.isolation_thresholds:
            self._plot_deltas(ax, places, styles)
        shown = {name: np.mean(x) for name, x in places.items() if len(x)}
        ax.set_xticks(list(shown.values()), list(shown), rotation=30, ha="right")
        ax.set_xlim(-len(self.y) * _GAP, max(x[-1] for x in places.values() if len(x)) * (1 + _GAP))
        ax.set_ylabel("Residual level" if self.rivals is None else "Relative residual level")
        ax.set_xlabel("Windows by true condition")
        thresholds = list(self.threshold_lines_.values())
        if self.rivals is None:
            # The legend lists the thresholds as they lie in the plot, the highest on top.
            legend_beside(ax, sorted(thresholds, key=lambda line: -line.get_ydata()[0]))
        else:
            legend_beside(ax, [line for line in (self.rival_line_, *thresholds) if line])
        self.ax_, self.figure_ = ax, ax.figure
        return self

    def _places(self):
        """Return the position of each window on the horizontal axis, by condition."""
        places, begin, gap = {}, 0.0, _GAP * len(self.y)
        for name in self.conditions:
            places[name] = begin + np.arange(np.count_nonzero(self.y == name))
            begin += len(places[name]) + gap * bool(len(places[name]))
        return places

    def _plot_levels(self, ax, places, styles, line_kw):
        style = {"linestyle": "none", "markersize": 4.5, "markeredgewidth": 0}
        for name, x in places.items():
            chosen = self.y == name
            if len(x) == 0:
                continue
            own = {key: styles[name][key] for key in ("color", "marker")}
            (self.lines_[name],) = ax.plot(x, self.levels[chosen], **style | own | line_kw)
        if self.rivals is not None:
            x = np.concatenate(list(places.values()))
            by_place = np.concatenate([self.rivals[self.y == name] for name in self.conditions])
            (self.rival_line_,) = ax.plot(
                x,
                by_place,
                linestyle="none",
                marker=".",
                markersize=2.5,
                color=ink(),
                alpha=0.6,
                label="best other model",
            )

    def _plot_rungs(self, ax, styles):
        for name, upper in self.isolation_thresholds.items():
            if np.isfinite(upper) and upper != self.detection_threshold:
                shown = {key: styles[name][key] for key in LINE}
                self._threshold(ax, rf"$\Delta$ {name}", upper, **shown)
        # The lowest rung has no lower end and the highest no upper end: both end with the axes.
        lowest, highest = ax.get_ylim()
        lower = lowest
        for name, upper in self.isolation_thresholds.items():
            top = min(upper, highest)
            self.bands_[name] = ax.axhspan(
                lower, top, color=styles[name]["color"], alpha=0.15, linewidth=0, zorder=0
            )
            lower = top
        ax.set_ylim(lowest, highest)

    def _plot_deltas(self, ax, places, styles):
        for name, x in places.items():
            delta = self.isolation_thresholds.get(name)
            if delta is not None and len(x):
                shown = {key: styles[name][key] for key in LINE}
                (self.threshold_lines_[rf"$\Delta$ {name}"],) = ax.plot(
                    [x[0], x[-1]], [delta, delta], linewidth=1.6, label=rf"$\Delta$ {name}", **shown
                )

    def _threshold(self, ax, label, value, **style):
        self.threshold_lines_[label] = ax.axhline(value, label=label, linewidth=1.4, **style)


def _own_and_rival(levels, y, classes):
    """Relative residual of the true condition's model, and the smallest of the others."""
    unknown = sorted(set(y.tolist()) - set(classes))
    if unknown:
        raise ValueError(f"y has the conditions {unknown}, the bank has models of {classes} only.")
    relative = np.exp(-relative_scores(levels))
    is_own = y[:, np.newaxis] == np.array(classes)
    return relative[is_own], np.min(np.where(is_own, np.inf, relative), axis=1)
