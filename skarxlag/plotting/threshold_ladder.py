"""Residual levels of many windows against the thresholds of the ladder."""

from collections.abc import Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.utils import check_consistent_length

from ..kernels.ladder import relative_scores
from ..kernels.scaling import root_mean_square
from ._axes import legend_beside, new_axes, readable_log_scale
from ._fitted import bank_deltas, condition_names, is_bank, ladder_cuts, ordered_conditions
from ._style import condition_styles, ink

_DECISIONS = ("detection", "isolation")
#: Windows left free between two conditions, as a share of all.
_GAP = 0.02


class ThresholdLadderDisplay:
    r"""Levels of many windows by condition, with :math:`\Gamma` and the :math:`\Delta`.

    Detection (Figure 11 of the paper, Eqs. 23 and 24): levels of the healthy model's residual, with
    :math:`\Gamma`. Isolation by one residual (Eq. 32): the same levels on the rungs, which are
    drawn as bands; a window is given the condition whose band it lies in. Isolation by a bank: the
    residual of a window's own model relative to the geometric mean of all its residuals, with the
    condition's own :math:`\Delta`, and the smallest relative residual of the other models, its
    rival; the verdict is right where the rival lies above.

    Parameters
    ----------
    levels : ndarray of shape (n_windows,)
        Level of each window.
    y : ndarray of str of shape (n_windows,)
        True conditions.
    rivals : ndarray of shape (n_windows,) or None, default=None
        Smallest level of the other models, of a bank.
    detection_threshold : float or None, default=None
        :math:`\Gamma`.
    isolation_thresholds : dict of str to float or None, default=None
        :math:`\Delta` by condition; without rivals the upper ends of the rungs, the lowest first,
        that of the highest infinite.
    conditions : list of str
        Conditions from left to right, in the order that gives them their colours.

    Attributes
    ----------
    lines_ : dict of str to matplotlib Line2D
        Levels of each condition.
    rival_line_ : matplotlib Line2D or None
        Levels of the rivals.
    threshold_lines_ : dict of str to matplotlib Line2D
        The thresholds, by their label.
    bands_ : dict of str to matplotlib Rectangle
        The rung of each condition; empty for a bank and for detection.
    ax_, figure_ : matplotlib Axes and Figure
        Where it was plotted.

    See Also
    --------
    ResidualDisplay : The residual of one window.

    Examples
    --------
    >>> display = ThresholdLadderDisplay.from_predictions(
    ...     ["good", "good", "worn"], [0.4, 0.5, 1.2],
    ...     isolation_thresholds={"good": 0.6, "worn": float("inf")},
    ... )
    >>> list(display.threshold_lines_), list(display.bands_)
    (['$\\Delta$ good'], ['good', 'worn'])
    """

    lines_: dict[str, Any]
    rival_line_: Any
    threshold_lines_: dict[str, Any]
    bands_: dict[str, Any]
    ax_: Any
    figure_: Any

    def __init__(
        self,
        levels: NDArray[Any],
        y: NDArray[Any],
        *,
        rivals: NDArray[Any] | None = None,
        detection_threshold: float | None = None,
        isolation_thresholds: dict[str, float] | None = None,
        conditions: list[str],
    ) -> None:
        self.levels = levels
        self.y = y
        self.rivals = rivals
        self.detection_threshold = detection_threshold
        self.isolation_thresholds = isolation_thresholds
        self.conditions = conditions

    @classmethod
    def from_estimator(
        cls,
        estimator: Any,
        X: ArrayLike,
        y: ArrayLike,
        *,
        decision: str | None = None,
        conditions: Sequence[Any] | None = None,
        ax: Any = None,
    ) -> Self:
        r"""Plot the levels that a fitted diagnoser gives windows.

        Parameters
        ----------
        estimator : Pipeline or ThresholdLadder
            Fitted.
        X : array-like of shape (n_windows, ...)
            Windows; residual levels where `estimator` is no Pipeline.
        y : array-like of shape (n_windows,)
            True conditions.
        decision : {"detection", "isolation"} or None, default=None
            Which decision to show. None: isolation, or detection where
            there is one condition only.
        conditions : sequence of label or None, default=None
            All conditions, in the order that gives them their colours. None: those that the
            estimator knows, the healthy one first, then others in `y`.
        ax : matplotlib Axes or None, default=None
            Where to plot. None: new axes.

        Returns
        -------
        ThresholdLadderDisplay
            With the plot.

        Raises
        ------
        ValueError
            If `decision` is none of these, isolation is asked of one condition, a bank has no model
            for a condition in `y`, or `conditions` leaves one out.
        """
        is_pipeline = hasattr(estimator, "steps")
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
                own["isolation_thresholds"] = ladder_cuts(decide)
        elif decision == "detection":
            shown = levels[:, decide.healthy_index_]
        else:
            shown, rivals = _own_and_rival(levels, y, [str(name) for name in decide.classes_])
            own = {"rivals": rivals, "isolation_thresholds": bank_deltas(decide)}
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
        ax: Any = None,
    ) -> Self:
        r"""Plot levels that one has.

        Parameters
        ----------
        y_true : array-like of shape (n_windows,)
            True conditions.
        levels : array-like of shape (n_windows,)
            Level of each window.
        rivals : array-like of shape (n_windows,) or None, default=None
            Smallest level of the other models, of a bank.
        detection_threshold : float or None, default=None
            :math:`\Gamma`.
        isolation_thresholds : dict of label to float or None, default=None
            :math:`\Delta` by condition; without rivals the upper ends of the rungs, ascending.
        conditions : sequence of label or None, default=None
            Conditions in the order that gives them their colours. None: those of
            `isolation_thresholds`, then others in `y_true`.
        ax : matplotlib Axes or None, default=None
            Where to plot. None: new axes.

        Returns
        -------
        ThresholdLadderDisplay
            With the plot.

        Raises
        ------
        ValueError
            If lengths differ, `levels` has more than one axis, rungs do not ascend, or
            `conditions` leaves one out.
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

    def plot(self, ax: Any = None, **line_kw: Any) -> Self:
        """Plot.

        Parameters
        ----------
        ax : matplotlib Axes or None, default=None
            Where to plot. None: new axes.
        **line_kw : dict
            Passed to ``Axes.plot`` for the levels.

        Returns
        -------
        ThresholdLadderDisplay
            With the plot.
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
            # As they lie, the highest on top.
            legend_beside(ax, sorted(thresholds, key=lambda line: -line.get_ydata()[0]))
        else:
            legend_beside(ax, [self.rival_line_, *thresholds])
        self.ax_, self.figure_ = ax, ax.figure
        return self

    def _places(self):
        """Place of each window on the horizontal axis, by condition."""
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
                shown = {key: styles[name][key] for key in ("color", "linestyle")}
                self._threshold(ax, rf"$\Delta$ {name}", upper, **shown)
        # The lowest and the highest rung have no end of their own: they end with the figure.
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
                shown = {key: styles[name][key] for key in ("color", "linestyle")}
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
