"""What all transformers share that measure windows by groups of log spectra."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.utils.validation import check_is_fitted

from ._arrays import ArrayTransformer
from ._state import check_fitted_input, check_fitted_number
from ._validation import check_input_names


class GroupTransformer(ArrayTransformer, auto_wrap_output_keys=None):
    """Innovations to an array of shape (n_windows, n_groups, n_frequencies).

    A subclass names the groups of one model in `_group_names`, and sets `n_models_` in `fit`.
    """

    def get_feature_names_out(self, input_features: ArrayLike | None = None) -> NDArray[Any]:
        """Names of the groups.

        Parameters
        ----------
        input_features : array-like of str or None, default=None
            Names of the models, as `ARXLaguerre.get_feature_names_out` gives them.

        Returns
        -------
        ndarray of str of shape (n_groups,)
            One name along axis 1 of what `transform` returns; the name of its model is in front
            where there are several models.
        """
        check_is_fitted(self)
        names = check_input_names(self, input_features)
        groups = self._group_names()
        if self.n_models_ < 2:
            return np.array(groups, dtype=object)
        models = [f"model{c}" for c in range(self.n_models_)] if names is None else names
        return np.array([f"{model}_{group}" for model in models for group in groups], dtype=object)

    def _check_input(self):
        check_fitted_input(self, windows=True)
        n_models = self.n_features_in_ if len(self.window_shape_) == 2 else 0
        check_fitted_number(
            self, "n_models_", kind="i", valid=lambda n: n == n_models, expected=f"{n_models}"
        )

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.input_tags.three_d_array = True
        return tags
