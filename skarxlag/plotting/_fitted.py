"""Conditions and models that the displays read from a fitted diagnoser."""

from collections.abc import Sequence
from typing import Any

from ..core.capabilities import capabilities, unfolded_steps
from ..core.state import expect


def known_conditions(estimator: Any) -> list[Any]:
    """Return the conditions of a fitted classifier, the healthy one first and the others sorted."""
    described = capabilities(estimator)
    conditions = list(described.conditions or ())
    if described.healthy in conditions:
        conditions.remove(described.healthy)
        conditions.insert(0, described.healthy)
    return conditions


def ordered_conditions(
    drawn: Sequence[Any], conditions: Sequence[Any] | None
) -> list[str]:
    """Return the conditions in the order that determines their colours.

    Parameters
    ----------
    drawn : sequence of label or None
        Conditions to be drawn. None entries are ignored.
    conditions : sequence of label or None
        The requested order. If None, the order of `drawn`.

    Returns
    -------
    list of str
        The names of the conditions, in order.

    Raises
    ------
    ValueError
        If `conditions` omits or repeats a condition.
    """
    names = [str(name) for name in drawn if name is not None]
    if conditions is None:
        return list(dict.fromkeys(names))
    order = [str(name) for name in conditions]
    is_whole = set(names) <= set(order) and len(set(order)) == len(order)
    expect(is_whole, "conditions", order, f"each condition once, and all of {names}")
    return order


def chosen_model(estimator: Any, model: Any) -> tuple[int, list[str]]:
    """Return the position of a model of the first step, and the names of all models.

    Parameters
    ----------
    estimator : ARXLaguerre or Pipeline
        The fitted estimator.
    model : label or None
        Condition of the requested model. If None, the healthy condition if it has a
        model, and otherwise the first model.

    Returns
    -------
    position : int
        Position of the model.
    names : list of str
        Names of the models.

    Raises
    ------
    ValueError
        If no model has this name.
    """
    names = [str(name) for name in unfolded_steps(estimator)[0].classes_]
    if model is None:
        healthy = str(capabilities(estimator).healthy)
        model = healthy if healthy in names else names[0]
    expect(str(model) in names, "model", model, f"a model of the diagnoser: {names}")
    return names.index(str(model)), names
