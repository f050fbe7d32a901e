"""Figures of a row next to what a model learned of its conditions."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..distances.stretches import order_comparison
from ..kernels.fault_orders import NEPER_IN_DB
from .figures import Axis, Figure, Mark, curve


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
