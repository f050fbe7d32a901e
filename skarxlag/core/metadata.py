"""Metadata of rows, such as their speeds, and the steps that request them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from functools import lru_cache
from typing import Any

from sklearn import config_context
from sklearn.utils.metadata_routing import get_routing_for_object

from .state import CheckedEstimator


def metadata_router(estimator: Any, steps: Sequence[Any], *names: str) -> Any:
    """Return scikit-learn's description of the metadata that an estimator of named steps takes.

    Estimators of other packages may hold some whose requests have changed. Only if all
    steps are of this package is a description used again: scikit-learn takes as long for
    it as the diagnosis of a row takes.
    """
    if not all(isinstance(step, CheckedEstimator) for step in steps):
        return get_routing_for_object(estimator)
    settings = [vars(step).get("_metadata_request") for step in steps]
    return _router(estimator, *names, *steps, *settings)


# The further arguments are what the description depends on.
@lru_cache(maxsize=8)
def _router(estimator, *_):
    return get_routing_for_object(estimator)


def requested_by_steps(
    pipeline: Any,
    method: str,
    steps: Sequence[tuple[str, Any]],
    params: Mapping[str, Any],
) -> list[Mapping[str, Any]]:
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
    list of mapping of str to object
        One for each step.
    """
    if not params:
        return [{} for _ in steps]
    names, estimators = zip(*steps, strict=True)
    router = metadata_router(pipeline, estimators, *names)
    router.validate_metadata(method=method, params=params)
    routed = router.route_params(caller=method, params=params)
    before = [routed[name]["transform"] for name in names[:-1]]
    return [*before, routed[names[-1]][method]]


def metadata_routing(params: Iterable[str]) -> AbstractContextManager[None]:
    """Switch metadata routing on if there are metadata that are not named for a step."""
    names = list(params)
    if names and not any("__" in name for name in names):
        return config_context(enable_metadata_routing=True)
    return nullcontext()
