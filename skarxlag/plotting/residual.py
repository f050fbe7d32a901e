"""Plot of the residual of one window, with the thresholds of the decision."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.pipeline import Pipeline

from ..core.capabilities import offers
from ..core.state import expect
from ..kernels.ladder import log_level
from ._fitted import chosen_model, known_conditions, ordered_conditions
from ._style import Axes, color_of, ink, legend_beside
from ._thresholds import ThresholdDisplay, isolation_thresholds

#: Trajectory of `Observer.observe` whose size a residual evaluation measures.
_TRAJECTORIES = {"power": "error", "switching_gain": "residual"}


@dataclass(repr=False, eq=False)
class ResidualDisplay(ThresholdDisplay):
    r"""Plot the residual of one window, with the thresholds of the decision.

    Figures 12 to 19 of the paper are of this kind. The level of a window is one number
    that describes the size of the residual; the decision compares it with the
    thresholds. For the evaluation "switching_gain" the residual is :math:`r =
    K_s\,\mathrm{sgn}(S)` (Eq. 21), and the level is the settled value of :math:`K_s`.
    For "power" the residual is the output error e, and the level is its root mean
    square.

    Parameters
    ----------
    residual : array-like of shape (n_samples,)
        Trajectory of the residual r(k), in the unit of the innovations.
    level : float or None, default=None
        Level of the window, in the same unit.
    detection_threshold : float or None, default=None
        Detection threshold :math:`\Gamma`.
    isolation_thresholds : dict of label to float or None, default=None
        Isolation threshold :math:`\Delta` of each condition. A threshold that is
        infinite, or that equals :math:`\Gamma`, is not drawn.
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
        The lines of the thresholds by label, in the order of the legend: first
        :math:`\Gamma`, then :math:`\Delta` from the lowest to the highest.
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
    model: Any = None
    condition: Any = None

    def __post_init__(self) -> None:
        self._name_conditions([self.condition])

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

        If the diagnoser has a single residual, all thresholds apply to it. If it has a
        bank, which is one model for each condition, :math:`\Delta` limits the residual
        of one model relative to the geometric mean of all residuals of the window. The
        plot therefore shows :math:`\Delta` multiplied by that mean. It shows
        :math:`\Gamma` for the healthy model only.

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
            All conditions. Their order determines their colours. If None, the healthy
            condition comes first and the others are sorted.
        ax : matplotlib Axes or None, default=None
            Axes to plot into. If None, new axes are created.

        Returns
        -------
        ResidualDisplay
            The display, after drawing.

        Raises
        ------
        ValueError
            If the estimator has no observer, a bank of observers, or no model of the
            condition `model`.
        """
        observer = estimator[-2]
        decide = estimator[-1]
        is_observer = offers(observer, "observe")
        expect(is_observer, "Step before the decision", observer, "an observer")
        n_observers = observer.n_observers
        expect(n_observers == 1, "n_observers", n_observers, "1 for each model")
        position, names = chosen_model(estimator, model)
        name = names[position]
        innovations = estimator[:-2].transform(np.asarray(window)[np.newaxis])
        levels = np.asarray(observer.transform(innovations))[0]
        fitted = known_conditions(estimator)
        gamma = decide.detection_threshold_
        deltas = isolation_thresholds(decide)
        if decide._is_bank():
            # The thresholds of a bank are relative to the geometric mean of all
            # residuals.
            gamma = gamma if name == str(fitted[0]) else None
            deltas = {name: deltas[name] * float(np.exp(log_level(levels).mean()))}
        trajectory = observer.observe(innovations)[_TRAJECTORIES[observer.evaluation]]
        return cls(
            trajectory[0, position],
            level=float(levels[position]),
            detection_threshold=gamma,
            isolation_thresholds=deltas,
            model=name,
            condition=condition,
            conditions=ordered_conditions([*fitted, condition], conditions),
        ).plot(ax=ax)

    def _draw(self, ax):
        of_window = "" if self.condition is None else f", window of {self.condition}"
        of_model = "" if self.model is None else f", model of {self.model}"
        self.line_: Any = ax.plot(
            self.residual,
            color=color_of(self.condition, self.conditions, other=ink()),
            linewidth=0.6,
            alpha=0.4,
            label=f"residual{of_window}{of_model}",
        )[0]

        def on_both_sides(value, **style):
            ax.axhline(-value, **style | {"label": None})
            return ax.axhline(value, **style)

        legend = []
        self.level_line_: Any = None
        if self.level is not None:
            self.level_line_ = on_both_sides(
                self.level, color=ink(), linewidth=2.4, label="level of the window"
            )
            legend.append(self.level_line_)
        self.threshold_lines_: dict[str, Any] = {}
        reach = np.abs(self.residual).max()
        for _, value, style in self._thresholds():
            line = on_both_sides(value, linewidth=1.4, **style)
            self.threshold_lines_[style["label"]] = line
            reach = max(reach, value)
        ax.set(
            xlabel="Sample", ylabel="Residual r(k)", xlim=(0, len(self.residual) - 1)
        )
        if reach > 0:
            ax.set_ylim(-1.08 * reach, 1.08 * reach)
        legend_beside(ax, [*legend, *self.threshold_lines_.values()])
        ax.set_title(self.line_.get_label(), fontsize="medium", loc="left")
