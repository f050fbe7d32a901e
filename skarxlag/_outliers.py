"""What the outlier detectors of rows have in common."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, OutlierMixin

from ._documentation import DocumentedEstimator


class RowOutlierDetector(DocumentedEstimator, OutlierMixin, BaseEstimator):
    """Base of outlier detectors whose score is the logarithm of a p-value.

    A subclass has `fit`, `score_samples` and the attribute `offset_`, the logarithm of the stated
    rate. All of them take `rpm`, the speed of each row.
    """

    offset_: float

    #: Metadata routing hands `rpm` over without a call of `set_fit_request` and its like.
    __metadata_request__fit: ClassVar = {"rpm": True}
    __metadata_request__predict: ClassVar = {"rpm": True}
    __metadata_request__decision_function: ClassVar = {"rpm": True}

    def decision_function(self, X: ArrayLike, rpm: ArrayLike | None = None) -> NDArray[Any]:
        """Logarithm of the p-value over the stated rate: negative for an outlier.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows.
        rpm : float, array-like of shape (n_rows,) or None, default=None
            Their speeds, as in `score_samples`.

        Returns
        -------
        ndarray of shape (n_rows,)
            Natural logarithms.
        """
        return self.score_samples(X, rpm) - self.offset_

    def predict(self, X: ArrayLike, rpm: ArrayLike | None = None) -> NDArray[Any]:
        """1 for a row like those of `fit`, -1 for an outlier.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows.
        rpm : float, array-like of shape (n_rows,) or None, default=None
            Their speeds, as in `score_samples`.

        Returns
        -------
        ndarray of int of shape (n_rows,)
            Verdicts.
        """
        return np.where(self.decision_function(X, rpm) < 0, -1, 1)

    def fit_predict(
        self, X: ArrayLike, y: Any = None, rpm: ArrayLike | None = None
    ) -> NDArray[Any]:
        """Calibrate on rows, and say which of them are unlike the others.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows.
        y : array-like of shape (n_rows,) or None, default=None
            As in `fit`.
        rpm : float, array-like of shape (n_rows,) or None, default=None
            Their speeds.

        Returns
        -------
        ndarray of int of shape (n_rows,)
            1 or -1.
        """
        return self.fit(X, y, rpm=rpm).predict(X, rpm=rpm)

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.input_tags.three_d_array = True
        return tags
