"""Base classes of the estimators."""

from __future__ import annotations

from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, TransformerMixin
from sklearn.utils.validation import check_is_fitted

from ..kernels.speed_references import group_speeds
from .batches import MAY_BE_IN_BATCHES, RowsInBatches, chosen_rows
from .speeds import log_speeds, speeds_of_rows, with_plausible_speeds
from .state import CheckedEstimator, expect, uses_fitted
from .validation import (
    check_input_names,
    validate_innovations,
    weighted_windows,
)

#: Site of the documentation.
SITE = "https://skarxlag.github.io/skarxlag/"
#: Residual from all conditions of a row without a plausible speed: equal residuals name
#: no condition.
NO_RESIDUAL = 1.0


class DocumentedEstimator:
    """Estimator whose HTML representation links to its page on the site."""

    _doc_link_module: ClassVar = __name__.partition(".")[0]
    _doc_link_template: ClassVar = SITE + "api/generated/skarxlag.{estimator_name}.html"

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        if tags.transformer_tags is not None:
            tags.transformer_tags.preserves_dtype = ["float64", "float32"]
        return tags


class SignalEstimator(CheckedEstimator, DocumentedEstimator):
    """Estimator that accepts windows of several channels: arrays of three axes."""

    #: Whether `fit` reads rows batch by batch.
    _learns_in_batches: ClassVar[bool] = False
    window_shape_: NDArray[Any]
    n_models_: int

    @property
    def _n_channels(self):
        return int(self.window_shape_[0]) if len(self.window_shape_) == 2 else 1

    def _check_fitted(self):
        super()._check_fitted()
        self._check_array("window_shape_", (None,), "at least 1", int)
        shape = self.window_shape_
        is_of_rows = len(shape) in (1, 2) and shape[0] == self.n_features_in_
        expected = "1 or 2 lengths, first n_features_in_"
        expect(is_of_rows, "window_shape_", shape, expected)

    def _check_n_models(self):
        """Check `n_models_`, which only estimators of innovations have."""
        self._check_number("n_models_", kind=int)
        n_models = self.n_features_in_ if len(self.window_shape_) == 2 else 0
        expected = "that of window_shape_, or 0 for plain rows"
        expect(self.n_models_ == n_models, "n_models_", self.n_models_, expected)

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.input_tags.three_d_array = True
        return tags


class ArrayTransformer(TransformerMixin, BaseEstimator, auto_wrap_output_keys=None):
    """Transformer whose output has three axes, so that it is always an array."""

    def fit_transform(self, X: ArrayLike, y: Any = None, **params: Any) -> NDArray[Any]:
        """Fit, and transform the same windows.

        Parameters
        ----------
        X, y, **params
            As in `fit`.

        Returns
        -------
        ndarray of three axes
            As `transform` returns it. In `DiagnosisPipeline.fit`, it is computed when
            the next step reads it.
        """
        self.fit(X, y, **params)
        if MAY_BE_IN_BATCHES.get() and isinstance(X, np.ndarray | RowsInBatches):
            return RowsInBatches(X, self.transform)
        return self.transform(X)

    def set_output(self, *, transform: str | None = None) -> Self:
        """Accept the setting and keep returning arrays: tables have only two axes.

        ``Pipeline.set_output`` sets all steps, also those that return tables.

        Parameters
        ----------
        transform : {"default", "pandas", "polars"} or None, default=None
            Ignored.

        Returns
        -------
        estimator
            This transformer.
        """
        return self


class InnovationsTransformer(SignalEstimator, TransformerMixin, BaseEstimator):
    """Transformer of innovations whose fitted state follows from its parameters.

    A subclass checks its parameters in `_check_parameters`.
    """

    def fit(self, X: ArrayLike, y: Any = None) -> Self:
        """Check the parameters.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_models, n_samples) or (n_windows, n_samples)
            Innovations, or windows, which are the innovations of a model that predicts
            nothing.
        y : ignored
            Here by convention.

        Returns
        -------
        estimator
            The fitted transformer.

        Raises
        ------
        ValueError
            If a parameter is out of its range.
        """
        validate_innovations(self, X, reset=True)
        self._check_parameters()
        return self

    def _check_fitted(self):
        super()._check_fitted()
        self._check_n_models()

    def _model_prefixes(self, input_features, least):
        """Return the beginnings of names, one for each model if there are at least so many."""
        names = check_input_names(self, input_features)
        if self.n_models_ < least:
            return [""]
        models = (
            [f"model{c}" for c in range(self.n_models_)] if names is None else names
        )
        return [f"{model}_" for model in models]


