"""Figures of a row next to what a model learned of its conditions."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.state import estimators_within, is_fitted
from ...decisions.order_comparison import order_comparison
from ...distances.comparison import SpectralDistance
from ...kernels.fault_orders import NEPER_IN_DB
from ...kernels.speed_references import reference_weights
from ...measures.spectra import LogSpectra
from ...models.identification import ARXLaguerre
from .figures import Axis, Figure, Mark, curve

#: Group of log spectra that is drawn.
_GROUP = "spectral_shape"


def order_references_figure(
    diagnoser: Any, row: NDArray[Any], rpm: Any, healthy: Any
) -> Figure:
    """Draw the order spectrum of a row next to those of the healthy and the nearest condition.

    Parameters
    ----------
    diagnoser : Pipeline
        Fitted.
    row : ndarray of shape (n_samples,) or (n_channels, n_samples)
        The row.
    rpm : float, ndarray of shape (n_samples,) or None
        Its speed.
    healthy : label or None
        The healthy condition.

    Raises
    ------
    ValueError
        If the diagnoser compares no order spectra, or not those of this row.
    """
    before, residual = order_comparison(diagnoser)
    X = row[np.newaxis]
    levels = X if before is None else before.transform(X)
    speeds = None if rpm is None else np.asarray(rpm)[np.newaxis]
    match = residual.match(levels, rpm=speeds)
    nearest = int(match.residuals[0].argmin())
    spectrum = match.spectra[0, nearest].mean(axis=0)
    references = residual.references_.mean(axis=1)
    names = residual.classes_.astype(str).tolist()
    shown = {names[nearest]: ("rest", references[nearest])}
    if str(healthy) in names:
        shown[str(healthy)] = ("reference", references[names.index(str(healthy))])
    curves = {"this recording": ("signal", spectrum)}
    curves |= {f"learned: {name}": drawn for name, drawn in shown.items()}
    x = Axis("Shaft order", 0.0, float(residual.orders_[-1]))
    levels_in_db = {name: NEPER_IN_DB * values for name, (_, values) in curves.items()}
    y = Axis.around("Power (dB over the median)", *levels_in_db.values())
    at = x.share(residual.orders_)
    marks = [
        Mark(curve(at, y.share(levels_in_db[name])), style, name)
        for name, (style, _) in curves.items()
    ]
    factor = float(match.factors[0, nearest])
    note = (
        f"The speed that fits best is {100 * (factor - 1):+.1f} % from the stated one."
    )
    if rpm is None:
        note = ""
    title = "Order spectrum of a row next to those of the model"
    return Figure(title, x, y, marks, note=note)


def shape_reference_figure(
    diagnoser: Any,
    row: NDArray[Any],
    rpm: float | None,
    healthy: Any,
    sampling_rate: float | None,
) -> Figure:
    """Draw the spectral shape of a row next to that of the healthy rows of `fit`.

    Parameters
    ----------
    diagnoser : estimator
        Fitted.
    row : ndarray of shape (n_samples,) or (n_channels, n_samples)
        The row.
    rpm : float or None
        Its mean speed, at which the reference is interpolated; None: at the mean
        training speed.
    healthy : label or None
        The healthy condition.
    sampling_rate : float or None
        In Hz.

    Raises
    ------
    ValueError
        If the diagnoser compares no spectral shapes, or has no healthy condition.
    """
    identify = _fitted_part(diagnoser, ARXLaguerre)
    measure = _fitted_part(diagnoser, LogSpectra)
    distance = _fitted_part(diagnoser, SpectralDistance)
    names = distance.classes_.astype(str).tolist()
    condition = names.index(str(healthy))
    group = measure.get_feature_names_out().tolist().index(_GROUP)
    innovations = identify.transform(row[np.newaxis])[0]
    # A stretch is measured in windows of the length that `fit` had.
    length = int(measure.window_shape_[-1])
    n_windows = innovations.shape[-1] // length
    windows = innovations[:, : n_windows * length].reshape(-1, n_windows, length)
    shape = measure.transform(windows.swapaxes(0, 1))[:, group].mean(axis=0)
    reference = healthy_shape(distance, rpm, condition, group)
    levels = [NEPER_IN_DB * (shape - shape.mean()), NEPER_IN_DB * reference]
    highest = 0.5 if sampling_rate is None else sampling_rate / 2
    unit = "1/sample" if sampling_rate is None else "Hz"
    x = Axis(f"Frequency ({unit})", 0.0, highest)
    y = Axis.around("Power (dB over the mean)", *levels)
    at = (np.arange(len(shape)) + 0.5) / len(shape)
    marks = [
        Mark(curve(at, y.share(levels[1])), "reference", f"learned: {healthy}"),
        Mark(curve(at, y.share(levels[0])), "signal", "this recording"),
    ]
    title = "Spectral shape of the innovations next to that of the model"
    return Figure(title, x, y, marks)


def healthy_shape(
    distance: SpectralDistance, rpm: float | None, condition: int, group: int
) -> NDArray[Any]:
    """Return the mean log spectrum of a condition at a speed, without its gain.

    Parameters
    ----------
    distance : SpectralDistance
        Fitted.
    rpm : float or None
        The speed; None: the mean of those of `fit`.
    condition, group : int
        Positions of the condition and of the group of log spectra.

    Returns
    -------
    ndarray of shape (n_frequencies,)
        In nepers of power.
    """
    log_speeds = np.log(distance.speeds_) if len(distance.speeds_) else np.zeros(1)
    log_speed = log_speeds.mean()
    if rpm is not None and len(distance.speeds_):
        log_speed = np.log(rpm)
    recorded = distance.recorded_ > 0
    weights, _ = reference_weights(np.array([log_speed]), log_speeds, recorded)
    along_axes = weights[0, :, condition] @ distance.references_[:, condition]
    # The least spectra that the axes map to the reference have no gain.
    shapes = np.linalg.lstsq(distance.axes_.T, along_axes)[0]
    return shapes.reshape(-1, int(distance.window_shape_[-1]))[group]


def _fitted_part(model, kind):
    parts = (part for part in estimators_within(model) if isinstance(part, kind))
    for part in parts:
        if is_fitted(part):
            return part
    raise ValueError(f"The model has no fitted {kind.__name__}.")
