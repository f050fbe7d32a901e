"""The comparison of order spectra within a fitted diagnoser, for displays and reports."""

from __future__ import annotations

from typing import Any

from sklearn.pipeline import Pipeline

from ..core.capabilities import capabilities, offers
from ..core.pipelines import as_diagnosis_pipeline
from ..distances.orders import OrderResidual

#: Attributes of the parts in which a decision, and a residual, compare orders.
_PARTS = ("conditions_", "residual_", "order_residual_")


def order_comparison(diagnoser: Any) -> tuple[Pipeline | None, OrderResidual]:
    """Return the residual of order spectra in a fitted pipeline, and the steps before it.

    Parameters
    ----------
    diagnoser : estimator
        Fitted pipeline, or one step.

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
    pipeline = as_diagnosis_pipeline(diagnoser)
    for n_before, (_, part) in enumerate(pipeline.steps):
        for name in _PARTS:
            part = getattr(part, name, None) or part
        if offers(part, "match") and capabilities(part).compares_orders:
            return pipeline[:n_before] if n_before > 0 else None, part
    raise ValueError(
        "No step compares order spectra; expected a StretchResidual or an OrderResidual among "
        f"{[type(step).__name__ for _, step in pipeline.steps]}."
    )
