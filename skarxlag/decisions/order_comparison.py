"""The comparison of order spectra within a fitted diagnoser, for displays and reports."""

from __future__ import annotations

from sklearn.pipeline import Pipeline

from ..distances.orders import OrderResidual
from ..distances.stretches import StretchResidual
from .condition_classifier import ConditionClassifier
from .fault_orders import FaultOrderClassifier


def order_comparison(diagnoser: Pipeline) -> tuple[Pipeline | None, OrderResidual]:
    """Return the residual of order spectra in a fitted pipeline, and the steps before it.

    Parameters
    ----------
    diagnoser : Pipeline
        Fitted.

    Returns
    -------
    before : Pipeline or None
        The steps whose results are compared; None if the first step compares.
    residual : OrderResidual
        The residual of order spectra, also where it is part of a `StretchResidual`.

    Raises
    ------
    ValueError
        If no step compares order spectra.
    """
    is_pipeline = isinstance(diagnoser, Pipeline)
    steps = [step for _, step in diagnoser.steps] if is_pipeline else [diagnoser]
    if (
        isinstance(steps[-1], FaultOrderClassifier)
        and steps[-1].conditions_ is not None
    ):
        steps[-1] = steps[-1].conditions_
    if isinstance(steps[-1], ConditionClassifier):
        steps[-1] = steps[-1].residual_
    for n_before, residual in enumerate(steps):
        if isinstance(residual, StretchResidual):
            residual = residual.order_residual_
        if isinstance(residual, OrderResidual):
            return diagnoser[:n_before] if n_before > 0 else None, residual
    raise ValueError(
        "No step compares order spectra; expected a StretchResidual or an OrderResidual among "
        f"{[type(step).__name__ for step in steps]}."
    )
