"""Plot of the measured and the predicted output of one window, and of the prediction error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..kernels.scaling import fit_percentage
from ._fitted import (
    chosen_model,
    condition_names,
    first_and_last,
    healthy_name,
    model_names,
    ordered_conditions,
)
from ._style import ink
from ._window import TwoPanelDisplay, legend_above


@dataclass(repr=False, eq=False)
class IdentificationDisplay(TwoPanelDisplay):
    r"""Plot the measured and the predicted output of one window, and the prediction error.

    Figures 7 and 8 of the paper are of this kind.

    Parameters
    ----------
    output, prediction : ndarray of shape (n_samples,)
        Measured and predicted output, in the unit of the sensor.
    model : str or None, default=None
        Condition that the predicting model was identified on.
    condition : str or None, default=None
        True condition of the window.
    conditions : list of str or None, default=None
        All conditions. Their order determines their colours.
    sampling_rate : float or None, default=None
        Sampling rate in Hz. If given, the time axis is in ms; if None, it counts samples.

    Attributes
    ----------
    fit_percentage : float
        :math:`100\,(1 - \|y - \hat y\| / \|y - \bar y\|)`, where :math:`y` is the output,
        :math:`\hat y` the prediction and :math:`\bar y` the mean of the output. A value of 100
        means an exact prediction. A value of 0 means one that is no better than the mean.
    output_line_, prediction_line_, error_line_ : matplotlib Line2D
        The lines that were drawn.
    axes_ : ndarray of matplotlib Axes of shape (2,)
        The upper axes show output and prediction, the lower axes the error.
    figure_ : matplotlib Figure
        Figure that holds the plot.

    Examples
    --------
    >>> display = IdentificationDisplay.from_predictions([1.0, -1.0, 1.0], [0.5, -0.5, 0.5])
    >>> round(display.fit_percentage, 1)
    47.0
    """

    output: NDArray[Any]
    prediction: NDArray[Any]
    output_line_: Any = field(init=False)
    prediction_line_: Any = field(init=False)
    error_line_: Any = field(init=False)

    @property
    def fit_percentage(self) -> float:
        """Agreement of the prediction with the output, in percent."""
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
        axes: Sequence[Any] | NDArray[Any] | None = None,
    ) -> Self:
        """Predict one window with a model of a fitted estimator, and plot the prediction.

        Parameters
        ----------
        estimator : ARXLaguerre or Pipeline
            Fitted estimator. Only the first step of a Pipeline predicts.
        window : array-like of shape (n_samples,) or (n_channels, n_samples)
            The window.
        model : label or None, default=None
            Condition whose model predicts. If None and there is only one model, that model is
            used. If None and there are several, the model of the healthy condition is used if the
            last step of a Pipeline knows that condition, and otherwise the first model.
        free_run : bool, default=False
            If True, the model simulates the output from the inputs and the first samples of the
            output (the transient). If False, it predicts each sample one step ahead from all
            measured samples before it.
        condition : label or None, default=None
            True condition of the window. It determines the colour of the lines.
        conditions : sequence of label or None, default=None
            All conditions. Their order determines their colours. If None, the conditions of the
            models, the healthy one first.
        sampling_rate : float or None, default=None
            Sampling rate in Hz. If given, the time axis is in ms; if None, it counts samples.
        axes : sequence of 2 matplotlib Axes or None, default=None
            Axes to plot into. If None, new axes are created.

        Returns
        -------
        IdentificationDisplay
            The display, after drawing.

        Raises
        ------
        ValueError
            If the estimator has no model of the condition `model`.
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
        axes: Sequence[Any] | NDArray[Any] | None = None,
    ) -> Self:
        """Plot a prediction that was computed elsewhere.

        Parameters
        ----------
        output, prediction : array-like of shape (n_samples,)
            Measured and predicted output.
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
        IdentificationDisplay
            The display, after drawing.

        Raises
        ------
        ValueError
            If the shapes differ, or `conditions` does not contain `condition`.
        """
        output, prediction = np.asarray(output), np.asarray(prediction)
        if output.ndim != 1 or output.shape != prediction.shape:
            raise ValueError(
                f"prediction has the shape {prediction.shape} and output {output.shape}, expected "
                "one shape for both: (n_samples,)."
            )
        display = cls._of(
            output,
            prediction,
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
            Keyword arguments that ``Axes.plot`` receives for the measured output.

        Returns
        -------
        IdentificationDisplay
            The display, after drawing.
        """
        time, upper, lower = self._panels(axes, len(self.output))
        color = self._color()
        style = {"color": color, "linewidth": 3, "alpha": 0.6, "label": "measured"} | line_kw
        (self.output_line_,) = upper.plot(time, self.output, **style)
        label = f"{self._of_model('prediction')}: fit {self.fit_percentage:.1f} %"
        (self.prediction_line_,) = upper.plot(
            time, self.prediction, color=ink(), linewidth=0.9, label=label
        )
        error = self.output - self.prediction
        (self.error_line_,) = lower.plot(time, error, color=color, linewidth=0.9)
        legend_above(upper)
        upper.set_ylabel("Output")
        lower.set_ylabel("Error")
        return self
