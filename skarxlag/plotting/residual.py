"""Plot of the residual of one window, with the thresholds that its level is compared with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass, field
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.pipeline import Pipeline

from ..kernels.ladder import log_level
from ..observers import RESIDUAL_EVALUATIONS
from ._axes import legend_beside, new_axes
from ._fitted import condition_names, deltas_of, healthy_name, is_bank, observed, ordered_conditions
from ._style import LINE, condition_styles, ink
from ._window import WindowDisplay

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(repr=False, eq=False)
class ResidualDisplay(WindowDisplay):
    r"""Plot the residual of one window, with the thresholds of the decision.

    Figures 12 to 19 of the paper are of this kind. The level of a window is one number that
    describes the size of the residual; the decision compares it with the thresholds. For the
    evaluation "switching_gain" the residual is :math:`r = K_s\,\mathrm{sgn}(S)` (Eq. 21), and the
    level is the settled value of :math:`K_s`. For "power" the residual is the output error e, and
    the level is its root mean square.

    Parameters
    ----------
    residual : ndarray of shape (n_samples,)
        Trajectory of the residual r(k), in the unit of the innovations.
    level : float or None, default=None
        Level of the window, in the same unit.
    detection_threshold : float or None, default=None
        Detection threshold :math:`\Gamma`.
    isolation_thresholds : dict of str to float or None, default=None
        Isolation threshold :math:`\Delta` of each condition. If `level` is given, only the next
        threshold below it and the next one above it are drawn, because these two decide the
        verdict. A threshold that is infinite, or that equals :math:`\Gamma`, is not drawn.
    model : str or None, default=None
        Condition of the model that produced the residual.
    condition : str or None, default=None
        True condition of the window.
    conditions : list of str or None, default=None
        All conditions. Their order determines their colours.

    Attributes
    ----------
    line_ : matplotlib Line2D
        The line of the residual.
    level_line_ : matplotlib Line2D or None
        The line of the level. Like the thresholds, it is drawn on both sides of zero.
    threshold_lines_ : dict of str to matplotlib Line2D
        The lines of the thresholds by label, in the order of the legend: first :math:`\Gamma`,
        then :math:`\Delta` from the lowest to the highest.
    ax_, figure_ : matplotlib Axes and Figure
        Axes and figure that hold the plot.

    See Also
    --------
    ThresholdLadderDisplay : Plot the levels of many windows.

    Examples
    --------
    >>> import numpy as np
    >>> from skarxlag import make_alpio
    >>> X = np.random.default_rng(0).normal(size=(8, 600))
    >>> diagnoser = make_alpio(healthy="good").fit(X, np.repeat(["good", "worn"], 4))
    >>> display = ResidualDisplay.from_estimator(diagnoser, X[5], model="worn")
    >>> list(display.threshold_lines_)
    ['$\\Delta$ worn']
    """

    residual: NDArray[Any]
    _: KW_ONLY
    level: float | None = None
    detection_threshold: float | None = None
    isolation_thresholds: dict[str, float] | None = None
    line_: Any = field(init=False)
    level_line_: Any = field(init=False)
    threshold_lines_: dict[str, Any] = field(init=False)
    ax_: Any = field(init=False)
    figure_: Any = field(init=False)

    @classmethod
    def from_estimator(
        cls,
        estimator: Pipeline,
        window: ArrayLike,
        *,
        model: Any = None,
        condition: Any = None,
        conditions: Sequence[Any] | None = None,
        ax: Axes | None = None,
    ) -> Self:
        r"""Compute the residual of one window with a fitted diagnoser, and plot it.

        If the diagnoser has a single residual, all thresholds apply to it. If it has a bank, which
        is one model for each condition, :math:`\Delta` limits the residual of one model relative
        to the geometric mean of all residuals of the window. The plot therefore shows
        :math:`\Delta` multiplied by that mean. It shows :math:`\Gamma` for the healthy model only.

        Parameters
        ----------
        estimator : Pipeline
            Fitted pipeline of an ARXLaguerre, an observer and a ThresholdLadder.
        window : array-like of shape (n_samples,) or (n_channels, n_samples)
            The window.
        model : label or None, default=None
            Condition of the model to show. If None, the healthy condition.
        condition : label or None, default=None
            True condition of the window. It determines the colour of the lines.
        conditions : sequence of label or None, default=None
            All conditions. Their order determines their colours. If None, the healthy condition
            comes first and the others are sorted.
        ax : matplotlib Axes or None, default=None
            Axes to plot into. If None, new axes are created.

        Returns
        -------
        ResidualDisplay
            The display, after drawing.

        Raises
        ------
        ValueError
            If the estimator has no observer or no model of the condition `model`, or if its
            residual evaluation does not measure the size of a trajectory ("whiteness").
        """
        name, m, paths, levels = observed(estimator, window, model)
        evaluation = estimator[-2].evaluation
        shown = RESIDUAL_EVALUATIONS[evaluation].trajectory
        if shown is None:
            known = [name for name, each in RESIDUAL_EVALUATIONS.items() if each.trajectory]
            raise ValueError(
                f"evaluation={evaluation!r} does not measure the size of a trajectory, so there is "
                f"none to show; expected one of {known}."
            )
        gamma, deltas = _thresholds(estimator[-1], levels, name)
        return cls.from_predictions(
            paths[shown][0, m],
            level=float(levels[m]),
            detection_threshold=gamma,
            isolation_thresholds=deltas,
            model=name,
            condition=condition,
            conditions=ordered_conditions([*condition_names(estimator), condition], conditions),
            ax=ax,
        )

    @classmethod
    def from_predictions(
        cls,
        residual: ArrayLike,
        *,
        level: float | None = None,
        detection_threshold: float | None = None,
        isolation_thresholds: dict[str, Any] | None = None,
        model: Any = None,
        condition: Any = None,
        conditions: Sequence[Any] | None = None,
        ax: Axes | None = None,
    ) -> Self:
        r"""Plot a residual that was computed elsewhere.

        Parameters
        ----------
        residual : array-like of shape (n_samples,)
            Trajectory of the residual.
        level : float or None, default=None
            Level of the window, which is compared with the thresholds.
        detection_threshold : float or None, default=None
            Detection threshold :math:`\Gamma`.
        isolation_thresholds : dict of label to float or None, default=None
            Isolation threshold :math:`\Delta` of each condition.
        model, condition : label or None, default=None
            Condition that the model was identified on, and true condition of the window.
        conditions : sequence of label or None, default=None
            All conditions. Their order determines their colours. If None, those of
            `isolation_thresholds`, then `condition`.
        ax : matplotlib Axes or None, default=None
            Axes to plot into. If None, new axes are created.

        Returns
        -------
        ResidualDisplay
            The display, after drawing.

        Raises
        ------
        ValueError
            If `residual` is not one trajectory, or `conditions` omits a condition that is drawn.
        """
        residual = np.asarray(residual)
        if residual.ndim != 1 or len(residual) == 0:
            raise ValueError(
                f"residual has the shape {residual.shape}, expected one trajectory: (n_samples,)."
            )
        deltas = {str(name): float(d) for name, d in (isolation_thresholds or {}).items()}
        display = cls._of(
            residual,
            level=level,
            detection_threshold=detection_threshold,
            isolation_thresholds=deltas,
            model=model,
            condition=condition,
            conditions=conditions,
            known=deltas,
        )
        return display.plot(ax=ax)

    def plot(self, ax: Axes | None = None, **line_kw: Any) -> Self:
        """Draw the plot.

        Parameters
        ----------
        ax : matplotlib Axes or None, default=None
            Axes to plot into. If None, new axes are created.
        **line_kw : dict
            Keyword arguments that ``Axes.plot`` receives for the residual.

        Returns
        -------
        ResidualDisplay
            The display, after drawing.
        """
        ax = new_axes(1)[0] if ax is None else ax
        styles = condition_styles(self.conditions or [])
        window = "residual" if self.condition is None else f"residual, window of {self.condition}"
        style = {"linewidth": 0.6, "alpha": 0.4, "color": self._color(ink())}
        style["label"] = self._of_model(window)
        (self.line_,) = ax.plot(self.residual, **style | line_kw)
        self.level_line_ = None
        if self.level is not None:
            self.level_line_ = _on_both_sides(
                ax, self.level, "level of the window", color=ink(), linewidth=2.4
            )
        self.threshold_lines_ = {}
        if self.detection_threshold is not None:
            self._threshold(ax, r"$\Gamma$", self.detection_threshold, color=ink(), linestyle="--")
        for name, value in self._bounds():
            shown = {key: styles[name][key] for key in LINE}
            self._threshold(ax, rf"$\Delta$ {name}", value, **shown)
        drawn = [line.get_ydata()[0] for line in self.threshold_lines_.values()]
        reach = 1.08 * np.max(np.abs([*self.residual, *drawn]))
        ax.set(xlabel="Sample", ylabel="Residual r(k)", xlim=(0, len(self.residual) - 1))
        if reach > 0:
            ax.set_ylim(-reach, reach)
        level = [] if self.level_line_ is None else [self.level_line_]
        legend_beside(ax, [*level, *self.threshold_lines_.values()])
        ax.set_title(self.line_.get_label(), fontsize="medium", loc="left")
        self.ax_, self.figure_ = ax, ax.figure
        return self

    def _bounds(self):
        """Return the isolation thresholds to draw, in ascending order."""
        finite = [
            (name, value)
            for name, value in (self.isolation_thresholds or {}).items()
            if np.isfinite(value) and value != self.detection_threshold
        ]
        finite.sort(key=lambda each: each[1])
        if self.level is None:
            return finite
        below = [each for each in finite if each[1] < self.level]
        above = [each for each in finite if each[1] >= self.level]
        return below[-1:] + above[:1]

    def _threshold(self, ax, label, value, **style):
        self.threshold_lines_[label] = _on_both_sides(ax, value, label, linewidth=1.4, **style)


def _on_both_sides(ax, value, label, **style):
    ax.axhline(-value, **style)
    return ax.axhline(value, label=label, **style)


def _thresholds(decide, levels, model):
    """Return Gamma and the Deltas in the unit of one model's residual, for one window."""
    gamma, healthy = decide.detection_threshold_, healthy_name(decide)
    if healthy is None:
        return gamma, {}
    if not is_bank(decide):
        return gamma, deltas_of(decide)
    scale = float(np.exp(log_level(levels).mean()))
    return gamma if model == healthy else None, {model: deltas_of(decide)[model] * scale}
