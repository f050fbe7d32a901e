"""Metadata of rows, such as their speeds, and the steps that request them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from functools import lru_cache
from typing import Any

from sklearn import config_context
from sklearn.utils.metadata_routing import get_routing_for_object, process_routing

from .state import CheckedEstimator


def consumes(estimator: Any, steps: Sequence[Any], method: str, name: str) -> bool:
    """Return whether a method of an estimator, made of steps, takes a piece of metadata."""
    look_up = _for_steps(_consumes, steps)
    return look_up(estimator, method, name, *_settings(steps))


def requested_by_steps(
    pipeline: Any,
    method: str,
    steps: Sequence[tuple[str, Any]],
    params: Mapping[str, Any],
) -> list[dict[str, Any]]:
    """Return the metadata that each step of a pipeline requests, by its own names for them.

    Parameters
    ----------
    pipeline : Pipeline
        The pipeline.
    method : str
        Method of the last step. The steps before it transform.
    steps : sequence of (str, estimator)
        Steps of the pipeline that are not left out.
    params : mapping of str to object
        Metadata by the names that the user gives them.

    Returns
    -------
    list of dict of str to object
        One for each step.
    """
    estimators = [step for _, step in steps]
    # A step may request a piece of metadata only if it is not None.
    names = tuple((name, value is not None) for name, value in params.items())
    route = _for_steps(_routed_names, estimators)
    routed = route(pipeline, method, names, tuple(steps), *_settings(estimators))
    return [
        {name: params[given] for name, given in of_step.items()} for of_step in routed
    ]


def metadata_routing(params: Iterable[str]) -> AbstractContextManager[None]:
    """Switch metadata routing on if there are metadata that are not named for a step."""
    names = list(params)
    if names and not any("__" in name for name in names):
        return config_context(enable_metadata_routing=True)
    return nullcontext()


def _for_steps(look_up: Any, steps: Sequence[Any]) -> Callable[..., Any]:
    """Return a cached function for steps of this package, and otherwise the plain one."""
    # Estimators of other packages may hold some whose requests have changed.
    is_ours = all(isinstance(step, CheckedEstimator) for step in steps)
    return look_up if is_ours else look_up.__wrapped__


def _settings(steps):
    """Return what steps were set to request, and the steps."""
    return *steps, *(vars(step).get("_metadata_request") for step in steps)


# scikit-learn's routing takes ten times as long as the diagnosis of a row. The last
# arguments of these functions are what their results depend on besides the names.
@lru_cache(maxsize=8)
def _consumes(estimator, method, name, *_):
    return bool(get_routing_for_object(estimator).consumes(method, [name]))


@lru_cache(maxsize=8)
def _routed_names(pipeline, method, names, steps, *_):
    """Return for each step the names of the metadata that it requests: its own, and ours."""
    given = {name: name if is_given else None for name, is_given in names}
    routed = process_routing(pipeline, method, **given)
    before = [routed[name]["transform"] for name, _ in steps[:-1]]
    return [*before, routed[steps[-1][0]][method]]
