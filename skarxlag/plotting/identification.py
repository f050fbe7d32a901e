"""Plot of the measured and the predicted output of one window, and of the prediction error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..core.capabilities import unfolded_steps
from ..kernels.scaling import fit_percentage
from ._fitted import chosen_model, known_conditions, ordered_conditions
from ._style import LEGEND, Display, color_of, ink


@dataclass(repr=False, eq=False)
class IdentificationDisplay(Display):
    r"""Plot the measured and the predicted output of one window, and the prediction error.

    Figures 7 and 8 of the paper are of this kind.

    Parameters
    ----------
    output, prediction : array-like of shape (n_samples,)
        Measured and predicted output, in the unit of the sensor.
    model : label or None, default=None
        Condition that the predicting model was identified on.
    condition : label or None, default=None
        True condition of the window.
    conditions : sequence of label or None, default=None
        All conditions. Their order determines their colours. If None, `condition`
        alone.
    sampling_rate : float or None, default=None
        Sampling rate in Hz. If given, the time axis is in ms; if None, it counts
        samples.

    Attributes
    ----------
    fit_percentage : float
        :math:`100\,(1 - \|y - \hat y\| / \|y - \bar y\|)`, where :math:`y` is the
        output, :math:`\hat y` the prediction and :math:`\bar y` the mean of the output.
        A value of 100 means an exact prediction. A value of 0 means one that is no
        better than the mean.
    output_line_, prediction_line_, error_line_ : matplotlib Line2D
        The lines that were drawn.
    axes_ : ndarray of matplotlib Axes of shape (2,)
        The upper axes show output and prediction, the lower axes the error.
    figure_ : matplotlib Figure
        Figure that holds the plot.

    Examples
    --------
    >>> display = IdentificationDisplay([1.0, -1.0, 1.0], [0.5, -0.5, 0.5])
    >>> round(display.plot().fit_percentage, 1)
    47.0
    """

    output: ArrayLike
    prediction: ArrayLike
    _: KW_ONLY
    model: Any = None
    condition: Any = None
    conditions: Sequence[Any] | None = None
    sampling_rate: float | None = None

    def __post_init__(self) -> None:
        self.output = np.asarray(self.output)
        self.prediction = np.asarray(self.prediction)
        self.conditions = ordered_conditions([self.condition], self.conditions)

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
            Condition whose model predicts. If None, the healthy condition if it has a
            model, and otherwise the first model.
        condition : label or None, default=None
            True condition of the window. It determines the colour of the lines.
        conditions : sequence of label or None, default=None
            All conditions. Their order determines their colours. If None, the
            conditions of the models, the healthy one first.
        sampling_rate : float or None, default=None
            Sampling rate in Hz. If given, the time axis is in ms; if None, it counts
            samples.
        axes : sequence of 2 matplotlib Axes or None, default=None
            Axes to plot into. If None, new axes are created.

        Returns
        -------
        IdentificationDisplay
            The display, after drawing.

        Raises
        ------
        ValueError
            If the estimator has no model of the condition `model`, or `conditions`
            omits one.
        """
        m, names = chosen_model(estimator, model)
        identify = unfolded_steps(estimator)[0]
        prediction = identify.predict_output(np.asarray(window)[np.newaxis])
        fitted = known_conditions(estimator) or (names if len(names) > 1 else [])
        output = np.atleast_2d(window)[0, -prediction.shape[-1] :]
        return cls(
            output,
            prediction[0, m],
            model=names[m],
            condition=condition,
            conditions=ordered_conditions([*fitted, condition], conditions),
            sampling_rate=sampling_rate,
        ).plot(axes=axes)

    def plot(self, axes: Sequence[Any] | NDArray[Any] | None = None) -> Self:
        """Draw the plot.

        Parameters
        ----------
        axes : sequence of 2 matplotlib Axes or None, default=None
            Axes to plot into. If None, new axes are created, one above the other.

        Returns
        -------
        IdentificationDisplay
            The display, after drawing.
        """
        upper, lower = self._set_axes(axes, 2)
        time = np.arange(len(self.output))
        if self.sampling_rate is not None:
            time = 1e3 / self.sampling_rate * time
        color = color_of(self.condition, self.conditions)
        self.output_line_: Any = upper.plot(
            time, self.output, color=color, linewidth=3, alpha=0.6, label="measured"
        )[0]
        of_model = "" if self.model is None else f", model of {self.model}"
        label = f"prediction{of_model}: fit {self.fit_percentage:.1f} %"
        self.prediction_line_: Any = upper.plot(
            time, self.prediction, color=ink(), linewidth=0.9, label=label
        )[0]
        error = self.output - self.prediction
        self.error_line_: Any = lower.plot(time, error, color=color, linewidth=0.9)[0]
        upper.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2, **LEGEND)
        upper.set_ylabel("Output")
        xlabel = "Sample" if self.sampling_rate is None else "Time (ms)"
        lower.set(ylabel="Error", xlabel=xlabel, xlim=(time[0], time[-1]))
        return self
