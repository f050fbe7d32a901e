"""Predictions at speeds that were not used for training."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from joblib import Parallel, delayed
from numpy.typing import ArrayLike
from sklearn.base import clone
from sklearn.utils import check_consistent_length, column_or_1d

from ..core.capabilities import requests
from .speed_split import SpeedSplit


def cross_speed_predict(
    estimator: Any,
    X: ArrayLike,
    y: ArrayLike,
    *,
    groups: ArrayLike,
    cv: Any = None,
    params: dict[str, Any] | None = None,
    n_jobs: int | None = None,
) -> pd.DataFrame:
    """Predict conditions at speeds that the estimator was not fitted at.

    Use `sklearn.model_selection.cross_validate` with `SpeedSplit` instead if only
    scores count. `sklearn.model_selection.cross_val_predict` does not fit here: a
    window may be tested in several splits, one for each training speed, or in none.

    Parameters
    ----------
    estimator : estimator
        A classifier or a pipeline. Clones of it are fitted.
    X : array-like of shape (n_windows, ...)
        Windows.
    y : array-like of shape (n_windows,)
        Conditions.
    groups : array-like
        Speeds, as in `SpeedSplit.split`.
    cv : splitter or None, default=None
        Splitter. None: `SpeedSplit()`.
    params : dict of str to array-like or None, default=None
        Metadata of `fit` with an entry for each window, such as ``rpm`` and
        ``sample_weight``. `predict` gets those that it requests by scikit-learn's
        metadata routing, as the estimators of this package do.
    n_jobs : int or None, default=None
        Number of splits that are computed at the same time.

    Returns
    -------
    DataFrame
        A row for each window of each test: ``split``, its number; ``window``, the row
        in X; ``true`` and ``predicted``, the conditions.

    Examples
    --------
    >>> from sklearn.metrics import confusion_matrix
    >>> from sklearn.tree import DecisionTreeClassifier
    >>> levels, y = [[1.0], [3.0], [1.1], [3.2]], ["good", "worn", "good", "worn"]
    >>> table = cross_speed_predict(
    ...     DecisionTreeClassifier(), levels, y, groups=[300, 300, 400, 400]
    ... )
    >>> confusion_matrix(table["true"], table["predicted"])
    array([[2, 0],
           [0, 2]])
    """
    X = X if isinstance(X, pd.DataFrame) else np.asarray(X)
    y = column_or_1d(y)
    params = {name: np.asarray(values) for name, values in (params or {}).items()}
    check_consistent_length(X, y, *params.values())
    splits = list((SpeedSplit() if cv is None else cv).split(X, y, groups))
    predicted = Parallel(n_jobs)(
        delayed(_fit_and_predict)(clone(estimator), X, y, params, train, test)
        for train, test in splits
    )
    tables = [
        pd.DataFrame(
            {"split": i, "window": test, "true": y[test], "predicted": verdict}
        )
        for i, ((_, test), verdict) in enumerate(zip(splits, predicted, strict=True))
    ]
    return pd.concat(tables, ignore_index=True)


def _fit_and_predict(estimator, X, y, params, train, test):
    rows = X.iloc if isinstance(X, pd.DataFrame) else X
    of_fit = {name: values[train] for name, values in params.items()}
    estimator.fit(rows[train], y[train], **of_fit)
    of_predict = {
        name: values[test]
        for name, values in params.items()
        if requests(estimator, "predict", name)
    }
    return estimator.predict(rows[test], **of_predict)
