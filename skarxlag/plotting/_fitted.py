"""Names, thresholds and steps that the displays read from a fitted diagnoser."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .._answers import answers, unfolded_steps

if TYPE_CHECKING:
    from ..identification import ARXLaguerre
    from ..ladder import ThresholdLadder


def model_names(identify: "ARXLaguerre") -> list[str]:
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


def observer_of(estimator: Any) -> Any:
    """Return the observer of a fitted Pipeline, which is the step before the decision.

    Raises
    ------
    ValueError
        If the step before the decision is not an observer.
    """
    observer = estimator[-2]
    if not hasattr(observer, "observe"):
        raise ValueError(
            f"estimator has {type(observer).__name__} before its decision, expected an observer, "
            "which has trajectories to show."
        )
    return observer


def ladder_cuts(decide: "ThresholdLadder") -> dict[str, float]:
    r"""Return the isolation threshold :math:`\Delta` of each condition, in ascending order.

    A rung is the range of levels that is assigned to one condition; its upper end is the
    condition's :math:`\Delta`.

    Parameters
    ----------
    decide : ThresholdLadder
        A ladder that was fitted on one residual.

    Returns
    -------
    dict of str to float
        The thresholds by condition. The threshold of the highest rung is infinite.
    """
    cuts = [*decide.isolation_thresholds_.tolist(), np.inf]
    return {str(name): cut for name, cut in zip(decide.rungs_, cuts, strict=True)}


def bank_deltas(decide: "ThresholdLadder") -> dict[str, float]:
    r"""Return :math:`\Delta` of each condition for a ThresholdLadder fitted on a bank."""
    deltas = decide.isolation_thresholds_.tolist()
    return {str(name): delta for name, delta in zip(decide.classes_, deltas, strict=True)}


def is_bank(decide: Any) -> bool:
    """Return whether a fitted decision compares a bank: one residual for each condition."""
    n_classes = len(getattr(decide, "classes_", ()))
    return n_classes == decide.n_features_in_ > 1
