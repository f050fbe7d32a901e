"""The three diagnosers, from windows to conditions."""

import numpy as np
from sklearn.pipeline import Pipeline
from sklearn.utils.metaestimators import available_if

from .cepstral import CepstralResidual
from .identification import ARXLaguerre
from .ladder import ThresholdLadder
from .observers import ExtendedStatePIObserver, PIObserver
from .parallel import map_batches

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


def _observing(observer, healthy, memory):
    steps = [
        ("identify", ARXLaguerre(n_jobs=observer.n_jobs)),
        ("observe", observer),
        ("decide", ThresholdLadder(healthy=healthy)),
    ]
    return DiagnosisPipeline(steps, memory=memory, n_jobs=observer.n_jobs)


def make_alpio(*, healthy=None, memory=None, n_jobs=None):
    """The paper's baseline: ARX-Laguerre bank, linear observer, power of the error.

    Parameters
    ----------
    healthy : label or None, default=None
        The healthy condition, for the detection threshold.
    memory : str, joblib.Memory or None, default=None
        Where a search over observer gains keeps the identification, as in
        `sklearn.pipeline.Pipeline`.
    n_jobs : int or None, default=None
        Threads that work on windows.

    Returns
    -------
    DiagnosisPipeline
        Steps "identify", "observe" and "decide".

    Examples
    --------
    >>> [name for name, _ in make_alpio().steps]
    ['identify', 'observe', 'decide']
    """
    return _observing(PIObserver(n_jobs=n_jobs), healthy, memory)


def make_extended_state_pio(*, healthy=None, memory=None, n_jobs=None):
    """The paper's proposal, repaired: extended-state observer, sliding surface, adapted gain.

    Parameters
    ----------
    healthy : label or None, default=None
        The healthy condition, for the detection threshold.
    memory : str, joblib.Memory or None, default=None
        Where a search over observer gains keeps the identification, as in
        `sklearn.pipeline.Pipeline`.
    n_jobs : int or None, default=None
        Threads that work on windows.

    Returns
    -------
    DiagnosisPipeline
        Steps "identify", "observe" and "decide".

    Examples
    --------
    >>> make_extended_state_pio()["observe"].evaluation
    'switching_gain'
    """
    return _observing(ExtendedStatePIObserver(n_jobs=n_jobs), healthy, memory)


def make_diagnoser(*, healthy=None, memory=None, n_jobs=None):
    """What we recommend: cepstral residuals of what one model of all conditions leaves.

    The model takes out what all conditions share, and what measured inputs explain;
    `CepstralResidual` compares the rest with each condition and discounts what a change of speed
    does to it. It tells which condition a window is of. Whether a machine is healthy at all is
    better left to `FaultDetector`: the threshold in here holds at the training speed only.

    Parameters
    ----------
    healthy : label or None, default=None
        The healthy condition, for the detection threshold.
    memory : str, joblib.Memory or None, default=None
        Where a search over later steps keeps the identification, as in
        `sklearn.pipeline.Pipeline`.
    n_jobs : int or None, default=None
        Threads that work on windows.

    Returns
    -------
    DiagnosisPipeline
        Steps "identify", "compare" and "decide".

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.signal import lfilter
    >>> noise = np.random.default_rng(0).normal(size=(40, 1200))
    >>> X = np.concatenate(
    ...     [lfilter([1], [1, -0.9], noise[:20]), lfilter([1], [1, 0.9], noise[20:])]
    ... )
    >>> y = np.repeat(["healthy", "worn"], 20)
    >>> make_diagnoser().fit(X, y).predict(1e6 * X[[0, 39]])
    array(['healthy', 'worn'], dtype='<U7')
    """
    steps = [
        ("identify", ARXLaguerre(order=8, bank=False, n_jobs=n_jobs)),
        ("compare", CepstralResidual(n_jobs=n_jobs)),
        ("decide", ThresholdLadder(healthy=healthy)),
    ]
    return DiagnosisPipeline(steps, memory=memory, n_jobs=n_jobs)
