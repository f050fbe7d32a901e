"""Cross-validation across shaft speeds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any, ClassVar

import numpy as np
import pandas as pd
from joblib import Parallel, delayed
from numpy.typing import ArrayLike, NDArray
from sklearn.base import clone
from sklearn.model_selection import BaseCrossValidator
from sklearn.utils import check_consistent_length, column_or_1d

from ._answers import requests
from ._state import expect
from ._validation import ABOVE_0, check_count, check_flag, check_real
from .kernels.speed_references import SAME_LOG_SPEED, group_speeds
from .speeds import log_speeds


def first_and_second_half(
    recording: ArrayLike, start: ArrayLike | None = None, window_length: int = 1
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Find the windows of the first and of the second half of their recording, in time.

    The middle lies halfway between the first sample of the first window and the last sample of
    the last one. A window across it belongs to neither half, so windows of different halves never
    share a sample.

    Parameters
    ----------
    recording : array-like of shape (n_windows,)
        Recording that each window was cut from.
    start : array-like of int of shape (n_windows,) or None, default=None
        Index of each window's first sample in its recording. None: windows are in time order and
        do not overlap.
    window_length : int, default=1
        Samples in a window; counts only with `start`.

    Returns
    -------
    first, second : ndarray of bool of shape (n_windows,)
        Windows of each half.

    Examples
    --------
    >>> first_and_second_half(["a", "a", "a"], [0, 100, 200], window_length=100)
    (array([ True, False, False]), array([False, False,  True]))
    >>> first, second = first_and_second_half(["a"] * 7, range(0, 1750, 250), window_length=1000)
    >>> int(first.sum()), int(second.sum())
    (2, 2)
    """
    names = pd.Series(column_or_1d(recording))
    if start is None:
        start, window_length = names.groupby(names, dropna=False).cumcount(), 1
    check_consistent_length(names, start)
    start = column_or_1d(start)
    of_recording = pd.Series(start).groupby(names, dropna=False)
    ends = of_recording.transform("min") + of_recording.transform("max")
    middle = (ends.to_numpy() + window_length) / 2
    return start + window_length <= middle, start >= middle


