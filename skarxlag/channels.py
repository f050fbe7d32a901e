"""Windows of several channels as rows of a table, for tools that take two axes only."""

from __future__ import annotations

from numbers import Integral
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.utils import check_array, check_scalar
from sklearn.utils.validation import validate_data

from ._base import ArrayTransformer
from ._state import TABLE, remember_parameters, uses_fitted
from ._validation import check_input_names


class ChannelRows(ArrayTransformer, auto_wrap_output_keys=None):
    """Read the rows of a table as windows of several channels.

    Many tools take a table: an array of two axes, or a DataFrame. Windows of several channels have
    three axes. As rows of a table they have the samples of the output first, and then those of each
    input in turn, which is what ``X.reshape(len(X), -1)`` and `inverse_transform` make of them. As
    the first step of a pipeline, this transformer makes windows of such rows again.

    Parameters
    ----------
    n_channels : int, default=1
        Channels of a window, at least 1. The columns of the table are divided among them, in equal
        parts.

    Attributes
    ----------
    n_features_in_ : int
        Columns of the table.
    feature_names_in_ : ndarray of str
        Names of the columns, when fitted on a DataFrame.

    See Also
    --------
    skarxlag.ARXLaguerre : Takes the windows, of which the channels after the first are inputs.

    Examples
    --------
    >>> import numpy as np
    >>> windows = np.arange(12.0).reshape(2, 2, 3)  # windows, channels, samples
    >>> channels = ChannelRows(n_channels=2)
    >>> rows = windows.reshape(len(windows), -1)
    >>> rows.shape
    (2, 6)
    >>> channels.fit_transform(rows).shape
    (2, 2, 3)
    >>> bool(np.all(channels.inverse_transform(windows) == rows))
    True

    In front of a diagnoser, so that `sklearn.ensemble.BaggingClassifier` can draw from the windows:

    >>> from sklearn.ensemble import BaggingClassifier
    >>> from skarxlag import DiagnosisPipeline, make_alpio
    >>> X = np.random.default_rng(0).normal(size=(40, 2, 300))
    >>> X[20:, 0] = X[20:, 0].cumsum(axis=1)
    >>> y = np.repeat(["good", "worn"], 20)
    >>> on_rows = DiagnosisPipeline([("channels", ChannelRows(n_channels=2)), *make_alpio().steps])
    >>> bag = BaggingClassifier(on_rows, n_estimators=3, random_state=0)
    >>> bag.fit(X.reshape(40, -1), y).score(X.reshape(40, -1), y)
    1.0
    """

    def __init__(self, *, n_channels: int = 1) -> None:
        self.n_channels = n_channels

    def fit(self, X: ArrayLike, y: Any = None) -> Self:
        """Check that the columns can be divided among the channels.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_channels * n_samples)
            Rows.
        y : ignored
            Here by convention.

        Returns
        -------
        ChannelRows
            The fitted transformer.

        Raises
        ------
        ValueError
            If `n_channels` is below 1, or the number of columns is no multiple of it.
        """
        X = validate_data(self, X, dtype=[np.float64, np.float32])
        self._check_parameters()
        self._check_relations()
        remember_parameters(self)
        return self

    @uses_fitted
    def transform(self, X: ArrayLike) -> NDArray[Any]:
        """Windows of the rows.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_channels * n_samples)
            Rows.

        Returns
        -------
        ndarray of shape (n_windows, n_channels, n_samples)
            Windows.
        """
        X = validate_data(self, X, dtype=[np.float64, np.float32], reset=False)
        return X.reshape(len(X), self.n_channels, -1)

    @uses_fitted
    def inverse_transform(self, X: ArrayLike) -> NDArray[Any]:
        """Rows of windows.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_channels, n_samples)
            Windows.

        Returns
        -------
        ndarray of shape (n_windows, n_channels * n_samples)
            Rows.

        Raises
        ------
        ValueError
            If the windows are not of the shape that `transform` gives.
        """
        X = check_array(X, dtype=[np.float64, np.float32], allow_nd=True)
        wanted = (self.n_channels, self.n_features_in_ // self.n_channels)
        if X.shape[1:] != wanted:
            raise ValueError(f"X has windows of shape {X.shape[1:]}, expected {wanted}.")
        return X.reshape(len(X), -1)

    @uses_fitted
    def get_feature_names_out(self, input_features: ArrayLike | None = None) -> NDArray[Any]:
        """Names of the channels.

        Parameters
        ----------
        input_features : array-like of str or None, default=None
            Checked against what the transformer was fitted on; channels are not named after it.

        Returns
        -------
        ndarray of str of shape (n_channels,)
            One name along axis 1 of what `transform` returns.
        """
        check_input_names(self, input_features)
        return np.array([f"channel{c}" for c in range(self.n_channels)], dtype=object)

    def _check_parameters(self):
        check_scalar(self.n_channels, "n_channels", Integral, min_val=1)

    def _answers(self):
        return {
            "window_length": self.n_features_in_ // self.n_channels,
            "n_channels": self.n_channels,
        }

    _state = TABLE

    def _check_relations(self):
        if self.n_features_in_ % self.n_channels != 0:
            raise ValueError(
                f"n_features_in_ == {self.n_features_in_} columns, expected a multiple of "
                f"n_channels == {self.n_channels}."
            )
