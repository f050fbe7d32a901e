"""Evaluation of classifiers at speeds, on bearings and under loads that training lacked."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pandas as pd
from joblib import Parallel, delayed
from numpy.typing import ArrayLike
from sklearn.base import clone

from ..core.capabilities import offers, requests
from .protocols import PROTOCOLS, Split, protocol_splits
from .specimen_split import locations_of_labels

#: Probability from which a location counts as stated with confidence.
STATED = 0.9


def evaluate(
    estimators: Mapping[str, Any],
    X: ArrayLike,
    y: ArrayLike,
    facts: pd.DataFrame,
    *,
    splits: list[Split] | None = None,
    params: Mapping[str, ArrayLike] | None = None,
    n_jobs: int | None = None,
    note: Callable[[str, int], Any] | None = None,
) -> pd.DataFrame:
    """Fit classifiers on the training of each split, and return their verdicts on its test.

    Parameters
    ----------
    estimators : mapping of str to estimator
        Classifiers to compare, by name. Clones of them are fitted. Any classifier of
        scikit-learn will do.
    X : array-like of shape (n_rows, ...)
        Rows.
    y : array-like of shape (n_rows,)
        Condition of each row.
    facts : DataFrame of n_rows rows
        As in `protocol_splits`.
    splits : list of Split or None, default=None
        None: all of `protocol_splits`.
    params : mapping of str to array-like or None, default=None
        Metadata with an entry for each row, such as ``rpm`` and ``specimen``. An
        estimator gets those that it requests by scikit-learn's metadata routing.
    n_jobs : int or None, default=None
        Number of splits that are computed at the same time.
    note : callable or None, default=None
        Called with the name of the estimator and the number of rows after each split.

    Returns
    -------
    DataFrame
        A line for each tested row of each split and estimator. ``estimator``,
        ``protocol``, ``split``, its number, ``train_rpm``, ``row``, the row of X,
        ``true`` and ``predicted``, the conditions; ``is_known``, whether the training
        had the condition; ``true_location`` and ``location``, where the fault is;
        ``probability``, that of this location, NaN without `predict_proba`; and the
        columns ``rpm`` and ``recording`` of `facts`.

    Examples
    --------
    >>> from sklearn.tree import DecisionTreeClassifier
    >>> facts = pd.DataFrame({"rpm": [300, 300, 400, 400]})
    >>> X, y = [[1.0], [3.0], [1.1], [3.2]], ["good", "inner", "good", "inner"]
    >>> verdicts = evaluate({"tree": DecisionTreeClassifier()}, X, y, facts)
    >>> verdicts["predicted"].tolist()
    ['good', 'inner', 'good', 'inner']
    """
    X, y = np.asarray(X), np.asarray(y)
    facts = facts.reset_index(drop=True)
    params = {name: np.asarray(values) for name, values in (params or {}).items()}
    if splits is None:
        splits, _ = protocol_splits(y, facts)
    tables = []
    for name, estimator in estimators.items():
        tests = Parallel(n_jobs, prefer="threads", return_as="generator")(
            delayed(_fit_and_test)(clone(estimator), X, y, params, split)
            for split in splits
        )
        for number, (split, table) in enumerate(zip(splits, tests, strict=True)):
            tables.append(
                table.assign(
                    estimator=name,
                    protocol=split.protocol,
                    split=number,
                    train_rpm=split.train_rpm,
                )
            )
            if note is not None:
                note(name, len(split.train) + len(split.test))
    shown = facts.loc[:, facts.columns.isin(["rpm", "recording"])]
    return pd.concat(tables, ignore_index=True).join(shown, on="row")


def _fit_and_test(estimator, X, y, params, split):
    def metadata(method, rows):
        return {
            name: values[rows]
            for name, values in params.items()
            if requests(estimator, method, name)
        }

    estimator.fit(X[split.train], y[split.train], **metadata("fit", split.train))
    tested = X[split.test], metadata("predict", split.test)
    if offers(estimator, "diagnose"):
        diagnosis = estimator.diagnose(tested[0], **tested[1])
        predicted = diagnosis.verdict
        probability = diagnosis.get("probability")
    else:
        predicted = estimator.predict(tested[0], **tested[1])
        has_probability = offers(estimator, "predict_proba")
        probability = (
            estimator.predict_proba(tested[0], **tested[1]) if has_probability else None
        )
    true = y[split.test]
    location = locations_of_labels(predicted)
    of_location = np.full(len(true), np.nan)
    if probability is not None:
        names = locations_of_labels(estimator.classes_)
        of_location = np.sum(probability * (names == location[:, np.newaxis]), axis=1)
    return pd.DataFrame(
        {
            "row": split.test,
            "true": true,
            "predicted": predicted,
            "is_known": np.isin(true, y[split.train]),
            "true_location": locations_of_labels(true),
            "location": location,
            "probability": of_location,
        }
    )


def evaluation_summary(verdicts: pd.DataFrame) -> pd.DataFrame:
    """Summarize the verdicts of `evaluate` by protocol and estimator.

    Parameters
    ----------
    verdicts : DataFrame
        As `evaluate` returns it.

    Returns
    -------
    DataFrame
        Percentages of rows. ``condition``: the condition is right; NaN if no training
        had it. ``location``: the location of the fault is right. ``recordings``: the
        share of recordings whose most frequent location is right. ``worst pair``: the
        smallest ``location`` of a training and one test speed. ``false alarms``:
        healthy rows called faulty. ``missed``: faulty rows called healthy. ``stated``:
        rows whose location has a probability of at least .9. ``right of stated``: those
        of them that are right.

    Examples
    --------
    >>> verdicts = pd.DataFrame({"protocol": "speed", "estimator": "E", "split": 0,
    ...     "rpm": 300, "true": ["a", "b"], "predicted": ["a", "a"], "is_known": True,
    ...     "true_location": ["healthy", "inner"], "location": ["healthy", "healthy"],
    ...     "probability": [0.95, 0.6]})
    >>> evaluation_summary(verdicts).round(1).loc[("speed", "E")].to_dict()["missed"]
    100.0
    """
    is_right = verdicts["true_location"] == verdicts["location"]
    is_healthy = verdicts["true_location"] == "healthy"
    is_called = verdicts["location"] == "healthy"
    is_stated = verdicts["probability"] >= STATED
    is_condition = (verdicts["true"] == verdicts["predicted"]).astype(float)
    shares = pd.DataFrame(
        {
            "condition": is_condition.where(verdicts["is_known"]),
            "location": is_right.astype(float),
            "false alarms": (~is_called).astype(float).where(is_healthy),
            "missed": is_called.astype(float).where(~is_healthy),
            "stated": is_stated.astype(float).where(verdicts["probability"].notna()),
            "right of stated": is_right.astype(float).where(is_stated),
        }
    )
    keys = ["protocol", "estimator"]
    table = 100 * shares.groupby([verdicts[key] for key in keys], sort=False).mean()
    tests = verdicts.assign(is_right=100.0 * is_right)
    pairs = [*keys, "split", *(["rpm"] if "rpm" in verdicts else [])]
    worst = tests.groupby(pairs, sort=False)["is_right"].mean()
    table.insert(2, "worst pair", worst.groupby(keys, sort=False).min())
    if "recording" in verdicts:
        groups = tests.groupby(
            [*keys, "split", "recording", "true_location"], sort=False
        )
        called = (
            groups["location"].agg(lambda names: names.mode().iloc[0]).reset_index()
        )
        called["is_right"] = 100.0 * (called["true_location"] == called["location"])
        of_recordings = called.groupby(keys, sort=False)["is_right"].mean()
        table.insert(2, "recordings", of_recordings)
    present = [name for name in PROTOCOLS if name in table.index.get_level_values(0)]
    return table.reindex(present, level="protocol")
