"""Plot of the trajectories of an observer on the innovations of one window."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.pipeline import Pipeline

from ._fitted import condition_names, observed, ordered_conditions
from ._style import ink
from ._window import TwoPanelDisplay, legend_above


@dataclass(repr=False, eq=False)
class TrajectoryDisplay(TwoPanelDisplay):
    r"""Plot the innovations, the output error and the fault estimate of an observer.

    The trajectories belong to one window and one model. The innovations :math:`\varepsilon` are the
    one-step prediction errors of the model. The output error e is the part of the innovations
    that remains after the observer's correction, and :math:`\hat\delta` is the observer's estimate
    of the fault (Eqs. 17-20).

    Parameters
    ----------
    innovations, error, fault_estimate : ndarray of shape (n_samples,)
        Trajectories of :math:`\varepsilon`, e and :math:`\hat\delta`, in the unit of the
        innovations.
    model : str or None, default=None
        Condition that the model was identified on.
    condition : str or None, default=None
        True condition of the window.
    conditions : list of str or None, default=None
        All conditions. Their order determines their colours.
    sampling_rate : float or None, default=None
        Sampling rate in Hz. If given, the time axis is in ms; if None, it counts samples.

    Attributes
    ----------
    innovations_line_, error_line_, fault_estimate_line_ : matplotlib Line2D
        The lines that were drawn.
    axes_ : ndarray of matplotlib Axes of shape (2,)
        The upper axes show innovations and error, the lower axes the fault estimate.
    figure_ : matplotlib Figure
        Figure that holds the plot.

    See Also
    --------
    IdentificationDisplay : Plot output and prediction; their difference is the innovations.

    Examples
    --------
    >>> import numpy as np
    >>> from skarxlag import make_alpio
    >>> X = np.random.default_rng(0).normal(size=(8, 600))
    >>> diagnoser = make_alpio(healthy="good").fit(X, np.repeat(["good", "worn"], 4))
    >>> display = TrajectoryDisplay.from_estimator(diagnoser, X[5])
    >>> display.model, len(display.axes_)
    ('good', 2)
    """

    innovations: NDArray[Any]
    error: NDArray[Any]
    fault_estimate: NDArray[Any]
    innovations_line_: Any = field(init=False)
    error_line_: Any = field(init=False)
    fault_estimate_line_: Any = field(init=False)

    @classmethod
    def from_estimator(
        cls,
        estimator: Pipeline,
        window: ArrayLike,
        *,
        model: Any = None,
        condition: Any = None,
        conditions: Sequence[Any] | None = None,
        sampling_rate: float | None = None,
        axes: Sequence[Any] | NDArray[Any] | None = None,
    ) -> Self:
        """Run the observer of a fitted diagnoser on one window, and plot its trajectories.

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
        sampling_rate : float or None, default=None
            Sampling rate in Hz. If given, the time axis is in ms; if None, it counts samples.
        axes : sequence of 2 matplotlib Axes or None, default=None
            Axes to plot into. If None, new axes are created.

        Returns
        -------
        TrajectoryDisplay
            The display, after drawing.

        Raises
        ------
        ValueError
            If the estimator has no observer, or no model of the condition `model`.
        """
        name, m, paths, _ = observed(estimator, window, model)
        return cls.from_predictions(
            paths.innovations[0, m],
            paths.error[0, m],
            paths.fault_estimate[0, m],
            model=name,
            condition=condition,
            conditions=ordered_conditions([*condition_names(estimator), condition], conditions),
            sampling_rate=sampling_rate,
            axes=axes,
        )

    @classmethod
    def from_predictions(
        cls,
        innovations: ArrayLike,
        error: ArrayLike,
        fault_estimate: ArrayLike,
        *,
        model: Any = None,
        condition: Any = None,
        conditions: Sequence[Any] | None = None,
        sampling_rate: float | None = None,
        axes: Sequence[Any] | NDArray[Any] | None = None,
    ) -> Self:
        """Plot trajectories that were computed elsewhere.

        Parameters
        ----------
        innovations, error, fault_estimate : array-like of shape (n_samples,)
            Trajectories of the innovations, the output error and the fault estimate.
        model, condition : label or None, default=None
            Condition that the model was identified on, and true condition of the window.
        conditions : sequence of label or None, default=None
            All conditions. Their order determines their colours. If None, `condition` alone.
        sampling_rate : float or None, default=None
            Sampling rate in Hz. If given, the time axis is in ms; if None, it counts samples.
        axes : sequence of 2 matplotlib Axes or None, default=None
            Axes to plot into. If None, new axes are created.

        Returns
        -------
        TrajectoryDisplay
            The display, after drawing.

        Raises
        ------
        ValueError
            If the shapes differ, or `conditions` does not contain `condition`.
        """
        paths = [np.asarray(path) for path in (innovations, error, fault_estimate)]
        shapes = [path.shape for path in paths]
        if paths[0].ndim != 1 or len(set(shapes)) > 1:
            raise ValueError(
                f"innovations, error and fault_estimate have the shapes {shapes}, expected one for "
                "all: (n_samples,)."
            )
        display = cls._of(
            *paths,
            model=model,
            condition=condition,
            conditions=conditions,
            sampling_rate=sampling_rate,
        )
        return display.plot(axes=axes)

    def plot(self, axes: Sequence[Any] | NDArray[Any] | None = None, **line_kw: Any) -> Self:
        """Draw the plot.

        Parameters
        ----------
        axes : sequence of 2 matplotlib Axes or None, default=None
            Axes to plot into. If None, new axes are created, one above the other.
        **line_kw : dict
            Keyword arguments that ``Axes.plot`` receives for the fault estimate.

        Returns
        -------
        TrajectoryDisplay
            The display, after drawing.
        """
        time, upper, lower = self._panels(axes, len(self.innovations))
        color = self._color()
        (self.innovations_line_,) = upper.plot(
            time, self.innovations, color=ink(), linewidth=0.8, label=self._of_model("innovations")
        )
        (self.error_line_,) = upper.plot(
            time, self.error, color=color, linewidth=0.8, label="output error of the observer"
        )
        style = {"color": color, "linewidth": 0.9} | line_kw
        (self.fault_estimate_line_,) = lower.plot(time, self.fault_estimate, **style)
        legend_above(upper)
        upper.set_ylabel("Innovations, error")
        lower.set_ylabel("Fault estimate")
        return self
