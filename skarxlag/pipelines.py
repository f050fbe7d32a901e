"""A Pipeline that gives its verdicts batch by batch."""

import numpy as np
from sklearn.pipeline import Pipeline
from sklearn.utils.metaestimators import available_if

from ._parallel import map_batches

#: Windows that go through all steps together: enough to make little of what checks cost, and few
#: enough that the innovations of ten models take 50 MB.
_BATCH = 512


def _last_step_has(name):
    return available_if(lambda pipeline: hasattr(pipeline.steps[-1][1], name))


class DiagnosisPipeline(Pipeline):
    """A Pipeline that gives its verdicts batch by batch.

    The innovations of a bank are many times larger than its windows. A batch of windows goes
    through all steps before the next one is looked at, so what is between the steps takes a fixed
    amount of memory for any number of windows. Every window is diagnosed by itself: the verdicts
    are those of `sklearn.pipeline.Pipeline`, bit for bit.

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

    def __init__(self, steps, *, transform_input=None, memory=None, verbose=False, n_jobs=None):
        super().__init__(steps, transform_input=transform_input, memory=memory, verbose=verbose)
        self.n_jobs = n_jobs

    @_last_step_has("predict")
    def predict(self, X):
        """Condition of each window.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_samples) or (n_windows, 1 + n_inputs, n_samples)
            Windows; an array that is mapped from a file is read batch by batch.

        Returns
        -------
        ndarray of shape (n_windows,)
            Verdicts of the last step.
        """
        return self._in_batches(super().predict, X)

    @_last_step_has("predict_proba")
    def predict_proba(self, X):
        """Confidence in each condition.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_samples) or (n_windows, 1 + n_inputs, n_samples)
            Windows.

        Returns
        -------
        ndarray of shape (n_windows, n_classes)
            As the last step gives it.
        """
        return self._in_batches(super().predict_proba, X)

    @_last_step_has("predict_log_proba")
    def predict_log_proba(self, X):
        """Logarithm of the confidence in each condition.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_samples) or (n_windows, 1 + n_inputs, n_samples)
            Windows.

        Returns
        -------
        ndarray of shape (n_windows, n_classes)
            As the last step gives it.
        """
        return self._in_batches(super().predict_log_proba, X)

    @_last_step_has("decision_function")
    def decision_function(self, X):
        """Scores of the conditions.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_samples) or (n_windows, 1 + n_inputs, n_samples)
            Windows.

        Returns
        -------
        ndarray of shape (n_windows, n_classes), or (n_windows,) for two conditions
            As the last step gives it.
        """
        return self._in_batches(super().decision_function, X)

    def _in_batches(self, method, X):
        X = X if hasattr(X, "shape") else np.asarray(X)
        n_windows = X.shape[0] if X.shape else 0
        if n_windows <= _BATCH:
            return method(X)
        parts = map_batches(lambda batch: method(X[batch]), n_windows, self.n_jobs, _BATCH)
        return np.concatenate(parts)
