"""What transformers of stretches share: rows with a speed, and a residual for each condition."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, TransformerMixin
from sklearn.utils.validation import check_is_fitted

from ._documentation import DocumentedEstimator
from ._validation import check_input_names


class StretchTransformer(DocumentedEstimator, TransformerMixin, BaseEstimator):
    """Stretches, and a speed for each of them, to one residual for each condition.

    A subclass names its residuals by the conditions and `_suffix`.
    """

    classes_: NDArray[Any]
    _suffix: ClassVar[str]

    #: Metadata routing hands these over without a call of `set_fit_request` and its like.
    __metadata_request__fit: ClassVar = {"rpm": True, "sample_weight": True}
    __metadata_request__transform: ClassVar = {"rpm": True}

    def fit_transform(
        self,
        X: ArrayLike,
        y: ArrayLike,
        rpm: ArrayLike | None = None,
        sample_weight: ArrayLike | None = None,
    ) -> NDArray[Any]:
        """Calibrate, and give the residuals of the same stretches.

        Parameters
        ----------
        X : array-like of shape (n_stretches, n_models, n_samples) or (n_stretches, n_samples)
            As in `fit`.
        y : array-like of shape (n_stretches,)
            Condition of each stretch.
        rpm : float, array-like of shape (n_stretches,) or (n_stretches, n_samples), default=None
            As in `fit`.
        sample_weight : array-like of shape (n_stretches,) or None, default=None
            As in `fit`. Stretches of weight 0 get residuals, too.

        Returns
        -------
        ndarray of shape (n_stretches, n_classes)
            What `transform` gives.
        """
        # That of scikit-learn's mixin does not hand rpm on to transform.
        return self.fit(X, y, rpm=rpm, sample_weight=sample_weight).transform(X, rpm=rpm)

    def get_feature_names_out(self, input_features: ArrayLike | None = None) -> NDArray[Any]:
        """Names of the residuals: their conditions.

        Parameters
        ----------
        input_features : array-like of str or None, default=None
            Checked against what the transformer was fitted on; residuals are not named after it.

        Returns
        -------
        ndarray of str of shape (n_classes,)
            One name a column of what `transform` returns.
        """
        check_is_fitted(self)
        check_input_names(self, input_features)
        return np.array([f"{name}_{self._suffix}" for name in self.classes_], dtype=object)

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.target_tags.required = True
        tags.input_tags.three_d_array = True
        tags.transformer_tags.preserves_dtype = ["float64", "float32"]
        return tags
