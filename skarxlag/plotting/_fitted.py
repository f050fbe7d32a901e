"""Conditions, models and thresholds that the displays read from a fitted diagnoser."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .._answers import answers, unfolded_steps

if TYPE_CHECKING:
    from ..ladder import ThresholdLadder


def known_conditions(estimator: Any) -> list[Any]:
    """Return the conditions of a fitted classifier, the healthy one first and the others sorted."""
    can = answers(estimator)
    return sorted(can.conditions or (), key=lambda name: name != can.healthy)


def ordered_conditions(known: Sequence[Any], conditions: Sequence[Any] | None) -> list[str]:
    """Return the conditions in the order that determines their colours.

    Parameters
    ----------
    known : sequence of label or None
        Conditions to be drawn. None entries are ignored.
    conditions : sequence of label or None
        The requested order. If None, the order of `known`.

    Returns
    -------
    list of str
        The names of the conditions, in order.

    Raises
    ------
    ValueError
        If `conditions` omits or repeats a condition.
    """
    known = [str(name) for name in known if name is not None]
    if conditions is None:
        return list(dict.fromkeys(known))
    order = [str(name) for name in conditions]
    if not set(known) <= set(order) or len(set(order)) < len(order):
        raise ValueError(
            f"conditions={order} must name each condition once, expected all of {known}."
        )
    return order


def chosen_model(estimator: Any, model: Any) -> tuple[int, list[str]]:
    """Return the position of a model of the first step, and the names of all models.

    Parameters
    ----------
    estimator : ARXLaguerre or Pipeline
        The fitted estimator.
    model : label or None
        Condition of the requested model. If None, the healthy condition if it has a model, and
        otherwise the first model.

    Returns
    -------
    place : int
        Position of the model.
    names : list of str
        Names of the models.

    Raises
    ------
    ValueError
        If no model has this name.
    """
    names = [str(name) for name in unfolded_steps(estimator)[0][1].classes_]
    if model is None:
        healthy = str(answers(estimator).healthy)
        model = healthy if healthy in names else names[0]
    if str(model) not in names:
        raise ValueError(f"model={model!r} is not a model of the diagnoser, which has {names}.")
    return names.index(str(model)), names


def isolation_thresholds(decide: ThresholdLadder) -> dict[str, float]:
    r"""Return the isolation threshold :math:`\Delta` of each condition of a fitted ladder.

    For a single residual the thresholds ascend: each is the upper end of the range of levels that
    is assigned to its condition, and the highest is infinite.
    """
    deltas, names = decide.isolation_thresholds_, decide.classes_
    if not decide._is_bank():
        deltas, names = np.append(deltas, np.inf), decide.rungs_
    return dict(zip(names.astype(str).tolist(), deltas.tolist(), strict=True))
