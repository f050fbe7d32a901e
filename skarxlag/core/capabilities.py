"""The questions that a fitted estimator can answer, and the rows that it takes.

This is the only place that inspects what an estimator can do. Everything else calls
`capabilities`. An estimator of this package describes itself by a method ``_capabilities()``,
which returns some fields of `Capabilities` by name. All other estimators are described by
scikit-learn's own means.
"""

from collections import ChainMap
from dataclasses import dataclass
from typing import Any

import numpy as np
from sklearn.base import is_classifier, is_outlier_detector
from sklearn.frozen import FrozenEstimator
from sklearn.pipeline import Pipeline
from sklearn.utils.validation import check_is_fitted

from .metadata import metadata_router
from .state import CheckedEstimator, estimators_within, is_fitted

#: Fields that describe the last step; other fields may come from any step.
_OF_THE_DECISION = {
    "alarm",
    "combs_alone",
    "healthy_was_recorded",
    "healthy_p_value",
    "limits",
    "n_evidence",
    "n_healthy",
    "none_of_these",
    "stated_rate",
}


@dataclass(frozen=True)
class Capabilities:
    """Description of a fitted estimator.

    Parameters
    ----------
    conditions : tuple of label or None, default=None
        Conditions that it distinguishes, sorted. None if it is not a classifier.
    states_probabilities : bool, default=False
        Whether it returns a probability of each condition.
    healthy : label or None, default=None
        The healthy condition among them. None if it is not known.
    alarm : bool, default=False
        Whether it flags rows that exceed healthy limits.
    healthy_was_recorded : bool, default=True
        Whether the healthy condition rests on healthy rows in `fit`.
    limits : str, default=""
        From what the limits of the alarm were learned.
    n_healthy : int or None, default=None
        Healthy rows in `fit`, from which the limits of the alarm were learned. None if
        it is not known.
    healthy_p_value : bool, default=False
        Whether it returns the probability that a healthy row deviates as much.
    none_of_these : bool, default=False
        Whether it rejects rows that resemble none of the conditions.
    states_unknown : bool, default=False
        Whether it returns the probability of an unknown condition.
    n_evidence : int, default=0
        Values of the evidence of a row, of which its method ``join`` takes the mean
        over the rows of a recording. 0 if rows cannot be joined.
    locations : tuple of str or None, default=None
        Place of each condition: "healthy", "inner", "outer", "ball", or None for a
        condition that is a place of its own. None if places are not known.
    n_specimens : tuple of int or None, default=None
        Number of specimens of each condition in `fit`. None if it is not known.
    stated_rate : float or None, default=None
        Share of healthy rows that may be flagged, or of known rows that may be
        rejected.
    takes_rpm : bool, default=False
        Whether a step requests the speed of rows, and was given it in `fit`.
    needs_rpm : bool, default=False
        Whether no row is diagnosed without its speed.
    speeds : tuple of float, default=()
        Training speeds in revolutions per minute, ascending. Empty if they are not
        known.
    window_length : int or None, default=None
        Samples in each channel of a row.
    n_channels : int, default=1
        Channels of a row.
    n_outputs : int, default=1
        Channels of a row that are sensors, each with its own models. The others are
        inputs.
    is_stretch : bool, default=False
        Whether a row holds several windows.
    compares_orders : bool, default=False
        Whether order spectra of rows are compared with those of `fit`.
    combs_alone : bool, default=False
        Whether combs of a bearing decide, without spectra of faults.
    sampling_rate : float or None, default=None
        In Hz. None if it is not known.
    """

    conditions: tuple[Any, ...] | None = None
    states_probabilities: bool = False
    healthy: Any = None
    alarm: bool = False
    healthy_was_recorded: bool = True
    limits: str = ""
    n_healthy: int | None = None
    healthy_p_value: bool = False
    none_of_these: bool = False
    states_unknown: bool = False
    n_evidence: int = 0
    locations: tuple[str | None, ...] | None = None
    n_specimens: tuple[int, ...] | None = None
    stated_rate: float | None = None
    takes_rpm: bool = False
    needs_rpm: bool = False
    speeds: tuple[float, ...] = ()
    window_length: int | None = None
    n_channels: int = 1
    n_outputs: int = 1
    is_stretch: bool = False
    compares_orders: bool = False
    combs_alone: bool = False
    sampling_rate: float | None = None