@dataclass(kw_only=True, eq=False, repr=False)
class SpeedSplit(BaseCrossValidator):
    """Splitter that trains at one speed and tests at another.

    It works in `cross_validate`, in `GridSearchCV`, and in one of these inside another one. Use
    `cross_speed_predict` instead for the predictions themselves, such as for a confusion matrix.

    Parameters
    ----------
    train_rpm : float or None, default=None
        The speed to train at. None: every speed in turn.
    leave_out : bool, default=False
        False: train at one speed, test at one other; a split for each ordered pair, in ascending
        order of the training speed, then of the test speed. True: train at all speeds but one and
        test at that; a split for each speed. The outer one of two nested splitters needs True,
        because the inner one needs windows of several speeds.
    same_speed : bool, default=False
        Whether the training speed is among the test speeds. It needs recordings in `groups`:
        without halves, a window would be on both sides.
    window_length : int or None, default=None
        Samples in a window. It is needed if `groups` has the starts of windows.

    See Also
    --------
    cross_speed_predict : Predictions at all test speeds.

    Notes
    -----
    `groups` holds the speed of each window, and in further columns its recording and the index of
    its first sample there. It is an array, a list of rows or a table; the order of its columns
    counts. As in all estimators, the lowest speed and those up to 2 % above it count as one speed,
    then the lowest of the others and those up to 2 % above it, and so on: 300, 305, 310, 315 and
    320 rpm are the three speeds 300 and 305, 310 and 315, and 320 rpm.

    With recordings, the first half of every recording is used for training and the second half for
    testing. The middle window of an odd number belongs to neither. Windows that overlap need their
    starts: the recording is then cut by time, and windows that straddle the cut belong to neither
    half.

    Examples
    --------
    >>> for train, test in SpeedSplit(train_rpm=300).split(None, groups=[300, 300, 400, 500]):
    ...     print(train, test)
    [0 1] [2]
    [0 1] [3]

    In a search, each combination is scored at speeds that it was not trained at:

    >>> import numpy as np
    >>> from sklearn.model_selection import GridSearchCV
    >>> from skarxlag import ThresholdLadder
    >>> levels = np.array([[1.0], [3.0], [1.1], [3.2], [1.3], [3.5]])
    >>> y, rpm = list("ababab"), [300, 300, 400, 400, 500, 500]
    >>> search = GridSearchCV(ThresholdLadder(), {"false_alarm_rate": [0.01, 0.1]}, cv=SpeedSplit())
    >>> search.fit(levels, y, groups=rpm).n_splits_
    6
    """

    train_rpm: float | None = None
    leave_out: bool = False
    same_speed: bool = False
    window_length: int | None = None

    __metadata_request__split: ClassVar = {"groups": True}

    def split(
        self, X: ArrayLike, y: Any = None, groups: ArrayLike | None = None
    ) -> Iterator[tuple[NDArray[Any], NDArray[Any]]]:
        """Yield the row numbers of training and test windows.

        Parameters
        ----------
        X : array-like of shape (n_windows, ...) or None
            Windows; only their number counts.
        y : ignored
            Here by convention.
        groups : array-like of shape (n_windows,), (n_windows, 2) or (n_windows, 3)
            Speed of each window; recording; index of its first sample there.

        Yields
        ------
        train, test : ndarray of int
            Row numbers.

        Raises
        ------
        ValueError
            If `groups` is missing or has another shape, the speeds are not two numbers above 0 or
            more, a start is no whole number, `train_rpm` is not among the speeds, halves leave no
            window at a speed, or settings contradict each other.
        TypeError
            If a parameter is of another type.
        """
        log_speed, recording, start = self._columns(X, groups)
        known, at = group_speeds(log_speed)
        self._check_settings(known, recording, start)
        speeds = range(len(known))
        pairs = product(self._training_speeds(known), speeds)
        sides = [(at == a, at == b) for a, b in pairs if self.same_speed or a != b]
        if self.leave_out:
            sides = [(at != speed, at == speed) for speed in speeds]
        first = second = True
        if recording is not None:
            first, second = first_and_second_half(recording, start, self.window_length)
        splits = [(np.flatnonzero(first & a), np.flatnonzero(second & b)) for a, b in sides]
        least = min(len(side) for sides in splits for side in sides)
        name = "Least number of windows of a speed in halves of the recordings in groups"
        expect(least > 0, name, least, "at least 1")
        yield from splits

    def _check_settings(self, known, recording, start):
        check_flag(self.leave_out, "leave_out")
        check_flag(self.same_speed, "same_speed")
        fits = not self.leave_out or (self.train_rpm is None and not self.same_speed)
        expect(fits, "leave_out", True, "False with `train_rpm` or `same_speed`")
        fits = not self.same_speed or recording is not None
        expect(fits, "same_speed", True, "False without recordings, the second column of groups")
        if start is not None:
            name = "window_length for the starts in groups"
            check_count(self.window_length, name)
        fits = len(known) > 1 or self.same_speed
        expect(fits, "Speeds in groups", np.exp(known), "at least two")

    def _training_speeds(self, known):
        if self.train_rpm is None:
            return range(len(known))
        check_real(self.train_rpm, "train_rpm", **ABOVE_0)
        distance = np.abs(known - np.log(self.train_rpm))
        wanted = f"one of the speeds in groups, {np.exp(known).round(3).tolist()}"
        expect(distance.min() <= SAME_LOG_SPEED, "train_rpm", self.train_rpm, wanted)
        return [distance.argmin()]

    def get_n_splits(
        self, X: ArrayLike | None = None, y: Any = None, groups: ArrayLike | None = None
    ) -> int:
        """Count the splits.

        Parameters
        ----------
        X : array-like of shape (n_windows, ...) or None, default=None
            Windows.
        y : ignored
            Here by convention.
        groups : array-like
            As in `split`.

        Returns
        -------
        int
            Number of pairs that `split` yields.
        """
        return sum(1 for _ in self.split(X, y, groups))

    def _columns(self, X, groups):
        table = pd.DataFrame(groups)
        fits = 1 <= table.shape[1] <= 3 and (X is None or len(table) == len(X))
        wanted = "a row for each window with its speed, its recording and its first sample's index"
        expect(fits, "groups.shape", table.shape, wanted)
        table = table.set_axis(["rpm", "recording", "start"][: table.shape[1]], axis=1)
        start = table.get("start")
        if start is not None:
            given, start = start, pd.to_numeric(start, errors="coerce")
            is_whole = start % 1 == 0
            expect(is_whole, "Starts in groups", given[~is_whole].tolist(), "whole numbers")
        return log_speeds(table["rpm"], len(table)), table.get("recording"), start


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

    Use `sklearn.model_selection.cross_validate` with `SpeedSplit` instead if only scores count.
    `sklearn.model_selection.cross_val_predict` does not fit here: a window may be tested in several
    splits, one for each training speed, or in none.

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
        Metadata of `fit` with an entry for each window, such as ``rpm`` and ``sample_weight``.
        `predict` gets those that it requests by scikit-learn's metadata routing, as the estimators
        of this package do.
    n_jobs : int or None, default=None
        Number of splits that are computed at the same time.

    Returns
    -------
    DataFrame
        A row for each window of each test: ``split``, its number; ``window``, the row in X;
        ``true`` and ``predicted``, the conditions.

    Examples
    --------
    >>> from sklearn.metrics import confusion_matrix
    >>> from sklearn.tree import DecisionTreeClassifier
    >>> levels, y = [[1.0], [3.0], [1.1], [3.2]], ["good", "worn", "good", "worn"]
    >>> found = cross_speed_predict(
    ...     DecisionTreeClassifier(), levels, y, groups=[300, 300, 400, 400]
    ... )
    >>> confusion_matrix(found["true"], found["predicted"])
    array([[2, 0],
           [0, 2]])
    """
    X = X if isinstance(X, pd.DataFrame) else np.asarray(X)
    y, params = column_or_1d(y), {k: np.asarray(value) for k, value in (params or {}).items()}
    check_consistent_length(X, y, *params.values())
    splits = list((SpeedSplit() if cv is None else cv).split(X, y, groups))
    task = delayed(_fit_and_predict)
    predicted = Parallel(n_jobs)(task(clone(estimator), X, y, params, *each) for each in splits)
    tables = [
        pd.DataFrame({"split": i, "window": test, "true": y[test], "predicted": verdict})
        for i, ((_, test), verdict) in enumerate(zip(splits, predicted, strict=True))
    ]
    return pd.concat(tables, ignore_index=True)


def _fit_and_predict(estimator, X, y, params, train, test):
    rows = X.iloc if isinstance(X, pd.DataFrame) else X
    estimator.fit(rows[train], y[train], **{name: value[train] for name, value in params.items()})
    requested = [name for name in params if requests(estimator, "predict", name)]
    return estimator.predict(rows[test], **{name: params[name][test] for name in requested})
