"""Plot of the residual levels of many windows, with the thresholds of the decision."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.pipeline import Pipeline

from ..core.state import expect
from ..kernels.ladder import relative_scores
from ._fitted import known_conditions, ordered_conditions
from ._style import Axes, condition_styles, ink, legend_beside
from ._thresholds import ThresholdDisplay, isolation_thresholds

_DECISIONS = ("detection", "isolation")
#: Width of the gap between two conditions, as a share of the number of windows.
_GAP = 0.02


@dataclass(repr=False, eq=False)
class ThresholdLadderDisplay(ThresholdDisplay):
    r"""Plot the residual levels of many windows by condition, with the thresholds.

    The plot depends on the decision.

    - Detection (Figure 11 of the paper, Eqs. 23 and 24): the levels of the healthy
      model's residual are drawn with the detection threshold :math:`\Gamma`.
    - Isolation by one residual (Eq. 32): the same levels are drawn on the rungs. A rung
      is the range of levels that is assigned to one condition, and it is drawn as a
      band. A window is assigned the condition whose band contains its level. The upper
      end of a rung is the isolation threshold :math:`\Delta` of its condition.
    - Isolation by a bank, which has one model for each condition: all residuals are
      relative to the geometric mean of the window's residuals. The plot shows the
      relative residual of the model of the true condition, with the :math:`\Delta` of
      this condition. It also shows the rival, which is the smallest relative residual
      of the other models. The verdict is correct if the rival lies above the residual
      of the true condition.

    Parameters
    ----------
    y : array-like of shape (n_windows,)
        True conditions.
    levels : array-like of shape (n_windows,)
        Level of each window.
    rivals : array-like of shape (n_windows,) or None, default=None
        Rival of each window, for a bank.
    detection_threshold : float or None, default=None
        Detection threshold :math:`\Gamma`.
    isolation_thresholds : dict of label to float or None, default=None
        Isolation threshold :math:`\Delta` of each condition. Without rivals, these are
        the upper ends of the rungs in ascending order, and that of the highest rung is
        infinite.
    conditions : sequence of label or None, default=None
        Conditions from left to right. Their order determines their colours. If None,
        those of `isolation_thresholds` come first, followed by others in `y`.

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
    >>> display = ThresholdLadderDisplay(
    ...     ["good", "good", "worn"], [0.4, 0.5, 1.2],
    ...     isolation_thresholds={"good": 0.6, "worn": float("inf")},
    ... ).plot()
    >>> list(display.threshold_lines_), list(display.bands_)
    (['$\\Delta$ good'], ['good', 'worn'])
    """

    y: ArrayLike
    levels: ArrayLike
    _: KW_ONLY
    rivals: ArrayLike | None = None

    def __post_init__(self) -> None:
        self.y = np.asarray(self.y).astype(str)
        self.levels = np.asarray(self.levels)
        self._name_conditions(self.y.tolist())

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
            The decision to show. If None, isolation is shown, or detection if the
            estimator has one condition only.
        conditions : sequence of label or None, default=None
            All conditions. Their order determines their colours. If None, the
            conditions of the estimator come first, starting with the healthy
            one, followed by others in `y`.
        ax : matplotlib Axes or None, default=None
            Axes to plot into. If None, new axes are created.

        Returns
        -------
        ThresholdLadderDisplay
            The display, after drawing.

        Raises
        ------
        ValueError
            If `decision` is not one of these, isolation is requested of an estimator
            that has one condition, a bank has no model for a condition in `y`, or
            `conditions` omits a condition.
        """
        is_pipeline = isinstance(estimator, Pipeline)
        decide = estimator[-1] if is_pipeline else estimator
        levels = np.abs(np.asarray(estimator[:-1].transform(X) if is_pipeline else X))
        possible = _DECISIONS if len(decide.classes_) > 1 else _DECISIONS[:1]
        decision = possible[-1] if decision is None else decision
        expect(decision in possible, "decision", decision, f"one of {possible}")
        y = np.asarray(y).astype(str)
        shown = decide._healthy_level(levels)
        rivals = None
        gamma = decide.detection_threshold_
        deltas = None
        if decision == "isolation":
            deltas = isolation_thresholds(decide)
            if decide._is_bank():
                gamma = None
                shown, rivals = _own_and_rival(levels, y, decide.classes_.astype(str))
        order = ordered_conditions(
            [*known_conditions(estimator), *y.tolist()], conditions
        )
        return cls(
            y,
            shown,
            rivals=rivals,
            detection_threshold=gamma,
            isolation_thresholds=deltas,
            conditions=order,
        ).plot(ax=ax)

    def _draw(self, ax):
        ax.set_yscale("log")
        ax.yaxis.set_major_formatter("{x:g}")
        styles = condition_styles(self.conditions)
        dots = {"markersize": 4.5, "markeredgewidth": 0, "linestyle": "none"}
        shown = [name for name in self.conditions if name in self.y]
        # Windows stand side by side, with a gap between two conditions.
        gap = _GAP * len(self.y)
        group = np.array([shown.index(name) for name in self.y])
        position = np.argsort(np.argsort(group, kind="stable")) + gap * group
        positions = {name: position[self.y == name] for name in shown}
        self.lines_: dict[str, Any] = {}
        for name in shown:
            levels = self.levels[self.y == name]
            [self.lines_[name]] = ax.plot(
                positions[name], levels, **styles[name] | dots
            )
        self.rival_line_: Any = None
        if self.rivals is not None:
            self.rival_line_ = ax.plot(
                position,
                self.rivals,
                ".",
                label="best other model",
                color=ink(),
                markersize=2.5,
                alpha=0.6,
            )[0]
        self.threshold_lines_: dict[str, Any] = {}
        for name, height, style in self._thresholds():
            if self.rivals is None:
                self.threshold_lines_[style["label"]] = ax.axhline(height, **style)
            elif name in positions:
                ends = positions[name][[0, -1]]
                line = ax.plot(ends, [height, height], **style)[0]
                self.threshold_lines_[style["label"]] = line
        self.bands_: dict[str, Any] = {}
        ylabel = "Relative residual level"
        if self.rivals is None:
            self.bands_ = self._draw_rungs(ax, styles)
            ylabel = "Residual level"
        middles = [of_condition.mean() for of_condition in positions.values()]
        ax.set_xticks(middles, shown, rotation=30, ha="right")
        ax.set(
            xlim=(-gap, position.max() + gap),
            xlabel="Windows by true condition",
            ylabel=ylabel,
        )
        # The legend lists the thresholds as they lie in the plot, the highest on top.
        lines = sorted(self.threshold_lines_.values(), key=_height, reverse=True)
        legend_beside(ax, lines if self.rivals is None else [self.rival_line_, *lines])

    def _draw_rungs(self, ax, styles):
        """Draw a band for each rung; the lowest and the highest end with the axes."""
        bands = {}
        bottom, top = lower, _ = ax.get_ylim()
        for name, upper in self.isolation_thresholds.items():
            color = styles[name]["color"]
            bands[name] = ax.axhspan(
                lower, min(upper, top), color=color, alpha=0.15, linewidth=0, zorder=0
            )
            lower = upper
        ax.set_ylim(bottom, top)
        return bands


def _height(line):
    return line.get_ydata()[0]


def _own_and_rival(levels, y, classes):
    """Return the relative residual of each window's own model, and the smallest of the others."""
    unknown = np.setdiff1d(y, classes)
    expected = f"models of the bank: {classes.tolist()}"
    expect(len(unknown) == 0, "Conditions in y", unknown, expected)
    relative = np.exp(-relative_scores(levels))
    is_own = y[:, np.newaxis] == classes
    return relative[is_own], np.min(np.where(is_own, np.inf, relative), axis=1)
