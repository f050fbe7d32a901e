"""A Pipeline that diagnoses windows batch by batch."""

from __future__ import annotations

from copy import copy
from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from sklearn.base import clone, is_classifier
from sklearn.pipeline import Pipeline
from sklearn.utils import Bunch, check_consistent_length
from sklearn.utils.metaestimators import available_if

from .base import DocumentedEstimator
from .batches import MAY_BE_IN_BATCHES, rows_of_batch
from .capabilities import capabilities, offers, unfolded_steps
from .metadata import metadata_routing, requested_by_steps
from .parallel import map_batches
from .validation import warn_user

#: Methods of the last step that `diagnose` calls, by the names of their results.
_METHODS = {
    "verdict": "predict",
    "score": "decision_function",
    "probability": "predict_proba",
    "alarm": "detect",
}
#: Each batch of a dask array would compute everything before it again.
_LAZY = (
    "X is a dask array, expected windows in memory or mapped from a file. Diagnose it block by "
    "block, with one chunk along all axes but the first: X.map_blocks(diagnoser.predict, "
    "dtype=diagnoser.classes_.dtype, drop_axis=1), for several channels drop_axis=[1, 2]."
)
#: `sklearn.model_selection` hands metadata to `fit` alone if routing is switched off.
_SCORED_WITHOUT_SPEEDS = (
    "The pipeline was fitted with rpm and is scored without, so the score is that for unknown "
    "speeds. Pass rpm. For scikit-learn's model selection, call "
    "sklearn.set_config(enable_metadata_routing=True), pass params={'rpm': rpm}, and leave scoring "
    "at its default or use skarxlag.model_selection.SpeedScorer."
)


def _if_last_step_offers(name):
    return available_if(lambda pipeline: offers(pipeline.steps[-1][1], name))


