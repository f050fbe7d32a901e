"""Figures 7, 8 and 10-19 of Piltan and Kim (2019), drawn from a rig and a fitted diagnoser.

They are drawn without pyplot, so no backend is chosen for the user.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.pipeline import Pipeline
from sklearn.utils import Bunch

from ..plotting import (
    IdentificationDisplay,
    ResidualDisplay,
    ThresholdLadderDisplay,
    condition_styles,
)
from ..plotting._fitted import model_names

#: The figure of the paper that shows the residual of each condition.
RESIDUAL_FIGURES = {
    "Normal": 12,
    "Ball": 13,
    "IR": 14,
    "OR": 15,
    "IR-Ball": 16,
    "OR-Ball": 17,
    "IR-OR": 18,
    "IR-OR-Ball": 19,
}
_SHOWN_SAMPLES = 320
_BINS = 800


def new_figure(title: str, width: float, height: float) -> Any:
    """A figure with a title, outside pyplot.

    Parameters
    ----------
    title : str
        Stands over the figure.
    width, height : float
        In inches.

    Returns
    -------
    matplotlib Figure
        Empty.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    figure.suptitle(title, fontsize="medium")
    return figure


def identification_figure(
    diagnoser: Pipeline, rig: Bunch, condition: str, window: NDArray[Any], title: str
) -> Any:
    """Figures 7 and 8: output of one window, prediction by the healthy model, and their error.

    Parameters
    ----------
    diagnoser : Pipeline
        Fitted.
    rig : Bunch
        As `skarxlag.datasets` returns it.
    condition : str
        True condition of the window.
    window : ndarray of shape (n_samples,) or (n_channels, n_samples)
        The window, of which the first 320 samples are drawn.
    title : str
        Stands over the figure.

    Returns
    -------
    matplotlib Figure
        Two axes.
    """
    figure = new_figure(f"{title}, window of {condition}", 9, 4.6)
    IdentificationDisplay.from_estimator(
        diagnoser,
        window[..., :_SHOWN_SAMPLES],
        condition=condition,
        conditions=rig.target_names,
        sampling_rate=rig.sampling_rate,
        axes=figure.subplots(2, sharex=True),
    )
    return figure


def raw_signal_figure(rig: Bunch, rpm: float, title: str) -> Any:
    """Figure 10: the first recording of each condition at one speed, all samples of it.

    Each signal is drawn as the area between the smallest and the largest sample of each of 800
    stretches of time, so no peak is lost.

    Parameters
    ----------
    rig : Bunch
        As `skarxlag.datasets` returns it.
    rpm : float
        Shaft speed.
    title : str
        Stands over the figure.

    Returns
    -------
    matplotlib Figure
        One axes for each condition.
    """
    names = rig.target_names
    figure = new_figure(f"{title}, {rpm:g} rpm", 9, 0.9 + 0.85 * len(names))
    styles = condition_styles(names)
    all_axes = figure.subplots(len(names), sharex=True, sharey=True, squeeze=False)[:, 0]
    for ax, name in zip(all_axes, names, strict=True):
        chosen = (rig.target == name) & (rig.rpm == rpm)
        chosen &= rig.recording == rig.recording[chosen][0]
        windows = rig.data[chosen][np.argsort(rig.start[chosen])]
        signal = (windows[:, 0] if windows.ndim == 3 else windows).ravel()
        begins = np.unique(np.linspace(0, len(signal), _BINS, endpoint=False).astype(int))
        low, high = (each.reduceat(signal, begins) for each in (np.minimum, np.maximum))
        color = styles[name]["color"]
        time = begins / rig.sampling_rate
        ax.fill_between(time, low, high, color=color, linewidth=0.5, step="post")
        ax.set_title(name, fontsize="small", loc="left", pad=2)
        ax.set_xlim(0, len(signal) / rig.sampling_rate)
    figure.supylabel("Output", fontsize="medium")
    all_axes[-1].set_xlabel("Time (s)")
    return figure


def detection_figure(diagnoser: Pipeline, rig: Bunch, chosen: NDArray[Any], title: str) -> Any:
    """Figure 11: level of the healthy model's residual in many windows, and Gamma.

    Parameters
    ----------
    diagnoser : Pipeline
        Fitted.
    rig : Bunch
        As `skarxlag.datasets` returns it.
    chosen : ndarray of int
        Windows.
    title : str
        Stands over the figure.

    Returns
    -------
    matplotlib Figure
        One axes.
    """
    return _ladder_figure(diagnoser, rig, chosen, title, "detection")


def isolation_figure(diagnoser: Any, rig: Any, chosen: Any, title: Any) -> Any:
    """All Deltas over the same windows; parameters as `detection_figure` has them."""
    return _ladder_figure(diagnoser, rig, chosen, title, "isolation")


def _ladder_figure(diagnoser, rig, chosen, title, decision):
    figure = new_figure(title, 9, 4.4)
    ThresholdLadderDisplay.from_estimator(
        diagnoser,
        rig.data[chosen],
        rig.target[chosen],
        decision=decision,
        conditions=rig.target_names,
        ax=figure.subplots(),
    )
    return figure


def residual_figure(diagnoser: Pipeline, rig: Bunch, windows: dict[str, Any], title: str) -> Any:
    """Figures 12-19: residual of one window of each condition with the ladder's thresholds.

    Parameters
    ----------
    diagnoser : Pipeline
        Fitted, with an observer.
    rig : Bunch
        As `skarxlag.datasets` returns it.
    windows : dict of str to ndarray
        A window of each condition that is to be drawn.
    title : str
        Stands over the figure.

    Returns
    -------
    matplotlib Figure
        For each condition the residual of the healthy model; of a bank beside it that of the
        condition's own.
    """
    healthy, models = rig.target_names[0], model_names(diagnoser[0])
    columns = [healthy, None] if len(models) > 1 else [None]
    figure = new_figure(title, 1.5 + 7 * len(columns), 0.6 + 2.6 * len(windows))
    all_axes = figure.subplots(len(windows), len(columns), sharex=True, squeeze=False)
    for row, (condition, window) in zip(all_axes, windows.items(), strict=True):
        for ax, model in zip(row, columns, strict=True):
            if model is None and len(models) > 1:
                model = condition
                if condition == healthy:
                    ax.set_axis_off()
                    continue
            ResidualDisplay.from_estimator(
                diagnoser,
                window,
                model=model,
                condition=condition,
                conditions=rig.target_names,
                ax=ax,
            )
    for ax in all_axes[:-1].ravel():
        ax.set_xlabel("")
    return figure
