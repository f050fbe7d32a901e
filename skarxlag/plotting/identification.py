"""Measured and predicted output of one window, and the error between them."""

from collections.abc import Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..kernels.scaling import fit_percentage
from ._axes import new_axes, time_axis
from ._fitted import (
    chosen_model,
    condition_names,
    first_and_last,
    healthy_name,
    model_names,
    ordered_conditions,
)
from ._style import NEUTRAL, condition_styles, ink


class IdentificationDisplay:
    r"""Measured and predicted output of one window, and their error (Figures 7 and 8 of the paper).

    Parameters
    ----------
    output, prediction : ndarray of shape (n_samples,)
        In the sensor's unit.
    model : str or None, default=None
        Condition of the model that predicts.
    condition : str or None, default=None
        True condition of the window.
    conditions : list of str or None, default=None
        All conditions, in the order that gives them their colours.
    sampling_rate : float or None, default=None
        In Hz, for a time axis in ms. None: samples.

    Attributes
    ----------
    fit_percentage : float
        :math:`100\,(1 - \|y - \hat y\| / \|y - \bar y\|)`: 100 is exact, 0 no better than the
        mean.
    output_line_, prediction_line_, error_line_ : matplotlib Line2D
        What was drawn.
    axes_ : ndarray of matplotlib Axes of shape (2,)
        Output and prediction; error.
    figure_ : matplotlib Figure
        Where it was plotted.

    Examples
    --------
    >>> display = IdentificationDisplay.from_predictions([1.0, -1.0, 1.0], [0.5, -0.5, 0.5])
    >>> round(display.fit_percentage, 1)
    47.0
    """

    output_line_: Any
    prediction_line_: Any
    error_line_: Any
    axes_: NDArray[Any]
    figure_: Any

    def __init__(
        self,
        output: NDArray[Any],
        prediction: NDArray[Any],
        *,
        model: str | None = None,
        condition: str | None = None,
        conditions: list[str] | None = None,
        sampling_rate: float | None = None,
    ) -> None:
        self.output = output
        self.prediction = prediction
        self.model = model
        self.condition = condition
        self.conditions = conditions
        self.sampling_rate = sampling_rate

    @property
    def fit_percentage(self) -> Any:
        """How well the prediction reproduces the output, in percent."""
        return float(fit_percentage(self.output, self.prediction))

    @classmethod
    def from_estimator(
        cls,
        estimator: Any,
        window: ArrayLike,
        *,
        model: Any = None,
        free_run: bool = False,
        condition: Any = None,
        conditions: Sequence[Any] | None = None,
        sampling_rate: float | None = None,
        axes: Sequence[Any] | None = None,
    ) -> Self:
        """Plot what fitted models make of one window.

        Parameters
        ----------
        estimator : ARXLaguerre or Pipeline
            Fitted; of a Pipeline its first step is used.
        window : array-like of shape (n_samples,) or (n_channels, n_samples)
            The window.
        model : label or None, default=None
            Condition of the model. None: the only one, or that of the healthy condition that the
            last step of a Pipeline knows, or the first.
        free_run : bool, default=False
            Whether the model simulates the output from its inputs instead of predicting one step.
        condition : label or None, default=None
            True condition of the window, for its colour.
        conditions : sequence of label or None, default=None
            All conditions, in the order that gives them their colours. None: those of the models,
            the healthy one first.
        sampling_rate : float or None, default=None
            In Hz, for a time axis in ms. None: samples.
        axes : sequence of 2 matplotlib Axes or None, default=None
            Where to plot. None: new axes.

        Returns
        -------
        IdentificationDisplay
            With the plot.

        Raises
        ------
        ValueError
            If there is no such model.
        """
        identify, decide = first_and_last(estimator)
        names = model_names(identify)
        healthy = healthy_name(decide)
        m = chosen_model(names, model, healthy if healthy in names else names[0])
        prediction = identify.predict_output(np.asarray(window)[np.newaxis], free_run=free_run)
        known = [*condition_names(estimator), condition]
        return cls.from_predictions(
            np.atleast_2d(window)[0, -prediction.shape[-1] :],
            prediction[0, m],
            model=names[m],
            condition=condition,
            conditions=ordered_conditions(known, conditions),
            sampling_rate=sampling_rate,
            axes=axes,
        )

    @classmethod
    def from_predictions(
        cls,
        output: ArrayLike,
        prediction: ArrayLike,
        *,
        model: Any = None,
        condition: Any = None,
        conditions: Sequence[Any] | None = None,
        sampling_rate: float | None = None,
        axes: Sequence[Any] | None = None,
    ) -> Self:
        """Plot a prediction that one has.

        Parameters
        ----------
        output, prediction : array-like of shape (n_samples,)
            Measured and predicted output.
        model, condition : label or None, default=None
            Condition of the model, and the true one.
        conditions : sequence of label or None, default=None
            All conditions, in the order that gives them their colours. None: `condition` alone.
        sampling_rate : float or None, default=None
            In Hz, for a time axis in ms. None: samples.
        axes : sequence of 2 matplotlib Axes or None, default=None
            Where to plot. None: new axes.

        Returns
        -------
        IdentificationDisplay
            With the plot.

        Raises
        ------
        ValueError
            If the shapes do not fit, or `conditions` leaves out `condition`.
        """
        output, prediction = np.asarray(output), np.asarray(prediction)
        if output.ndim != 1 or output.shape != prediction.shape:
            raise ValueError(
                f"prediction has the shape {prediction.shape} and output {output.shape}, expected "
                "one shape for both: (n_samples,)."
            )
        display = cls(
            output,
            prediction,
            model=None if model is None else str(model),
            condition=None if condition is None else str(condition),
            conditions=ordered_conditions([condition], conditions),
            sampling_rate=sampling_rate,
        )
        return display.plot(axes=axes)

    def plot(self, axes: Sequence[Any] | None = None, **line_kw: Any) -> Self:
        """Plot.

        Parameters
        ----------
        axes : sequence of 2 matplotlib Axes or None, default=None
            Where to plot. None: new axes, one above the other.
        **line_kw : dict
            Passed to ``Axes.plot`` for the measured output.

        Returns
        -------
        IdentificationDisplay
            With the plot.
        """
        axes = new_axes(2) if axes is None else np.asarray(axes, dtype=object)
        styles = condition_styles(self.conditions or [])
        color = styles[self.condition]["color"] if self.condition in styles else NEUTRAL
        time, unit = time_axis(len(self.output), self.sampling_rate)
        style = {"color": color, "linewidth": 3, "alpha": 0.6, "label": "measured"} | line_kw
        by = "" if self.model is None else f", model of {self.model}"
        (self.output_line_,) = axes[0].plot(time, self.output, **style)
        (self.prediction_line_,) = axes[0].plot(
            time,
            self.prediction,
            color=ink(),
            linewidth=0.9,
            label=f"prediction{by}: fit {self.fit_percentage:.1f} %",
        )
        error = self.output - self.prediction
        (self.error_line_,) = axes[1].plot(time, error, color=color, linewidth=0.9)
        axes[0].legend(
            loc="lower left",
            bbox_to_anchor=(0, 1),
            ncols=2,
            fontsize="small",
            frameon=False,
            borderaxespad=0.2,
        )
        axes[0].set_ylabel("Output")
        axes[1].set(ylabel="Error", xlabel=unit, xlim=(time[0], time[-1]))
        self.axes_, self.figure_ = axes, axes[0].figure
        return self
