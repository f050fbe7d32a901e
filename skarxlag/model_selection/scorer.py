"""Scorer that passes the speeds of windows to the method that it scores."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator
from sklearn.utils.metadata_routing import MetadataRequest

from ..core.capabilities import requests


class SpeedScorer(BaseEstimator):
    """Scorer for any metric whose estimator takes the speed of each window.

    The scorers of `sklearn.metrics.make_scorer` hand metadata to the metric, and none to
    `predict`. This one hands ``rpm`` to the method, and ``sample_weight`` to the metric.
    Metadata reach a scorer in `cross_validate` and in searches if metadata routing is
    switched on, by ``sklearn.set_config(enable_metadata_routing=True)``.

    Parameters
    ----------
    score_func : callable
        Metric with the arguments ``y_true`` and ``y_pred``, such as
        `sklearn.metrics.balanced_accuracy_score`.
    response_method : {"predict", "predict_proba", "decision_function"}, default="predict"
        Method whose result the metric takes.
    greater_is_better : bool, default=True
        False: the sign of the metric is changed, as scikit-learn does for losses.

    Examples
    --------
    >>> import numpy as np
    >>> from sklearn.metrics import log_loss
    >>> from skarxlag import make_diagnoser
    >>> X = np.random.default_rng(0).normal(size=(40, 400))
    >>> X[20:] = X[20:].cumsum(axis=1)
    >>> y = np.repeat(["good", "worn"], 20)
    >>> diagnoser = make_diagnoser().fit(X, y, rpm=300)
    >>> scorer = SpeedScorer(
    ...     log_loss, response_method="predict_proba", greater_is_better=False
    ... )
    >>> bool(-0.5 < scorer(diagnoser, X, y, rpm=300) < 0)
    True
    """

    def __init__(
        self,
        score_func: Callable[..., float],
        *,
        response_method: str = "predict",
        greater_is_better: bool = True,
    ) -> None:
        self.score_func = score_func
        self.response_method = response_method
        self.greater_is_better = greater_is_better

    def get_metadata_routing(self) -> MetadataRequest:
        """Return the request for ``rpm`` and ``sample_weight``.

        Returns
        -------
        MetadataRequest
            As scikit-learn's metadata routing takes it.
        """
        request = MetadataRequest(owner=self)
        for name in ("rpm", "sample_weight"):
            request.score.add_request(param=name, alias=True)
        return request

    def __call__(
        self,
        estimator: Any,
        X: ArrayLike,
        y: ArrayLike,
        rpm: ArrayLike | None = None,
        sample_weight: ArrayLike | None = None,
    ) -> float:
        """Compute the score of a fitted estimator.

        Parameters
        ----------
        estimator : estimator
            The fitted estimator.
        X : array-like of shape (n_windows, ...)
            Windows.
        y : array-like of shape (n_windows,)
            Conditions.
        rpm : array-like of shape (n_windows,) or None, default=None
            Speed of each window in revolutions per minute. An estimator that does not
            request it is not given it.
        sample_weight : array-like of shape (n_windows,) or None, default=None
            Weights for the metric.

        Returns
        -------
        float
            The score; higher is better.
        """
        takes_rpm = rpm is not None and requests(estimator, "predict", "rpm")
        metadata = {"rpm": rpm} if takes_rpm else {}
        predicted = getattr(estimator, self.response_method)(X, **metadata)
        weights = {} if sample_weight is None else {"sample_weight": sample_weight}
        score = float(self.score_func(y, predicted, **weights))
        return score if self.greater_is_better else -score
