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
from ..core.state import expect
from .speed_split import SpeedSplit


def cross_speed_predict(
    estimator: Any,
    X: ArrayLike,
    y: ArrayLike,
    *,
    groups: ArrayLike,
    cv: Any = None,
    params: dict[str, Any] | None = None,
    method: str = "predict",
    n_jobs: int | None = None,
) -> pd.DataFrame:
    """Compute predictions at speeds that the estimator was not fitted at.

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
        ``sample_weight``. `method` gets those that it requests by scikit-learn's
        metadata routing, as the estimators of this package do.
    method : {"predict", "predict_proba", "decision_function"}, default="predict"
        Method of the estimator.
    n_jobs : int or None, default=None
        Number of splits that are computed at the same time.

    Returns
    -------
    DataFrame
        A row for each window of each test: ``split``, its number; ``window``, the row
        in X; ``true`` and ``predicted``, the conditions. With another method than
        "predict", a column for each class instead of ``predicted``, by its name, or one
        column ``decision`` if the method returns one number for each window.

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
    methods = ("predict", "predict_proba", "decision_function")
    expect(method in methods, "method", method, f"one of {methods}")
    X = X if isinstance(X, pd.DataFrame) else np.asarray(X)
    y = column_or_1d(y)
    params = {name: np.asarray(values) for name, values in (params or {}).items()}
    check_consistent_length(X, y, *params.values())
    splits = list((SpeedSplit() if cv is None else cv).split(X, y, groups))
    tables = Parallel(n_jobs)(
        delayed(_fit_and_predict)(clone(estimator), X, y, params, split, method)
        for split in splits
    )
    numbered = [table.assign(split=i) for i, table in enumerate(tables)]
    table = pd.concat(numbered, ignore_index=True)
    return table[["split", *table.columns.drop("split")]]


def _fit_and_predict(estimator, X, y, params, split, method):
    train, test = split
    rows = X.iloc if isinstance(X, pd.DataFrame) else X
    of_fit = {name: values[train] for name, values in params.items()}
    estimator.fit(rows[train], y[train], **of_fit)
    # All methods that decide take what `predict` takes.
    of_method = {
        name: values[test]
        for name, values in params.items()
        if requests(estimator, "predict", name)
    }
    values = np.asarray(getattr(estimator, method)(rows[test], **of_method))
    names = list(estimator.classes_)
    if values.ndim == 1:
        values = values[:, np.newaxis]
        names = ["predicted" if method == "predict" else "decision"]
    facts = pd.DataFrame({"window": test, "true": y[test]})
    return facts.join(pd.DataFrame(values, columns=names))
