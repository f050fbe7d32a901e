"""Plots of the residual of one window, and of the levels of many, with the thresholds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import KW_ONLY, dataclass
from operator import itemgetter
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.pipeline import Pipeline

from ..core.state import expect
from ..decisions.ladder import ThresholdLadder
from ..kernels.ladder import log_level, relative_scores
from ..models.observers import Observer
from ..models.residual_evaluations import RESIDUAL_EVALUATIONS
from ._fitted import chosen_model, known_conditions, ordered_conditions
from ._style import (
    LINE,
    Axes,
    AxesDisplay,
    color_of,
    condition_styles,
    ink,
    legend_beside,
)

_DECISIONS = ("detection", "isolation")
#: Width of the gap between two conditions, as a share of the number of windows.
_GAP = 0.02


def isolation_thresholds(decide: ThresholdLadder) -> dict[str, float]:
    r"""Return the isolation threshold :math:`\Delta` of each condition of a fitted ladder.

    For a single residual the thresholds ascend: each is the upper end of the range of
    levels that is assigned to its condition, and the highest is infinite.
    """
    if decide._is_bank():
        names = decide.classes_
        deltas = decide.isolation_thresholds_
    else:
        names = decide.rungs_
        deltas = np.append(decide.isolation_thresholds_, np.inf)
    return dict(zip(names.astype(str).tolist(), deltas.tolist(), strict=True))


@dataclass(repr=False, eq=False)
class ThresholdDisplay(AxesDisplay):
    """Base of the displays with a detection threshold and isolation thresholds."""

    _: KW_ONLY
    detection_threshold: float | None = None
    isolation_thresholds: dict[Any, float] | None = None
    conditions: Sequence[Any] | None = None

    def _name_conditions(self, drawn: Sequence[Any]) -> None:
        """Convert names to text, and determine the order of the conditions."""
        deltas = self.isolation_thresholds or {}
        self.isolation_thresholds = {
            str(name): float(delta) for name, delta in deltas.items()
        }
        self.conditions = ordered_conditions(
            [*self.isolation_thresholds, *drawn], self.conditions
        )

    def _thresholds(self) -> Iterator[tuple[str | None, float, dict[str, Any]]]:
        r"""Yield condition, value and style of :math:`\Gamma`, and of each :math:`\Delta` upwards.

        A threshold that is infinite, or that equals :math:`\Gamma`, is left out.
        """
        gamma = self.detection_threshold
        styles = condition_styles(self.conditions)
        if gamma is not None:
            yield None, gamma, {"color": ink(), "linestyle": "--", "label": r"$\Gamma$"}
        for name, delta in sorted(self.isolation_thresholds.items(), key=itemgetter(1)):
            if np.isfinite(delta) and delta != gamma:
                style = {key: styles[name][key] for key in LINE}
                yield name, delta, style | {"label": rf"$\Delta$ {name}"}


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
            If the estimator has no observer or no model of the condition `model`, or if
            its residual evaluation does not measure the size of a trajectory
            ("whiteness").
        """
        observer = estimator[-2]
        decide = estimator[-1]
        is_observer = isinstance(observer, Observer)
        expect(is_observer, "Step before the decision", observer, "an observer")
        trajectory = RESIDUAL_EVALUATIONS[observer.evaluation].trajectory
        drawable = [
            name
            for name, evaluation in RESIDUAL_EVALUATIONS.items()
            if evaluation.trajectory
        ]
        expected = f"one of {drawable}"
        expect(trajectory is not None, "evaluation", observer.evaluation, expected)
        m, names = chosen_model(estimator, model)
        innovations = estimator[:-2].transform(np.asarray(window)[np.newaxis])
        levels = np.asarray(observer.transform(innovations))[0]
        fitted = known_conditions(estimator)
        gamma = decide.detection_threshold_
        deltas = isolation_thresholds(decide)
        if decide._is_bank():
            # The thresholds of a bank are relative to the geometric mean of all
            # residuals.
            gamma = gamma if names[m] == str(fitted[0]) else None
            mean = float(np.exp(log_level(levels).mean()))
            deltas = {names[m]: deltas[names[m]] * mean}
        residual = observer.observe(innovations)[trajectory][0, m]
        return cls(
            residual,
            level=float(levels[m]),
            detection_threshold=gamma,
            isolation_thresholds=deltas,
            model=names[m],
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

        self.level_line_: Any = None
        if self.level is not None:
            self.level_line_ = on_both_sides(
                self.level, color=ink(), linewidth=2.4, label="level of the window"
            )
        self.threshold_lines_: dict[str, Any] = {}
        reach = 1.08 * np.abs(self.residual).max()
        for _, value, style in self._thresholds():
            line = on_both_sides(value, linewidth=1.4, **style)
            self.threshold_lines_[style["label"]] = line
            reach = max(reach, 1.08 * value)
        ax.set(
            xlabel="Sample", ylabel="Residual r(k)", xlim=(0, len(self.residual) - 1)
        )
        if reach > 0:
            ax.set_ylim(-reach, reach)
        level = [] if self.level_line_ is None else [self.level_line_]
        legend_beside(ax, [*level, *self.threshold_lines_.values()])
        ax.set_title(self.line_.get_label(), fontsize="medium", loc="left")


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
        shown = [name for name in self.conditions if name in self.y]
        # Windows stand side by side, with a gap between two conditions.
        gap = _GAP * len(self.y)
        group = np.array([shown.index(name) for name in self.y])
        position = np.argsort(np.argsort(group, kind="stable")) + gap * group
        positions = {name: position[self.y == name] for name in shown}
        self.lines_: dict[str, Any] = {}
        for name in shown:
            style = styles[name] | {
                "markersize": 4.5,
                "markeredgewidth": 0,
                "linestyle": "none",
            }
            levels = self.levels[self.y == name]
            (self.lines_[name],) = ax.plot(positions[name], levels, **style)
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