class DiagnosisPipeline(DocumentedEstimator, Pipeline):
    """Pipeline that diagnoses windows batch by batch.

    The innovations of a bank are many times larger than its windows. A batch of windows
    goes through all steps before the next one, so the memory between the steps is the
    same for any number of windows. In `fit`, too, steps that learn from sums compute
    the output of the steps before them batch by batch, unless there is a `memory`.
    Every window is diagnosed by itself: all results are those of
    `sklearn.pipeline.Pipeline`, bit for bit.

    Metadata such as ``rpm``, the speed of each window, and ``sample_weight``, its
    weight, reach the steps that request them by scikit-learn's metadata routing, as the
    steps of this package do. In this pipeline they do so whether routing is switched on
    or not. `sklearn.model_selection.cross_val_score` and the searches hand metadata to
    `score` only when routing is switched on, by
    ``sklearn.set_config(enable_metadata_routing=True)``.

    The pipeline returns a result for each window, also if the window carries no signal.
    :func:`skarxlag.window_verdicts` and :func:`skarxlag.recording_verdicts` check the
    quality of the windows first.

    Parameters
    ----------
    steps : list of (str, estimator)
        As in `sklearn.pipeline.Pipeline`; the estimators must work on each window by
        itself.
    transform_input : list of str or None, default=None
        As in `sklearn.pipeline.Pipeline`.
    memory : str, joblib.Memory or None, default=None
        As in `sklearn.pipeline.Pipeline`.
    verbose : bool, default=False
        As in `sklearn.pipeline.Pipeline`.
    n_jobs : int or None, default=None
        Threads that diagnose batches. The steps have their own parameter, for `fit`.

    Examples
    --------
    >>> from skarxlag import make_alpio
    >>> X = np.random.default_rng(0).normal(size=(600, 400))
    >>> diagnoser = make_alpio().fit(X[:40], np.repeat(["a", "b"], 20))
    >>> diagnoser.predict(X).shape
    (600,)
    """

    steps: list[tuple[str, Any]]

    # scikit-learn 1.6 asks the class, not its steps, what a search may pass to `score`.
    __metadata_request__score = {"rpm": True, "sample_weight": True}  # noqa: RUF012

    def __init__(
        self,
        steps: list[tuple[str, Any]],
        *,
        transform_input: list[str] | None = None,
        memory: Any = None,
        verbose: bool = False,
        n_jobs: int | None = None,
    ) -> None:
        super().__init__(
            steps, transform_input=transform_input, memory=memory, verbose=verbose
        )
        self.n_jobs = n_jobs

    def fit(
        self,
        X: ArrayLike,
        y: ArrayLike | None = None,
        sample_weight: ArrayLike | None = None,
        **params: Any,
    ) -> Self:
        """Fit clones of all steps, one after another, and then put them in their places.

        If `fit` is interrupted, the pipeline remains as it was.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_samples) or (n_windows, 1 + n_inputs, n_samples)
            Windows.
        y : array-like of shape (n_windows,) or None, default=None
            Condition of each window.
        sample_weight : array-like of shape (n_windows,) or None, default=None
            Number of windows that each one stands for, for the steps that request it.
        **params : dict of str to object
            Further metadata for the steps that request them, such as ``rpm``; or, where
            routing is switched off, parameters of a step's `fit` by its name, such as
            ``identify__sample_weight``, as in `sklearn.pipeline.Pipeline`.

        Returns
        -------
        DiagnosisPipeline
            The fitted pipeline.
        """
        if sample_weight is not None:
            params["sample_weight"] = sample_weight
        trial = copy(self)
        trial.steps = [
            (name, step if step in (None, "passthrough") else clone(step))
            for name, step in self.steps
        ]
        # A cache holds arrays.
        before = MAY_BE_IN_BATCHES.set(self.memory is None)
        try:
            with metadata_routing(params):
                super(DiagnosisPipeline, trial).fit(X, y, **params)
        finally:
            MAY_BE_IN_BATCHES.reset(before)
        vars(self).update(vars(trial))
        return self

    @_if_last_step_offers("transform")
    def transform(self, X: ArrayLike, **params: Any) -> NDArray[Any]:
        """Transform the windows, all in one batch.

        Parameters
        ----------
        X, **params : array-like
            Windows and their metadata, as in `predict`.

        Returns
        -------
        ndarray of shape (n_windows, ...)
            Output of the last step.
        """
        with metadata_routing(params):
            return self._of_last_step("transform", X, params)

    @_if_last_step_offers("predict")
    def predict(self, X: ArrayLike, **params: Any) -> NDArray[Any]:
        """Predict the condition of each window.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_samples) or (n_windows, 1 + n_inputs, n_samples)
            Windows; an array that is mapped from a file is read batch by batch.
        **params : dict of str to object
            Metadata, as in `fit`. Those with an entry for each window are cut into
            batches, too.

        Returns
        -------
        ndarray of shape (n_windows,)
            Predictions of the last step.
        """
        return self._in_batches("predict", X, params)

    @_if_last_step_offers("predict_proba")
    def predict_proba(self, X: ArrayLike, **params: Any) -> NDArray[Any]:
        """Compute the probability of each condition.

        Parameters
        ----------
        X, **params : array-like
            Windows and their metadata, as in `predict`.

        Returns
        -------
        ndarray of shape (n_windows, n_classes)
            Probabilities, in the order of `classes_`.
        """
        return self._in_batches("predict_proba", X, params)

    @_if_last_step_offers("predict_log_proba")
    def predict_log_proba(self, X: ArrayLike, **params: Any) -> NDArray[Any]:
        """Compute the logarithm of the probability of each condition.

        Parameters
        ----------
        X, **params : array-like
            Windows and their metadata, as in `predict`.

        Returns
        -------
        ndarray of shape (n_windows, n_classes)
            Natural logarithms, in the order of `classes_`.
        """
        return self._in_batches("predict_log_proba", X, params)

    @_if_last_step_offers("decision_function")
    def decision_function(self, X: ArrayLike, **params: Any) -> NDArray[Any]:
        """Compute the scores of the conditions.

        Parameters
        ----------
        X, **params : array-like
            Windows and their metadata, as in `predict`.

        Returns
        -------
        ndarray of shape (n_windows, n_classes), or (n_windows,) for two conditions
            Scores of the last step.
        """
        return self._in_batches("decision_function", X, params)

    @_if_last_step_offers("predict")
    def diagnose(self, X: ArrayLike, **params: Any) -> Bunch:
        """Compute verdict, probability, score and alarm of each window in one pass.

        Parameters
        ----------
        X, **params : array-like
            Windows and their metadata, as in `predict`.

        Returns
        -------
        Bunch
            ``levels``, the input of the last step, of shape (n_windows, n_levels), or
            the residuals that a `ConditionClassifier` computes from it; ``verdict``, as
            `predict` returns it; and, if the last step offers them, ``probability``
            (`predict_proba`), ``score`` (`decision_function`) and ``alarm``, of bool:
            the result of `ThresholdLadder.detect`, or, of a detector, whether the
            verdict is -1. A last step with a method `diagnose` adds what that returns,
            such as ``p_values``.

        Examples
        --------
        >>> from skarxlag import make_diagnoser
        >>> X = np.random.default_rng(0).normal(size=(40, 400))
        >>> X[20:] = X[20:].cumsum(axis=1)
        >>> y = np.repeat(["good", "worn"], 20)
        >>> diagnosis = make_diagnoser(healthy="good").fit(X, y).diagnose(X)
        >>> diagnosis.verdict[[0, 20]], diagnosis.alarm[[0, 20]]
        (array(['good', 'worn'], dtype='<U4'), array([False,  True]))
        """
        return self._in_batches("diagnose", X, params)

    def _diagnose(self, last, levels, routed):
        if offers(last, "diagnose"):
            return Bunch(**{"levels": levels} | last.diagnose(levels, **routed))
        results = {
            name: getattr(last, method)(levels, **routed)
            for name, method in _METHODS.items()
            if offers(last, method)
        }
        if "alarm" not in results and not is_classifier(last):
            results["alarm"] = results["verdict"] == -1
        return Bunch(levels=levels, **results)

    def _of_last_step(self, method, X, params):
        """Pass rows through the steps, and return the result of a method of the last one."""
        steps = [
            (name, step)
            for name, step in self.steps
            if step not in (None, "passthrough")
        ]
        # All methods that decide take what `predict` takes.
        requests = "transform" if method == "transform" else "predict"
        *before, routed = requested_by_steps(self, requests, steps, params)
        for (_, step), requested in zip(steps, before, strict=False):
            X = step.transform(X, **requested)
        last = self.steps[-1][1]
        if method == "diagnose":
            return self._diagnose(last, X, routed)
        return getattr(last, method)(X, **routed)

    @_if_last_step_offers("score_samples")
    def score_samples(self, X: ArrayLike, **params: Any) -> NDArray[Any]:
        """Compute the score of each window: the log p-value if the last step has p-values.

        Parameters
        ----------
        X, **params : array-like
            Windows and their metadata, as in `predict`.

        Returns
        -------
        ndarray of shape (n_windows,)
            Scores of the last step.
        """
        return self._in_batches("score_samples", X, params)

    @_if_last_step_offers("p_values")
    def p_values(self, X: ArrayLike, **params: Any) -> NDArray[Any]:
        """Compute p-values: one for each window, or one for each window and known condition.

        Parameters
        ----------
        X, **params : array-like
            Windows and their metadata, as in `predict`.

        Returns
        -------
        ndarray of shape (n_windows,) or (n_windows, n_conditions)
            Probabilities in (0, 1].
        """
        return self._in_batches("p_values", X, params)

    @available_if(lambda pipeline: pipeline._step_with("adapt") is not None)
    def adapt(self, X: ArrayLike, y: ArrayLike, **params: Any) -> Self:
        """Adapt the references to windows of a new speed, which commonly are healthy.

        The first step with a method `adapt` gets the output of the steps before it.
        Adapt a copy (`copy.deepcopy`) to keep the pipeline for the old speed.

        Parameters
        ----------
        X, y : array-like
            Windows at the new speed, and their conditions among those of `fit`.
        **params : dict of str to object
            Further arguments of the step's `adapt`, such as ``rpm``, the new speed.

        Returns
        -------
        DiagnosisPipeline
            This pipeline, for use at the new speed.
        """
        at = self._step_with("adapt")
        levels = self[:at].transform(X) if at > 0 else X
        self.steps[at][1].adapt(levels, y, **params)
        return self

    def _step_with(self, method):
        """Index of the first step with a method, or None."""
        return next(
            (i for i, (_, step) in enumerate(self.steps) if offers(step, method)), None
        )

    @_if_last_step_offers("score")
    def score(self, X: ArrayLike, y: ArrayLike | None = None, **params: Any) -> float:
        """Compute the score of the last step: the accuracy if it is a classifier.

        A warning is given if `fit` had ``rpm`` and this method has not.

        Parameters
        ----------
        X, y : array-like
            Windows and the condition of each, as in `fit`.
        **params : dict of str to object
            Metadata, as in `fit`. ``sample_weight`` alone is given to the last step, as
            in `sklearn.pipeline.Pipeline`.

        Returns
        -------
        float
            The score.
        """
        if params.get("rpm") is None and capabilities(self).speeds:
            warn_user(_SCORED_WITHOUT_SPEEDS)
        with metadata_routing(params.keys() - {"sample_weight"}):
            return super().score(X, y, **params)

    def _in_batches(self, method, X, params):
        if type(X).__module__.partition(".")[0] == "dask":
            raise TypeError(_LAZY)
        # Arrays and tables of other libraries are cut as they are.
        if not hasattr(X, "shape"):
            X = np.asarray(X)
        # The index of a table may hold numbers that are no positions.
        rows = X.iloc if isinstance(X, pd.DataFrame) else X
        of_windows = {
            name: np.asarray(value) for name, value in params.items() if np.ndim(value)
        }
        if of_windows:
            check_consistent_length(X, *of_windows.values())

        def of_batch(batch):
            metadata = {name: value[batch] for name, value in of_windows.items()}
            return self._of_last_step(method, rows[batch], params | metadata)

        with metadata_routing(params):
            # No window is a batch, too, which the steps refuse.
            parts = map_batches(
                of_batch, max(X.shape[0], 1), self.n_jobs, rows_of_batch(X)
            )
        if len(parts) == 1:
            return parts[0]
        if isinstance(parts[0], Bunch):
            joined = {
                name: np.concatenate([part[name] for part in parts])
                for name in parts[0]
            }
            return Bunch(**joined)
        return np.concatenate(parts)


def as_diagnosis_pipeline(model: Any) -> DiagnosisPipeline:
    """Return a fitted model as a pipeline with the method `diagnose`.

    Parameters
    ----------
    model : estimator
        A pipeline, also within a search or another pipeline; or any other fitted
        estimator.

    Returns
    -------
    DiagnosisPipeline
        The model itself, or its steps in a pipeline.
    """
    steps = unfolded_steps(model)
    if isinstance(model, DiagnosisPipeline) and len(steps) == len(model.steps):
        return model
    named = [(f"step{place}", step) for place, step in enumerate(steps)]
    return DiagnosisPipeline(named, n_jobs=model.get_params(deep=False).get("n_jobs"))
