"""A Pipeline that gives its verdicts batch by batch."""

from __future__ import annotations

import math
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn import config_context
from sklearn.pipeline import Pipeline
from sklearn.utils import Bunch
from sklearn.utils.metadata_routing import process_routing
from sklearn.utils.metaestimators import available_if

from ._answers import answers, unfolded_steps
from ._base import DocumentedEstimator
from ._parallel import map_batches
from .kernels.lanes import LANES
from .quality import signal_quality

#: Bytes of the rows that go through all steps together. What several models make of them should
#: stay in the processor's cache, and checks should cost little beside the work.
_BATCH_BYTES = 2**20
#: Rows that go together however long they are, as far as they take less than so many bytes: the
#: recursions work on as many signals side by side.
_ROWS_TOGETHER, _MOST_BYTES = LANES, 2**25
#: What a detector says of a window without a signal. The p-value is the smallest that is above 0.
_LEAST_LOG_P = float(np.log(np.finfo(np.float32).tiny))
#: A batch of a dask array would compute everything before it once more.
_LAZY = (
    "X is a dask array, expected windows in memory or mapped from a file. Diagnose it block by "
    "block, with one chunk along all axes but the first: X.map_blocks(diagnoser.predict, "
    "dtype=diagnoser.classes_.dtype, drop_axis=1), for several channels drop_axis=[1, 2]."
)


def _last_step_has(name):
    return available_if(lambda pipeline: hasattr(pipeline.steps[-1][1], name))


def _some_step_has(name):
    return available_if(lambda pipeline: any(hasattr(step, name) for _, step in pipeline.steps))