def capabilities(model: Any) -> Capabilities:
    """Describe what a fitted estimator can answer.

    Parameters
    ----------
    model : estimator
        A pipeline, a decision, or a meta-estimator of scikit-learn around pipelines.

    Returns
    -------
    Capabilities
        The description.
    """
    steps = _all_steps(model)
    *before, decision = unfolded_steps(model)
    declared = [_declared(step) for step in steps]
    of_decision = _declared(decision)
    # A step that comes first takes precedence.
    fields = _rows_of(steps[0]) | ChainMap(*declared)
    for name in _OF_THE_DECISION - of_decision.keys():
        fields.pop(name, None)
    requests_rpm = requests(decision, "predict", "rpm") or any(
        requests(step, "transform", "rpm") for step in before
    )
    was_given_rpm = all(of_step.get("takes_rpm", True) for of_step in declared)
    fields["takes_rpm"] = requests_rpm and was_given_rpm
    if is_classifier(decision):
        fields["conditions"] = tuple(np.asarray(decision.classes_).tolist())
        fields["states_probabilities"] = offers(decision, "predict_proba")
        # Bagging and voting number the conditions before their members see them.
        if fields.get("healthy") not in fields["conditions"]:
            fields["healthy"] = None
    elif not of_decision:
        fields["alarm"] = is_outlier_detector(decision)
    return Capabilities(**fields)


def offers(estimator: Any, method: str) -> bool:
    """Return whether an estimator, fitted or not, has a method."""
    return callable(getattr(estimator, method, None))


def requests(estimator: Any, method: str, name: str) -> bool:
    """Return whether a method of an estimator takes a piece of metadata, by its name."""
    router = metadata_router(estimator, unfolded_steps(estimator))
    return bool(router.consumes(method, [name]))


def unfolded_steps(model: Any) -> list[Any]:
    """Return the steps of a model, with the steps of pipelines within pipelines in their place.

    Parameters
    ----------
    model : estimator
        A pipeline, a fitted search over pipelines, or any other estimator, which is one
        step.

    Returns
    -------
    list of estimator
        Fitted estimators.
    """
    if isinstance(model, FrozenEstimator):
        return unfolded_steps(model.estimator)
    if "best_estimator_" in vars(model):
        return unfolded_steps(model.best_estimator_)
    if not isinstance(model, Pipeline):
        return [model]
    steps = [step for _, step in model.steps if step not in (None, "passthrough")]
    return [part for step in steps for part in unfolded_steps(step)]


def _declared(step):
    if not isinstance(step, CheckedEstimator):
        return {}
    check_is_fitted(step)
    return step._capabilities()


def _all_steps(model):
    """Return the steps of a model, and those within its last step."""
    *before, decision = unfolded_steps(model)
    return [*before, *_steps_within(decision)]


def _steps_within(decision):
    """Steps of the pipeline that a meta-estimator has fitted; or the decision itself."""
    if not isinstance(decision, CheckedEstimator):
        for part in estimators_within(decision):
            if isinstance(part, Pipeline) and is_fitted(part):
                return unfolded_steps(part)
    return [decision]


def _rows_of(first):
    """Length and channels of the rows that a step was fitted on."""
    shape = vars(first).get("window_shape_", [getattr(first, "n_features_in_", None)])
    length = None if shape[-1] is None else int(shape[-1])
    return {
        "window_length": length,
        "n_channels": int(shape[0]) if len(shape) == 2 else 1,
    }
