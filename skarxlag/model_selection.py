"""Cross-validation across shaft speeds and across specimens."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
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

from .core.capabilities import requests
from .core.fault_locations import location_of_label
from .core.speeds import log_speeds
from .core.state import expect
from .core.validation import ABOVE_0, check_count, check_flag, check_real
from .kernels.speed_references import SAME_LOG_SPEED, group_speeds


def first_and_second_half(
    recording: ArrayLike, start: ArrayLike | None = None, window_length: int = 1
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Find the windows of the first and of the second half of their recording, in time.

    The middle lies halfway between the first sample of the first window and the last
    sample of the last one. A window across it belongs to neither half, so windows of
    different halves never share a sample.

    Parameters
    ----------
    recording : array-like of shape (n_windows,)
        Recording that each window was cut from.
    start : array-like of int of shape (n_windows,) or None, default=None
        Index of each window's first sample in its recording. None: windows are in time
        order and do not overlap.
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


class _GroupSplitter(BaseCrossValidator):
    """Splitter by columns of `groups`, the last of which are recordings and starts of windows."""

    __metadata_request__split: ClassVar = {"groups": True}
    _COLUMNS: ClassVar[tuple[str, ...]]
    window_length: int | None

    def get_n_splits(
        self, X: ArrayLike | None = None, y: Any = None, groups: ArrayLike | None = None
    ) -> int:
        """Count the splits.

        Parameters
        ----------
        X : array-like of shape (n_windows, ...) or None, default=None
            Windows.
        y : array-like of shape (n_windows,) or None, default=None
            As in `split`.
        groups : array-like
            As in `split`.

        Returns
        -------
        int
            Number of pairs that `split` yields.
        """
        return sum(1 for _ in self.split(X, y, groups))

    def _table(self, X, groups):
        """Return `groups` as a table with names of columns."""
        table = pd.DataFrame(groups)
        names = list(self._COLUMNS)
        fits = 1 <= table.shape[1] <= len(names) and (X is None or len(table) == len(X))
        wanted = (
            f"a row for each window, with the first of the columns {', '.join(names)}"
        )
        expect(fits, "groups.shape", table.shape, wanted)
        table = table.set_axis(names[: table.shape[1]], axis=1)
        if "start" in table:
            start = pd.to_numeric(table["start"], errors="coerce")
            is_whole = start % 1 == 0
            found = table["start"][~is_whole].tolist()
            expect(is_whole, "Starts in groups", found, "whole numbers")
            table["start"] = start
            check_count(self.window_length, "window_length for the starts in groups")
        return table

    def _halves(self, table):
        """Return the windows of first and of second halves; all of them without recordings."""
        if "recording" not in table:
            return True, True
        return first_and_second_half(
            table["recording"], table.get("start"), self.window_length
        )


@dataclass(kw_only=True, eq=False, repr=False)
class SpeedSplit(_GroupSplitter):
    """Splitter that trains at one speed and tests at another.

    It works in `cross_validate`, in `GridSearchCV`, and in one of these inside another
    one. Use `cross_speed_predict` instead for the predictions themselves, such as for a
    confusion matrix.

    Parameters
    ----------
    train_rpm : float or None, default=None
        The speed to train at. None: every speed in turn.
    leave_out : bool, default=False
        False: train at one speed, test at one other; a split for each ordered pair, in
        ascending order of the training speed, then of the test speed. True: train at
        all speeds but one and test at that; a split for each speed. The outer one of
        two nested splitters needs True, because the inner one needs windows of several
        speeds.
    same_speed : bool, default=False
        Whether the training speed is among the test speeds. It needs recordings in
        `groups`: without halves, a window would be on both sides.
    window_length : int or None, default=None
        Samples in a window. It is needed if `groups` has the starts of windows.

    See Also
    --------
    cross_speed_predict : Predictions at all test speeds.

    Notes
    -----
    `groups` holds the speed of each window, and in further columns its recording and
    the index of its first sample there. It is an array, a list of rows or a table; the
    order of its columns counts. As in all estimators, the lowest speed and those up to
    2 % above it count as one speed, then the lowest of the others and those up to 2 %
    above it, and so on: 300, 305, 310, 315 and 320 rpm are the three speeds 300 and
    305, 310 and 315, and 320 rpm.

    With recordings, the first half of every recording is used for training and the
    second half for testing. The middle window of an odd number belongs to neither.
    Windows that overlap need their starts: the recording is then cut by time, and
    windows that straddle the cut belong to neither half.

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

    _COLUMNS: ClassVar = ("rpm", "recording", "start")

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
            If `groups` is missing or has another shape, the speeds are not two numbers
            above 0 or more, a start is no whole number, `train_rpm` is not among the
            speeds, halves leave no window at a speed, or settings contradict each
            other.
        TypeError
            If a parameter is of another type.
        """
        table = self._table(X, groups)
        known, at = group_speeds(log_speeds(table["rpm"], len(table)))
        self._check_settings(known, "recording" in table)
        speeds = range(len(known))
        pairs = product(self._training_speeds(known), speeds)
        sides = [(at == a, at == b) for a, b in pairs if self.same_speed or a != b]
        if self.leave_out:
            sides = [(at != speed, at == speed) for speed in speeds]
        first, second = self._halves(table)
        splits = [
            (np.flatnonzero(first & a), np.flatnonzero(second & b)) for a, b in sides
        ]
        least = min(len(side) for sides in splits for side in sides)
        name = (
            "Least number of windows of a speed in halves of the recordings in groups"
        )
        expect(least > 0, name, least, "at least 1")
        yield from splits

    def _check_settings(self, known, has_recordings):
        check_flag(self.leave_out, "leave_out")
        check_flag(self.same_speed, "same_speed")
        fits = not self.leave_out or (self.train_rpm is None and not self.same_speed)
        expect(fits, "leave_out", True, "False with `train_rpm` or `same_speed`")
        fits = not self.same_speed or has_recordings
        expect(
            fits,
            "same_speed",
            True,
            "False without recordings, the second column of groups",
        )
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


@dataclass(kw_only=True, eq=False, repr=False)
class SpecimenSplit(_GroupSplitter):
    """Splitter that tests specimens that were not used for training.

    A specimen is one bearing. Its conditions have a place: healthy, or the part with
    the fault. A fold leaves one specimen of each place out of the training, and is
    tested on these specimens. Score the place, because the condition of a specimen,
    such as a size of a fault, may not be among those of the training.

    Parameters
    ----------
    places : mapping of label to label or None, default=None
        Place of each condition in `y`. A condition that is not among them has the place
        that its name says: ``IR7`` or ``inner race`` are of the inner race. A condition
        whose name says no place is a place of its own.
    test_speed : {"all", "same", "other"}, default="all"
        Speeds of the test: all, that of the training, or the others. It has no effect
        without speeds in `groups`.
    window_length : int or None, default=None
        Samples in a window. It is needed if `groups` has the starts of windows.

    See Also
    --------
    SpeedSplit : Other speeds of the same specimens.

    Notes
    -----
    `groups` holds the specimen of each window, and in further columns its speed, its
    recording and the index of its first sample there. It is an array, a list of rows or
    a table; the order of its columns counts.

    Each specimen is left out once. A specimen always trains if it is the only one of a
    place, so that every place remains in the training. A place with fewer specimens
    than others is complete in the last folds.
    `sklearn.model_selection.StratifiedGroupKFold` would leave such a place out.

    With speeds, each fold trains at one speed, and there is a split for each speed, in
    ascending order. A split whose training would lack a place of the test is left out.
    Speeds up to 2 % apart are one speed, as in `SpeedSplit`. With recordings, only the
    first half of each recording trains, as in `SpeedSplit`, so that both splitters
    train on the same number of windows of a recording.

    Examples
    --------
    >>> y = ["healthy", "healthy", "IR2", "IR5", "OR2", "OR5"]
    >>> specimen = ["H1", "H2", "A", "B", "C", "D"]
    >>> for train, test in SpecimenSplit().split(None, y, groups=specimen):
    ...     print(train, test)
    [1 3 5] [0 2 4]
    [0 2 4] [1 3 5]

    With places as labels, scores are the share of right places:

    >>> from sklearn.model_selection import cross_val_score
    >>> from sklearn.tree import DecisionTreeClassifier
    >>> levels, y = [[1.0], [1.1], [3.0], [3.2]], ["healthy", "healthy", "inner", "inner"]
    >>> settings = {"groups": ["H1", "H2", "A", "B"], "cv": SpecimenSplit()}
    >>> cross_val_score(DecisionTreeClassifier(), levels, y, **settings)
    array([1., 1.])
    """

    places: Mapping[Any, Any] | None = None
    test_speed: str = "all"
    window_length: int | None = None

    _COLUMNS: ClassVar = ("specimen", "rpm", "recording", "start")

    def split(
        self, X: ArrayLike, y: Any = None, groups: ArrayLike | None = None
    ) -> Iterator[tuple[NDArray[Any], NDArray[Any]]]:
        """Yield the row numbers of training and test windows.

        Parameters
        ----------
        X : array-like of shape (n_windows, ...) or None
            Windows; only their number counts.
        y : array-like of shape (n_windows,)
            Conditions. It is needed.
        groups : array-like of shape (n_windows,) or (n_windows, 2) to (n_windows, 4)
            Specimen of each window; speed; recording; index of its first sample there.

        Yields
        ------
        train, test : ndarray of int
            Row numbers.

        Raises
        ------
        ValueError
            If `y` or `groups` is missing or has another shape, a specimen is missing, a
            start is no whole number, `test_speed` is none of its values, no place has
            two specimens, or no speed has all tested places without the specimens that
            are left out.
        TypeError
            If a parameter is of another type.
        """
        table = self._table(X, groups)
        expect(y is not None, "y", y, "the condition of each window")
        conditions = column_or_1d(y)
        check_consistent_length(table, conditions)
        choices = ("all", "same", "other")
        expect(
            self.test_speed in choices,
            "test_speed",
            self.test_speed,
            f"one of {choices}",
        )
        specimen = table["specimen"]
        missing = np.flatnonzero(specimen.isna()).tolist()
        expect(not missing, "Rows of groups without a specimen", missing, "none")
        place = places_of_labels(conditions, self.places)
        first, _ = self._halves(table)
        splits = []
        for left_out, (trains, tests) in product(
            _folds(specimen, place), self._speeds(table)
        ):
            is_out = specimen.isin(left_out).to_numpy()
            train = np.flatnonzero(~is_out & first & trains)
            test = np.flatnonzero(is_out & tests)
            if len(test) > 0 and set(place[test]) <= set(place[train]):
                splits.append((train, test))
        counts = specimen.groupby(place).nunique().to_dict()
        wanted = (
            "at least two of a place, and a speed at which the others show all places"
        )
        expect(len(splits) > 0, "Numbers of specimens in groups", counts, wanted)
        yield from splits

    def _speeds(self, table):
        """Return the windows that may train and those that may be tested, for each speed."""
        if "rpm" not in table:
            return [(True, True)]
        known, at = group_speeds(log_speeds(table["rpm"], len(table)))
        tests = {"all": lambda speed: True, "same": at.__eq__, "other": at.__ne__}
        return [
            (at == speed, tests[self.test_speed](speed)) for speed in range(len(known))
        ]


def places_of_labels(
    labels: ArrayLike, places: Mapping[Any, Any] | None = None
) -> NDArray[np.object_]:
    """Return the place of each label.

    Parameters
    ----------
    labels : array-like of shape (n,)
        Conditions.
    places : mapping of label to label or None, default=None
        As in `SpecimenSplit`.

    Returns
    -------
    ndarray of object of shape (n,)
        The place that is given, or that the name says, or else the label itself.

    Examples
    --------
    >>> places_of_labels(["IR7", "Normal", "worn", "X"], {"X": "ball"}).tolist()
    ['inner', 'healthy', 'worn', 'ball']
    """
    names, index = np.unique(column_or_1d(labels), return_inverse=True)
    given = places or {}
    found = [
        given.get(name, location_of_label(name) or name) for name in names.tolist()
    ]
    return np.array(found, dtype=object)[index]


def _folds(specimen, place):
    """Return the specimens that each fold leaves out, each of them once.

    A specimen may have several places: it may be healthy first and faulty later. The
    places with the fewest specimens choose first. Each place keeps a specimen.
    """
    of_places = pd.Series(specimen.to_numpy()).groupby(place).agg(set).tolist()
    remaining = sorted(set(specimen))
    folds = []
    while True:
        left_out: set[Any] = set()
        for of_place in sorted(of_places, key=len):
            if not left_out & of_place:
                fits = [
                    each
                    for each in remaining
                    if each in of_place
                    and all(kept - left_out - {each} for kept in of_places)
                ]
                left_out.update(fits[:1])
        if not left_out:
            return folds
        remaining = [each for each in remaining if each not in left_out]
        folds.append(left_out)


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
    >>> found = cross_speed_predict(
    ...     DecisionTreeClassifier(), levels, y, groups=[300, 300, 400, 400]
    ... )
    >>> confusion_matrix(found["true"], found["predicted"])
    array([[2, 0],
           [0, 2]])
    """
    X = X if isinstance(X, pd.DataFrame) else np.asarray(X)
    y, params = (
        column_or_1d(y),
        {k: np.asarray(value) for k, value in (params or {}).items()},
    )
    check_consistent_length(X, y, *params.values())
    splits = list((SpeedSplit() if cv is None else cv).split(X, y, groups))
    task = delayed(_fit_and_predict)
    predicted = Parallel(n_jobs)(
        task(clone(estimator), X, y, params, *each) for each in splits
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
    estimator.fit(
        rows[train], y[train], **{name: value[train] for name, value in params.items()}
    )
    requested = [name for name in params if requests(estimator, "predict", name)]
    return estimator.predict(
        rows[test], **{name: params[name][test] for name in requested}
    )