class DiagnosisPipeline(DocumentedEstimator, Pipeline):
    """A Pipeline that gives its verdicts batch by batch.

    The innovations of a bank are many times larger than its windows. A batch of windows goes
    through all steps before the next one is looked at, so what is between the steps takes a fixed
    amount of memory for any number of windows. Every window is diagnosed by itself: the verdicts
    are those of `sklearn.pipeline.Pipeline`, bit for bit.

    There is one exception: a window that carries no signal, see :func:`skarxlag.signal_quality`,
    tells nothing of the condition. `predict_proba` gives it the prior probabilities of the last
    step (`priors_`; all equal if there are none). `predict` and `decision_function` of a classifier
    stay as they are: a verdict on such a window means nothing. A detector is asked whether a window
    is like healthy ones, and such a window is not: `p_values` gives it the smallest positive
    number, and `predict` says -1. The rule holds where the first step is fitted on windows.

    Metadata such as ``rpm``, the speed of each window, and ``sample_weight``, its weight, reach the
    steps that request them by scikit-learn's metadata routing, as the steps of this package do. In
    this pipeline they do so whether routing is switched on or not.
    `sklearn.model_selection.cross_val_score` and the searches hand metadata to `score` only when
    routing is switched on, by ``sklearn.set_config(enable_metadata_routing=True)``.

    Parameters
    ----------
    steps : list of (str, estimator)
        As in `sklearn.pipeline.Pipeline`; the estimators must work on each window by itself.
    transform_input : list of str or None, default=None
        As in `sklearn.pipeline.Pipeline`.
    memory : str, joblib.Memory or None, default=None
        As in `sklearn.pipeline.Pipeline`.
    verbose : bool, default=False
        As in `sklearn.pipeline.Pipeline`.
    n_jobs : int or None, default=None
        Threads that work on batches when verdicts are asked for. The steps have their own, for
        `fit`.

    Examples
    --------
    >>> from skarxlag import make_alpio
    >>> X = np.random.default_rng(0).normal(size=(600, 400))
    >>> diagnoser = make_alpio().fit(X[:40], np.repeat(["a", "b"], 20))
    >>> diagnoser.predict(X).shape
    (600,)
    """

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
        super().__init__(steps, transform_input=transform_input, memory=memory, verbose=verbose)
        self.n_jobs = n_jobs

    def fit(self, X: ArrayLike, y: ArrayLike | None = None, **params: Any) -> Self:
        """Fit all steps, one after another.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_samples) or (n_windows, 1 + n_inputs, n_samples)
            Windows.
        y : array-like of shape (n_windows,) or None, default=None
            Condition of each window.
        **params : dict of str to object
            Metadata for the steps that request them, such as ``rpm`` and ``sample_weight``; or,
            where routing is switched off, parameters of a step's `fit` by its name, such as
            ``identify__sample_weight``, as in `sklearn.pipeline.Pipeline`.

        Returns
        -------
        DiagnosisPipeline
            The fitted pipeline.
        """
        with _routing(params):
            return super().fit(X, y, **params)

    @_last_step_has("transform")
    def transform(self, X: ArrayLike, **params: Any) -> NDArray[Any]:
        """What the last step makes of the windows, all in one batch.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_samples) or (n_windows, 1 + n_inputs, n_samples)
            Windows.
        **params : dict of str to object
            Metadata, as in `fit`.

        Returns
        -------
        ndarray of shape (n_windows, ...)
            As the last step gives it.
        """
        with _routing(params):
            return super().transform(X, **params)

    @_last_step_has("predict")
    def predict(self, X: ArrayLike, **params: Any) -> NDArray[Any]:
        """Condition of each window.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_samples) or (n_windows, 1 + n_inputs, n_samples)
            Windows; an array that is mapped from a file is read batch by batch.
        **params : dict of str to object
            Metadata, as in `fit`. Those with an entry for each window are cut into batches, too.

        Returns
        -------
        ndarray of shape (n_windows,)
            Verdicts of the last step; -1 from a detector for a window without a signal.
        """
        return self._in_batches(self._predict, X, params)

    def _predict(self, X, **params):
        verdict = super().predict(X, **params)
        return self._unless_silent(X, verdict, -1) if self._is_detector() else verdict

    @_last_step_has("predict_proba")
    def predict_proba(self, X: ArrayLike, **params: Any) -> NDArray[Any]:
        """Confidence in each condition.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_samples) or (n_windows, 1 + n_inputs, n_samples)
            Windows.
        **params : dict of str to object
            Metadata, as in `predict`.

        Returns
        -------
        ndarray of shape (n_windows, n_classes)
            As the last step gives it; the priors for a window without a signal.
        """
        return self._in_batches(self._probability, X, params)

    def _probability(self, X, **params):
        return self._unless_silent(X, super().predict_proba(X, **params), self._priors())

    @_last_step_has("predict_log_proba")
    def predict_log_proba(self, X: ArrayLike, **params: Any) -> NDArray[Any]:
        """Logarithm of the confidence in each condition.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_samples) or (n_windows, 1 + n_inputs, n_samples)
            Windows.
        **params : dict of str to object
            Metadata, as in `predict`.

        Returns
        -------
        ndarray of shape (n_windows, n_classes)
            As the last step gives it; the logarithms of the priors for a window without a signal.
        """
        return self._in_batches(self._log_probability, X, params)

    def _log_probability(self, X, **params):
        found = super().predict_log_proba(X, **params)
        return self._unless_silent(X, found, np.log(self._priors()))

    def _priors(self):
        n_classes = len(self.classes_)
        return getattr(self.steps[-1][1], "priors_", np.full(n_classes, 1 / n_classes))

    def _unless_silent(self, X, values, instead):
        """The values, but others for rows that are windows without a signal."""
        if hasattr(self.steps[0][1], "window_shape_"):
            values[signal_quality(X) != "good"] = instead
        return values

    @_last_step_has("decision_function")
    def decision_function(self, X: ArrayLike, **params: Any) -> NDArray[Any]:
        """Scores of the conditions.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_samples) or (n_windows, 1 + n_inputs, n_samples)
            Windows.
        **params : dict of str to object
            Metadata, as in `predict`.

        Returns
        -------
        ndarray of shape (n_windows, n_classes), or (n_windows,) for two conditions
            As the last step gives it.
        """
        return self._in_batches(self._decision, X, params)

    def _decision(self, X, **params):
        score = super().decision_function(X, **params)
        if self._is_detector():
            return self._unless_silent(X, score, _LEAST_LOG_P - self.steps[-1][1].offset_)
        return score

    def _is_detector(self):
        return hasattr(self.steps[-1][1], "p_values")

    @_last_step_has("predict")
    def diagnose(self, X: ArrayLike, **params: Any) -> Bunch:
        """Verdict, confidence and alarm of each window together, in one pass.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_samples) or (n_windows, 1 + n_inputs, n_samples)
            Windows.
        **params : dict of str to object
            Metadata, as in `predict`.

        Returns
        -------
        Bunch
            ``levels``, what the last step was given, (n_windows, n_levels); ``verdict``, what
            `predict` gives; and, as far as the last step states them, ``probability``
            (`predict_proba`), ``score`` (`decision_function`) and ``alarm``, of bool: what
            `ThresholdLadder.detect` gives, or, of a detector, whether the score is below 0.

        Examples
        --------
        >>> from skarxlag import make_diagnoser
        >>> X = np.random.default_rng(0).normal(size=(40, 400))
        >>> X[20:] = X[20:].cumsum(axis=1)
        >>> y = np.repeat(["good", "worn"], 20)
        >>> found = make_diagnoser(healthy="good").fit(X, y).diagnose(X)
        >>> found.verdict[[0, 20]], found.alarm[[0, 20]]
        (array(['good', 'worn'], dtype='<U4'), array([False,  True]))
        """
        return self._in_batches(self._diagnose, X, params)

    def _diagnose(self, X, **params):
        levels, routed = self._before_last_step(X, params)
        last, can = self.steps[-1][1], answers(self)
        found = Bunch(levels=levels)
        if hasattr(last, "decision_function"):
            found.score = last.decision_function(levels, **routed)
            if self._is_detector():
                self._unless_silent(X, found.score, _LEAST_LOG_P - last.offset_)
        if can.states_probabilities:
            found.probability = self._unless_silent(X, last.predict_proba(levels), self._priors())
        elif can.conditions is None:
            # An outlier detector: its verdict is the sign of its score.
            found.alarm = found.score < 0
            found.verdict = np.where(found.alarm, -1, 1)
            return found
        found.verdict = last.predict(levels, **routed)
        if can.alarm:
            found.alarm = last.detect(levels)
        return found

    def _before_last_step(self, X, params):
        """What the last step is given, and the metadata that its `predict` requests."""
        routed = process_routing(self, "predict", **params)
        for name, step in self.steps[:-1]:
            if step not in (None, "passthrough"):
                X = step.transform(X, **routed[name].transform)
        return X, routed[self.steps[-1][0]].predict

    @_last_step_has("score_samples")
    def score_samples(self, X: ArrayLike, **params: Any) -> NDArray[Any]:
        """Log p-value of each window, where the last step is an outlier detector.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_samples) or (n_windows, 1 + n_inputs, n_samples)
            Windows.
        **params : dict of str to object
            Metadata, as in `predict`.

        Returns
        -------
        ndarray of shape (n_windows,)
            As the last step gives it.
        """
        return self._in_batches(self._score_samples, X, params)

    def _score_samples(self, X, **params):
        score = self._of_last_step("score_samples", X, **params)
        return self._unless_silent(X, score, _LEAST_LOG_P) if self._is_detector() else score

    @_last_step_has("p_values")
    def p_values(self, X: ArrayLike, **params: Any) -> NDArray[Any]:
        """p-value of each window: from a detector one, from `KnownConditions` of each condition.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_samples) or (n_windows, 1 + n_inputs, n_samples)
            Windows.
        **params : dict of str to object
            Metadata, as in `predict`.

        Returns
        -------
        ndarray of shape (n_windows,) or (n_windows, n_conditions)
            As the last step gives it.
        """
        return self._in_batches(self._p_values, X, params)

    def _p_values(self, X, **params):
        p_values = self._of_last_step("p_values", X, **params)
        return self._unless_silent(X, p_values, np.exp(_LEAST_LOG_P))

    def _of_last_step(self, method, X, **params):
        levels, routed = self._before_last_step(X, params)
        return getattr(self.steps[-1][1], method)(levels, **routed)

    @_some_step_has("adapt")
    def adapt(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Move references by what windows of a new speed show, commonly healthy ones.

        The windows go through the steps before the first one that has a method `adapt`, which is
        called with the result. To keep the pipeline for the old speed, adapt a copy that
        `copy.deepcopy` makes.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_samples) or (n_windows, 1 + n_inputs, n_samples)
            Windows at the new speed.
        y : array-like of shape (n_windows,)
            Their conditions, among those of `fit`.

        Returns
        -------
        DiagnosisPipeline
            This pipeline, for use at the new speed.
        """
        adapting = next(i for i, (_, step) in enumerate(self.steps) if hasattr(step, "adapt"))
        levels = self[:adapting].transform(X) if adapting > 0 else X
        self.steps[adapting][1].adapt(levels, y)
        return self

    @_last_step_has("score")
    def score(
        self,
        X: ArrayLike,
        y: ArrayLike | None = None,
        sample_weight: ArrayLike | None = None,
        **params: Any,
    ) -> float:
        """Score of the last step, the share of right verdicts where it is a classifier.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_samples) or (n_windows, 1 + n_inputs, n_samples)
            Windows.
        y : array-like of shape (n_windows,) or None, default=None
            Condition of each window.
        sample_weight : array-like of shape (n_windows,) or None, default=None
            As in `sklearn.pipeline.Pipeline`.
        **params : dict of str to object
            Metadata, as in `predict`.

        Returns
        -------
        float
            As the last step gives it.
        """
        with _routing(params):
            return super().score(X, y, sample_weight, **params)

    def _in_batches(self, method, X, params):
        if hasattr(X, "map_blocks"):
            raise TypeError(_LAZY)
        X = X if hasattr(X, "shape") else np.asarray(X)
        # The index of a table may hold numbers that are no positions.
        rows = X.iloc if hasattr(X, "iloc") else X
        n_windows = X.shape[0] if X.shape else 0
        params = {name: _by_window(name, value, n_windows) for name, value in params.items()}
        bytes_a_window = math.prod(X.shape[1:]) * getattr(getattr(X, "dtype", None), "itemsize", 8)
        bytes_a_window = max(bytes_a_window, 1)
        together = min(_ROWS_TOGETHER, _MOST_BYTES // bytes_a_window)
        batch_size = max(_BATCH_BYTES // bytes_a_window, together, 1)

        def of_batch(batch):
            some = {name: value[batch] if np.ndim(value) else value
                    for name, value in params.items()}  # fmt: skip
            return method(rows[batch], **some)

        with _routing(params):
            if n_windows <= batch_size:
                return method(X, **params)
            parts = map_batches(of_batch, n_windows, self.n_jobs, batch_size)
        if isinstance(parts[0], Bunch):
            return Bunch(**{name: np.concatenate([p[name] for p in parts]) for name in parts[0]})
        return np.concatenate(parts)


def in_one_pass(model: Any) -> DiagnosisPipeline:
    """Return a fitted model as a pipeline that diagnoses rows in one pass.

    Parameters
    ----------
    model : estimator
        A pipeline, also within a search or another pipeline; or any other fitted estimator.

    Returns
    -------
    DiagnosisPipeline
        The model itself, or its steps in a pipeline.
    """
    steps = unfolded_steps(model)
    if isinstance(model, DiagnosisPipeline) and len(steps) == len(model.steps):
        return model
    return DiagnosisPipeline(steps, n_jobs=getattr(model, "n_jobs", None))


def _routing(params):
    """Switch metadata routing on where there are metadata to route, not named for a step."""
    if params and not any("__" in name for name in params):
        return config_context(enable_metadata_routing=True)
    return config_context()


def _by_window(name, value, n_windows):
    """Metadata as an array with an entry for each window, or one value for all."""
    if np.ndim(value) == 0:
        return value
    value = np.asarray(value)
    if len(value) != n_windows:
        raise ValueError(f"{name} has {len(value)} entries, expected one for each of {n_windows} "
                         "windows in X.")  # fmt: skip
    return value
