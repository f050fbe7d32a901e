"""Plot of the residual of one window, with the thresholds that its level is compared with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from operator import itemgetter
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.pipeline import Pipeline

from ..kernels.ladder import log_level
from ..observers import RESIDUAL_EVALUATIONS, Observer
from ._fitted import chosen_model, isolation_thresholds, known_conditions, ordered_conditions
from ._style import LINE, Display, color_of, condition_styles, ink, legend_beside

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(repr=False, eq=False)
class ResidualDisplay(Display):
    r"""Plot the residual of one window, with the thresholds of the decision.

    Figures 12 to 19 of the paper are of this kind. The level of a window is one number that
    describes the size of the residual; the decision compares it with the thresholds. For the
    evaluation "switching_gain" the residual is :math:`r = K_s\,\mathrm{sgn}(S)` (Eq. 21), and the
    level is the settled value of :math:`K_s`. For "power" the residual is the output error e, and
    the level is its root mean square.

    Parameters
    ----------
    residual : array-like of shape (n_samples,)
        Trajectory of the residual r(k), in the unit of the innovations.
    level : float or None, default=None
        Level of the window, in the same unit.
    detection_threshold : float or None, default=None
        Detection threshold :math:`\Gamma`.
    isolation_thresholds : dict of label to float or None, default=None
        Isolation threshold :math:`\Delta` of each condition. If `level` is given, only the next
        threshold below it and the next one above it are drawn, because these two decide the
        verdict. A threshold that is infinite, or that equals :math:`\Gamma`, is not drawn.
    model : label or None, default=None
        Condition of the model that produced the residual.
    condition : label or None, default=None
        True condition of the window.
    conditions : sequence of label or None, default=None
        All conditions. Their order determines their colours. If None, those of
        `isolation_thresholds`, then `condition`.

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

    residual: ArrayLike
    _: KW_ONLY
    level: float | None = None
    detection_threshold: float | None = None
    isolation_thresholds: dict[Any, float] | None = None
    model: Any = None
    condition: Any = None
    conditions: Sequence[Any] | None = None

    def __post_init__(self) -> None:
        deltas = self.isolation_thresholds or {}
        self.isolation_thresholds = {str(name): float(delta) for name, delta in deltas.items()}
        known = [*self.isolation_thresholds, self.condition]
        self.conditions = ordered_conditions(known, self.conditions)

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
        observer, decide = estimator[-2], estimator[-1]
        if not isinstance(observer, Observer):
            raise ValueError(
                f"estimator has {type(observer).__name__} before its decision, expected an "
                "observer, which has trajectories to show."
            )
        trajectory = RESIDUAL_EVALUATIONS[observer.evaluation].trajectory
        if trajectory is None:
            known = [name for name, each in RESIDUAL_EVALUATIONS.items() if each.trajectory]
            raise ValueError(
                f"evaluation={observer.evaluation!r} has no trajectory, expected one of {known}."
            )
        m, names = chosen_model(estimator, model)
        innovations = estimator[:-2].transform(np.asarray(window)[np.newaxis])
        levels = np.asarray(observer.transform(innovations))[0]
        known = known_conditions(estimator)
        gamma, deltas = decide.detection_threshold_, isolation_thresholds(decide)
        if decide._is_bank():
            # The thresholds of a bank are relative to the geometric mean of all residuals.
            gamma = gamma if names[m] == str(known[0]) else None
            deltas = {names[m]: deltas[names[m]] * float(np.exp(log_level(levels).mean()))}
        display = cls(
            observer.observe(innovations)[trajectory][0, m],
            level=float(levels[m]),
            detection_threshold=gamma,
            isolation_thresholds=deltas,
            model=names[m],
            condition=condition,
            conditions=ordered_conditions([*known, condition], conditions),
        )
        return display.plot(ax=ax)

    def plot(self, ax: Axes | None = None) -> Self:
        """Draw the plot.

        Parameters
        ----------
        ax : matplotlib Axes or None, default=None
            Axes to plot into. If None, new axes are created.

        Returns
        -------
        ResidualDisplay
            The display, after drawing.
        """
        (ax,) = self._set_axes(ax)
        styles = condition_styles(self.conditions)
        of_window = "" if self.condition is None else f", window of {self.condition}"
        of_model = "" if self.model is None else f", model of {self.model}"
        style = {"linewidth": 0.6, "alpha": 0.4, "label": f"residual{of_window}{of_model}"}
        style["color"] = color_of(self.condition, self.conditions, other=ink())
        self.line_: Any = ax.plot(self.residual, **style)[0]

        def on_both_sides(value, label, **style):
            ax.axhline(-value, **style)
            return ax.axhline(value, label=label, **style)

        self.level_line_: Any = None
        if self.level is not None:
            label = "level of the window"
            self.level_line_ = on_both_sides(self.level, label, color=ink(), linewidth=2.4)
        thresholds = {}
        if self.detection_threshold is not None:
            style = {"color": ink(), "linestyle": "--"}
            thresholds[r"$\Gamma$"] = self.detection_threshold, style
        for name, delta in self._shown_deltas():
            thresholds[rf"$\Delta$ {name}"] = delta, {key: styles[name][key] for key in LINE}
        self.threshold_lines_: dict[str, Any] = {
            label: on_both_sides(value, label, linewidth=1.4, **style)
            for label, (value, style) in thresholds.items()
        }
        reach = 1.08 * np.abs([*self.residual, *(value for value, _ in thresholds.values())]).max()
        ax.set(xlabel="Sample", ylabel="Residual r(k)", xlim=(0, len(self.residual) - 1))
        if reach > 0:
            ax.set_ylim(-reach, reach)
        level = [] if self.level_line_ is None else [self.level_line_]
        legend_beside(ax, [*level, *self.threshold_lines_.values()])
        ax.set_title(self.line_.get_label(), fontsize="medium", loc="left")
        return self

    def _shown_deltas(self):
        """Return the isolation thresholds to draw, in ascending order."""
        deltas = [
            (name, delta)
            for name, delta in sorted(self.isolation_thresholds.items(), key=itemgetter(1))
            if np.isfinite(delta) and delta != self.detection_threshold
        ]
        if self.level is None:
            return deltas
        above = int(np.searchsorted([delta for _, delta in deltas], self.level))
        return deltas[max(above - 1, 0) : above + 1]
