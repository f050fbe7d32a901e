"""What a fitted diagnoser makes of one window, as figures."""

import numpy as np

from ..kernels.ladder import log_level
from ._axes import new_axes


class ResidualDisplay:
    r"""Residual of one window for each model, with the thresholds that it is compared with.

    For "switching_gain" the residual is :math:`r = K_s\,\mathrm{sgn}(S)`, whose size the thresholds
    bound; for "power" it is the error e, whose root-mean-square they bound.

    Parameters
    ----------
    residuals : ndarray of shape (n_models, n_samples)
        Trajectories, in the unit of the innovations.
    models : list of str
        Name of each model.
    thresholds : dict of str to dict of str to float
        For each model the thresholds on its residual, by their label.
    healthy : str
        The model that `plot` shows if not told otherwise.

    Attributes
    ----------
    line_ : matplotlib Line2D
        The residual.
    threshold_lines_ : dict of str to matplotlib Line2D
        The thresholds; each is drawn on both sides of zero.
    ax_, figure_ : matplotlib Axes and Figure
        Where it was plotted.

    Examples
    --------
    >>> import numpy as np
    >>> from skarxlag import make_alpio
    >>> X = np.random.default_rng(0).normal(size=(8, 600))
    >>> diagnoser = make_alpio(healthy="good").fit(X, np.repeat(["good", "worn"], 4))
    >>> display = ResidualDisplay.from_estimator(diagnoser, X[5], model="worn")
    >>> list(display.threshold_lines_)
    ['$\\Delta$ of worn']
    """

    def __init__(self, residuals, *, models, thresholds, healthy):
        self.residuals = residuals
        self.models = models
        self.thresholds = thresholds
        self.healthy = healthy

    @classmethod
    def from_estimator(cls, estimator, window, *, model=None, ax=None):
        r"""Plot the residual of a fitted diagnoser on one window.

        A bank's threshold :math:`\Delta` bounds the residual relative to the geometric mean of all
        of the window's residuals, so it is drawn times that mean.

        Parameters
        ----------
        estimator : Pipeline
            Fitted; its last steps are an observer, and a ThresholdLadder or FaultDetector.
        window : array-like of shape (n_samples,) or (n_channels, n_samples)
            The window.
        model : str or None, default=None
            Condition of the model to show. None: the healthy one.
        ax : matplotlib Axes or None, default=None
            Where to plot. None: new axes.

        Returns
        -------
        ResidualDisplay
            With the plot.

        Raises
        ------
        ValueError
            If there is no observer, its evaluation is "whiteness", which is no bound on a
            trajectory, or there is no such model.
        """
        observer, decide = _observer(estimator), estimator[-1]
        if observer.evaluation == "whiteness":
            raise ValueError(
                "evaluation='whiteness' compares spectra, there is no residual trajectory to show; "
                "expected 'power' or 'switching_gain'."
            )
        innovations = estimator[:-2].transform(np.asarray(window)[np.newaxis])
        trajectories = observer.observe(innovations)
        key = "error" if observer.evaluation == "power" else "residual"
        models, healthy = _model_names(estimator)
        display = cls(
            trajectories[key][0],
            models=models,
            thresholds=_thresholds(decide, np.asarray(observer.transform(innovations))[0], models),
            healthy=healthy,
        )
        return display.plot(ax=ax, model=model)

    def plot(self, ax=None, *, model=None, **line_kw):
        """Plot the residual of one model.

        Parameters
        ----------
        ax : matplotlib Axes or None, default=None
            Where to plot. None: new axes.
        model : str or None, default=None
            Which. None: the healthy one.
        **line_kw : dict
            Passed to ``Axes.plot`` for the residual.

        Returns
        -------
        ResidualDisplay
            With the plot.
        """
        model = self.healthy if model is None else model
        residual = self.residuals[_position(self.models, model)]
        ax = new_axes(1)[0] if ax is None else ax
        style = {"linewidth": 0.6, "color": "0.45", "label": f"residual of {model}"} | line_kw
        (self.line_,) = ax.plot(residual, **style)
        self.threshold_lines_ = {}
        for number, (label, value) in enumerate(self.thresholds[str(model)].items()):
            style = {"color": f"C{number}", "linestyle": "--", "linewidth": 1.2}
            self.threshold_lines_[label] = ax.axhline(value, label=label, **style)
            ax.axhline(-value, **style)
        reach = 2 * np.max(np.abs([*residual, *self.thresholds[str(model)].values()]))
        ax.set(xlabel="Sample", ylabel="Residual")
        if reach > 0:
            ax.set_ylim(-reach, reach)
        ax.legend(loc="upper center", ncols=3, fontsize="small")
        self.ax_, self.figure_ = ax, ax.figure
        return self


