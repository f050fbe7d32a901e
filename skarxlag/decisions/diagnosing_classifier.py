"""Methods of a classifier whose `diagnose` computes all that is known of a row."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import ClassifierMixin
from sklearn.utils import Bunch


class DiagnosingClassifier(ClassifierMixin):
    """Classifier that takes its verdicts, probabilities and scores from `diagnose`."""

    #: Metadata routing passes these without `set_fit_request` and its siblings.
    __metadata_request__predict: ClassVar = {"rpm": True}
    __metadata_request__predict_proba: ClassVar = {"rpm": True}
    __metadata_request__predict_log_proba: ClassVar = {"rpm": True}
    __metadata_request__decision_function: ClassVar = {"rpm": True}
    __metadata_request__score: ClassVar = {"rpm": True, "sample_weight": True}

    def diagnose(
        self, X: ArrayLike, rpm: ArrayLike | None = None, **params: Any
    ) -> Bunch:
        """Compute ``verdict``, ``probability`` and ``score`` of rows."""
        raise NotImplementedError

    def predict(
        self, X: ArrayLike, rpm: ArrayLike | None = None, **params: Any
    ) -> NDArray[Any]:
        """Return the condition of each row.

        Parameters
        ----------
        X, rpm, **params
            As in `diagnose`.

        Returns
        -------
        ndarray of shape (n_rows,)
            Conditions.
        """
        return self.diagnose(X, rpm, **params).verdict

    def predict_proba(
        self, X: ArrayLike, rpm: ArrayLike | None = None, **params: Any
    ) -> NDArray[Any]:
        """Compute the probability of each condition.

        Parameters
        ----------
        X, rpm, **params
            As in `diagnose`.

        Returns
        -------
        ndarray of shape (n_rows, n_classes)
            Rows sum to 1. The probability of an unknown condition is divided equally
            among the conditions. If the verdict is not the most probable condition, the
            probabilities are changed as little as makes it the largest.
        """
        return self.diagnose(X, rpm, **params).probability

    def predict_log_proba(
        self, X: ArrayLike, rpm: ArrayLike | None = None, **params: Any
    ) -> NDArray[Any]:
        """Compute the logarithm of the probability of each condition.

        Parameters
        ----------
        X, rpm, **params
            As in `diagnose`.

        Returns
        -------
        ndarray of shape (n_rows, n_classes)
            Natural logarithms.
        """
        return np.log(self.predict_proba(X, rpm, **params))

    def decision_function(
        self, X: ArrayLike, rpm: ArrayLike | None = None, **params: Any
    ) -> NDArray[Any]:
        """Compute the scores of the conditions; the highest is the verdict.

        Parameters
        ----------
        X, rpm, **params
            As in `diagnose`.

        Returns
        -------
        ndarray of shape (n_rows, n_classes), or (n_rows,) for two conditions
            Log probabilities, up to a constant in each row. For two conditions the
            second's score less the first's.
        """
        return self.diagnose(X, rpm, **params).score

    def score(
        self,
        X: ArrayLike,
        y: ArrayLike,
        sample_weight: ArrayLike | None = None,
        **params: Any,
    ) -> float:
        """Compute the share of rows whose condition is right.

        Parameters
        ----------
        X, **params
            As in `diagnose`.
        y : array-like of shape (n_rows,)
            Their conditions.
        sample_weight : array-like of shape (n_rows,) or None, default=None
            Weight of each row.

        Returns
        -------
        float
            From 0 to 1.
        """
        # No other method needs this package, which takes long to import.
        from sklearn.metrics import accuracy_score

        return float(
            accuracy_score(y, self.predict(X, **params), sample_weight=sample_weight)
        )
