"""What displays read off a fitted diagnoser."""

from collections.abc import Sequence
from typing import Any

import numpy as np


def model_names(identify: Any) -> list[str]:
    """Names of the models of a fitted ARXLaguerre.

    Parameters
    ----------
    identify : ARXLaguerre
        Fitted.

    Returns
    -------
    list of str
        In the order of the innovations.
    """
    return [str(name) for name in identify.classes_]


def first_and_last(estimator: Any) -> Any:
    """First and last step of a Pipeline; twice the estimator where it is none."""
    steps = getattr(estimator, "steps", [(None, estimator)])
    return steps[0][1], steps[-1][1]


def condition_names(estimator: Any) -> list[Any]:
    """Conditions that a fitted estimator knows.

    Parameters
    ----------
    estimator : Pipeline, ARXLaguerre or ThresholdLadder
        Fitted.

    Returns
    -------
    list of label
        The healthy one first, the others sorted; empty where only a single model was identified.
    """
    identify, decide = first_and_last(estimator)
    if hasattr(decide, "healthy_index_"):
        healthy = decide.classes_[decide.healthy_index_]
        return sorted(decide.classes_, key=lambda name: name != healthy)
    models = getattr(identify, "classes_", [])
    return list(models) if len(models) > 1 else []


def healthy_name(decide: Any) -> Any:
    """Name of the healthy condition of a fitted ThresholdLadder, None of another step."""
    if not hasattr(decide, "healthy_index_"):
        return None
    return str(decide.classes_[decide.healthy_index_])


def ordered_conditions(known: Sequence[Any] | None, conditions: Sequence[Any] | None) -> list[str]:
    """Conditions in the order that gives them their colours.

    Parameters
    ----------
    known : sequence of label or None
        Conditions that are to be drawn; None stands for no condition.
    conditions : sequence of label or None
        The order that was asked for. None: that of `known`.

    Returns
    -------
    list of str
        The order.

    Raises
    ------
    ValueError
        If `conditions` leaves one out or repeats one.
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
    """Position of the model that was asked for, or of the healthy one.

    Parameters
    ----------
    names : list of str
        Names of all models.
    model : label or None
        Which. None: the healthy one, or the only one.
    healthy : str or None
        Name of the healthy condition.

    Returns
    -------
    int
        Its position in `names`.

    Raises
    ------
    ValueError
        If there is no such model.
    """
    if model is None:
        model = healthy if len(names) > 1 else names[0]
    if str(model) not in names:
        raise ValueError(f"model={model!r} is not a model of the diagnoser, which has {names}.")
    return names.index(str(model))


def observer_of(estimator: Any) -> Any:
    """The observer before the decision of a fitted Pipeline.

    Raises
    ------
    ValueError
        If `estimator` has none.
    """
    observer = estimator[-2]
    if not hasattr(observer, "observe"):
        raise ValueError(
            f"estimator has {type(observer).__name__} before its decision, expected an observer, "
            "which has trajectories to show."
        )
    return observer


def ladder_cuts(decide: Any) -> dict[str, float]:
    r"""Upper end of the rung of each condition, :math:`\Delta`, from the lowest rung up.

    Parameters
    ----------
    decide : ThresholdLadder
        Fitted on one residual.

    Returns
    -------
    dict of str to float
        Infinite for the highest rung.
    """
    cuts = [*decide.isolation_thresholds_.tolist(), np.inf]
    return {str(name): cut for name, cut in zip(decide.rungs_, cuts, strict=True)}


def bank_deltas(decide: Any) -> Any:
    r""":math:`\Delta` of each condition of a ThresholdLadder that was fitted on a bank."""
    deltas = decide.isolation_thresholds_.tolist()
    return {str(name): delta for name, delta in zip(decide.classes_, deltas, strict=True)}


def is_bank(decide: Any) -> Any:
    """Whether a fitted decision compares one residual for each condition."""
    n_classes = len(getattr(decide, "classes_", ()))
    return n_classes == decide.n_features_in_ > 1