class StretchTransformer(SignalEstimator, TransformerMixin, BaseEstimator):
    """Transformer from rows and their speeds to one residual for each condition.

    A subclass sets its own fitted attributes in `_learn`, and computes the residuals of
    checked rows in `_residuals`. The names of the residuals are those of the conditions
    and `_suffix`.
    """

    _suffix: ClassVar[str]

    #: Metadata routing passes these without `set_fit_request` and
    #: `set_transform_request`.
    __metadata_request__fit: ClassVar = {"rpm": True, "sample_weight": True}
    __metadata_request__transform: ClassVar = {"rpm": True}

    def fit(
        self,
        X: ArrayLike,
        y: ArrayLike,
        rpm: ArrayLike | None = None,
        sample_weight: ArrayLike | None = None,
    ) -> Self:
        """Learn what rows of each condition look like.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_models, n_samples) or (n_rows, n_samples)
            Innovations or plain rows. For `SpectralDistance`: log spectra of shape
            (n_rows, n_groups, n_frequencies) or (n_rows, n_frequencies).
        y : array-like of shape (n_rows,)
            Condition of each row.
        rpm : float, array-like of shape (n_rows,) or (n_rows, n_samples), default=None
            Nominal speed of each row in revolutions per minute, or of each of its
            samples. None: the speed is not known.
        sample_weight : array-like of shape (n_rows,) or None, default=None
            How many rows each one stands for, at least 0: its weight in means and
            covariances. None: one each.

        Returns
        -------
        estimator
            This transformer.

        Raises
        ------
        ValueError
            If a parameter is out of its range, a weight is negative, or a speed is not
            above 0. If orders are compared: also if `rpm` is given without a sampling
            rate, or a row has less than 3 revolutions.
        """
        X, y = self._validate(X, y, reset=True)
        self._check_parameters()
        log_speed = log_speeds(rpm, len(X))
        rows, y, weights = weighted_windows(np.arange(len(X)), y, sample_weight)
        classes, target = np.unique(y, return_inverse=True)
        self.classes_: NDArray[Any] = classes
        self.speeds_: NDArray[Any] = np.empty(0)
        if rpm is not None:
            self.speeds_ = np.exp(group_speeds(log_speed[rows])[0])
            rpm = speeds_of_rows(rpm, len(X))[rows]
        counted = X if len(rows) == len(X) else chosen_rows(X, rows)
        self._learn(counted, target, weights, rpm)
        return self

    def fit_transform(self, X: ArrayLike, y: ArrayLike, **params: Any) -> NDArray[Any]:
        """Fit, and compute the residuals of the same rows.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_models, n_samples) or (n_rows, n_samples)
            As in `fit`.
        y : array-like of shape (n_rows,)
            As in `fit`.
        **params : dict of str to object
            ``rpm`` and ``sample_weight``, as in `fit`. Rows of weight 0 get residuals,
            too.

        Returns
        -------
        ndarray of shape (n_rows, n_classes)
            As `transform` returns them.
        """
        # The method of scikit-learn's mixin does not pass rpm to transform.
        return self.fit(X, y, **params).transform(X, rpm=params.get("rpm"))

    @uses_fitted
    def transform(self, X: ArrayLike, rpm: ArrayLike | None = None) -> NDArray[Any]:
        """Compute one residual for each row and condition.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_models, n_samples) or (n_rows, n_samples)
            Rows as in `fit`. Stretches may have any length.
        rpm : float, array-like of shape (n_rows,) or (n_rows, n_samples), default=None
            Nominal speed in revolutions per minute. None: the speed is not known.

        Returns
        -------
        ndarray of shape (n_rows, n_classes)
            Residuals, in units of the variation that is expected.

        Raises
        ------
        ValueError
            As in `fit`; also if `rpm` is given and was not in `fit`.

        Warns
        -----
        UserWarning
            If a speed is not above 0, or farther than a factor of 5 outside the speeds
            of `fit`. The residuals of such a row are 1 for all conditions.
        """
        X, _ = self._validate(X)
        self._check_rpm_is_taken(rpm)
        is_plausible = True
        if rpm is not None:
            rpm, is_plausible = with_plausible_speeds(
                rpm, len(X), self.speeds_.round(6)
            )
        residuals = self._residuals(X, rpm)
        if not np.all(is_plausible):
            residuals[~is_plausible] = NO_RESIDUAL
        return residuals.astype(X.dtype, copy=False)

    def _validate(self, X, y=None, *, reset=False):
        return validate_innovations(self, X, y, reset=reset, any_length=True)

    def _check_fitted(self):
        super()._check_fitted()
        self._check_classes()
        self._check_speeds()

    def _check_rpm_is_taken(self, rpm):
        if rpm is not None and len(self.speeds_) == 0:
            raise ValueError(
                "rpm was given, but not in fit; expected it in both or in neither."
            )

    def _capabilities(self):
        speeds = tuple(self.speeds_.round(6).tolist())
        return {"takes_rpm": len(speeds) > 0, "speeds": speeds}

    def get_feature_names_out(
        self, input_features: ArrayLike | None = None
    ) -> NDArray[Any]:
        """Return the names of the residuals, one for each condition.

        Parameters
        ----------
        input_features : array-like of str or None, default=None
            Must be the names that `fit` saw; residuals are not named after them.

        Returns
        -------
        ndarray of str of shape (n_classes,)
            One name for each column of the output.
        """
        check_is_fitted(self)
        check_input_names(self, input_features)
        return np.array(
            [f"{name}_{self._suffix}" for name in self.classes_], dtype=object
        )

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.target_tags.required = True
        return tags
