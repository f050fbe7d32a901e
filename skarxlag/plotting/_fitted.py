"""Names, thresholds and steps that the displays read from a fitted diagnoser."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from sklearn.utils import Bunch

from .._answers import answers, unfolded_steps
from ..observers import Observer

if TYPE_CHECKING:
    from ..identification import ARXLaguerre
    from ..ladder import ThresholdLadder


def model_names(identify: ARXLaguerre) -> list[str]:
    """Return the names of the models of a fitted ARXLaguerre.

    Parameters
    ----------
    identify : ARXLaguerre
        The fitted identification.

    Returns
    -------
    list of str
        The names, in the order of the models' innovations.
    """
    return [str(name) for name in identify.classes_]


def first_and_last(estimator: Any) -> tuple[Any, Any]:
    """Return the first and last step of a Pipeline, or any other estimator twice."""
    steps = unfolded_steps(estimator)
    return steps[0][1], steps[-1][1]


def condition_names(estimator: Any) -> list[Any]:
    """Return the conditions that a fitted estimator knows.

    Parameters
    ----------
    estimator : Pipeline, ARXLaguerre or ThresholdLadder
        The fitted estimator.

    Returns
    -------
    list of label
        The healthy condition comes first and the others are sorted. The list is empty if only a
        single model was identified.
    """
    can = answers(estimator)
    if can.conditions is not None:
        return sorted(can.conditions, key=lambda name: name != can.healthy)
    models = getattr(first_and_last(estimator)[0], "classes_", [])
    return list(models) if len(models) > 1 else []


def healthy_name(decide: Any) -> str | None:
    """Return the healthy condition's name of a fitted ThresholdLadder; None for other steps."""
    healthy = answers(decide).healthy
    return None if healthy is None else str(healthy)


def ordered_conditions(known: Sequence[Any] | None, conditions: Sequence[Any] | None) -> list[str]:
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
    missing = sorted(set(known) - set(order))
    if missing or len(set(order)) < len(order):
        raise ValueError(
            f"conditions={order} must name each condition once, expected all of {known}."
        )
    return order


def chosen_model(names: list[str], model: Any, healthy: str | None) -> int:
    """Return the position of the requested model, or of the healthy one.

    Parameters
    ----------
    names : list of str
        Names of all models.
    model : label or None
        The requested model. If None, the model of the healthy condition, or the only model.
    healthy : str or None
        Name of the healthy condition.

    Returns
    -------
    int
        Its position in `names`.

    Raises
    ------
    ValueError
        If no model has this name.
    """
    if model is None:
        model = healthy if len(names) > 1 else names[0]
    if str(model) not in names:
        raise ValueError(f"model={model!r} is not a model of the diagnoser, which has {names}.")
    return names.index(str(model))


def observed(estimator: Any, window: Any, model: Any) -> tuple[str, int, Bunch, Any]:
    """Run the observer of a fitted Pipeline on one window.

    Parameters
    ----------
    estimator : Pipeline
        Fitted, with an observer before its decision.
    window : array-like of shape (n_samples,) or (n_channels, n_samples)
        The window.
    model : label or None
        As in `chosen_model`.

    Returns
    -------
    name : str
        Name of the model.
    place : int
        Its position.
    trajectories : Bunch
        What `observe` returns, and the innovations.
    levels : ndarray of shape (n_models,)
        Residual levels of all models.

    Raises
    ------
    ValueError
        If the step before the decision is not an observer, or no model has this name.
    """
    observer = estimator[-2]
    if not isinstance(observer, Observer):
        raise ValueError(
            f"estimator has {type(observer).__name__} before its decision, expected an observer, "
            "which has trajectories to show."
        )
    names = model_names(estimator[0])
    place = chosen_model(names, model, healthy_name(estimator[-1]))
    innovations = estimator[:-2].transform(np.asarray(window)[np.newaxis])
    levels = np.asarray(observer.transform(innovations))[0]
    found = Bunch(**observer.observe(innovations), innovations=innovations)
    return names[place], place, found, levels


def deltas_of(decide: ThresholdLadder) -> dict[str, float]:
    r"""Return the isolation threshold :math:`\Delta` of each condition.

    Parameters
    ----------
    decide : ThresholdLadder
        The fitted decision.

    Returns
    -------
    dict of str to float
        The thresholds by condition. For a single residual they are in ascending order: each is the
        upper end of the range of levels that is assigned to its condition, and the highest is
        infinite.
    """
    deltas, names = decide.isolation_thresholds_.tolist(), decide.classes_
    if not is_bank(decide):
        deltas, names = [*deltas, np.inf], decide.rungs_
    return {str(name): delta for name, delta in zip(names, deltas, strict=True)}


def is_bank(decide: Any) -> bool:
    """Return whether a fitted decision compares a bank: one residual for each condition."""
    n_classes = len(getattr(decide, "classes_", ()))
    return n_classes == decide.n_features_in_ > 1