class TrajectoryDisplay:
    """Output and one-step prediction of one window, innovations and fault estimate of one model.

    Parameters
    ----------
    output, prediction : ndarray of shape (n_samples,)
        In the sensor's unit.
    innovations, fault_estimate : ndarray of shape (n_samples,)
        In the unit that the observer sees.
    model : str
        Name of the model.

    Attributes
    ----------
    axes_ : ndarray of matplotlib Axes of shape (3,)
        Output, innovations, fault estimate.
    figure_ : matplotlib Figure
        Where it was plotted.

    Examples
    --------
    >>> import numpy as np
    >>> from skarxlag import make_alpio
    >>> X = np.random.default_rng(0).normal(size=(8, 600))
    >>> diagnoser = make_alpio(healthy="good").fit(X, np.repeat(["good", "worn"], 4))
    >>> display = TrajectoryDisplay.from_estimator(diagnoser, X[5])
    >>> display.model, len(display.axes_)
    ('good', 3)
    """

    def __init__(self, output, prediction, innovations, fault_estimate, *, model):
        self.output = output
        self.prediction = prediction
        self.innovations = innovations
        self.fault_estimate = fault_estimate
        self.model = model

    @classmethod
    def from_estimator(cls, estimator, window, *, model=None, axes=None):
        """Plot what a fitted diagnoser makes of one window.

        Parameters
        ----------
        estimator : Pipeline
            Fitted; an ARXLaguerre, an observer, and a ThresholdLadder or FaultDetector.
        window : array-like of shape (n_samples,) or (n_channels, n_samples)
            The window.
        model : str or None, default=None
            Condition of the model. None: the healthy one.
        axes : sequence of 3 matplotlib Axes or None, default=None
            Where to plot. None: new axes.

        Returns
        -------
        TrajectoryDisplay
            With the plot.

        Raises
        ------
        ValueError
            If there is no observer or no such model.
        """
        identify, observer = estimator[0], _observer(estimator)
        windows = np.asarray(window)[np.newaxis]
        models, healthy = _model_names(estimator)
        model = healthy if model is None else model
        m = _position(models, model)
        prediction = identify.predict_output(windows)[0, m]
        innovations = identify.transform(windows)
        display = cls(
            np.atleast_2d(window)[0, -len(prediction) :],
            prediction,
            innovations[0, m],
            observer.observe(innovations).fault_estimate[0, m],
            model=model,
        )
        return display.plot(axes=axes)

    def plot(self, axes=None):
        """Plot.

        Parameters
        ----------
        axes : sequence of 3 matplotlib Axes or None, default=None
            Where to plot. None: new axes, one above the other.

        Returns
        -------
        TrajectoryDisplay
            With the plot.
        """
        axes = new_axes(3) if axes is None else np.asarray(axes, dtype=object)
        axes[0].plot(self.output, linewidth=1.0, color="0.45", label="measured")
        axes[0].plot(
            self.prediction, linewidth=0.9, linestyle="--", color="C3", label="one-step prediction"
        )
        axes[0].legend(loc="upper right", fontsize="small")
        axes[0].set_ylabel("Output")
        axes[1].plot(self.innovations, linewidth=0.8, color="C0")
        axes[1].set_ylabel("Innovations")
        axes[2].plot(self.fault_estimate, linewidth=0.8, color="C1")
        axes[2].set(ylabel="Fault estimate", xlabel="Sample")
        self.axes_, self.figure_ = axes, axes[0].figure
        return self


def _observer(estimator):
    observer = estimator[-2]
    if not hasattr(observer, "observe"):
        raise ValueError(
            f"estimator has {type(observer).__name__} before its decision, expected an observer, "
            "which has trajectories to show."
        )
    return observer


def _model_names(estimator):
    """Names of the models, and of the healthy one."""
    models = [str(name) for name in estimator[0].classes_]
    decide = estimator[-1]
    if len(models) == 1:
        return models, models[0]
    return models, str(decide.classes_[decide.healthy_index_])


def _position(models, model):
    if str(model) not in models:
        raise ValueError(f"model={model!r} is not a model of the diagnoser, which has {models}.")
    return models.index(str(model))


def _thresholds(decide, levels, models):
    """Thresholds on the residual of each model, for one window with these levels."""
    gamma = {r"$\Gamma$ (detection)": decide.detection_threshold_}
    if not hasattr(decide, "isolation_thresholds_"):
        return dict.fromkeys(models, gamma)
    classes = [str(name) for name in decide.classes_]
    if len(models) == 1:
        # The cut above a healthy condition of lowest level is Gamma itself.
        cuts = dict(
            zip(
                (rf"$\Delta$ (below {rung})" for rung in decide.rungs_[1:]),
                decide.isolation_thresholds_,
                strict=True,
            )
        )
        return {models[0]: gamma | cuts}
    scale = np.exp(log_level(levels).mean())
    deltas = dict(zip(classes, decide.isolation_thresholds_ * scale, strict=True))
    thresholds = {model: {rf"$\Delta$ of {model}": deltas[model]} for model in models}
    return {
        model: gamma | own if model == classes[decide.healthy_index_] else own
        for model, own in thresholds.items()
    }
