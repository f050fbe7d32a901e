"""Cross-validation across shaft speeds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..core.speeds import log_speeds
from ..core.state import expect
from ..core.validation import ABOVE_0, check_flag, check_real
from ..kernels.speed_references import SAME_LOG_SPEED, group_speeds
from .groups import GroupSplitter


@dataclass(kw_only=True, eq=False, repr=False)
class SpeedSplit(GroupSplitter):
    """Splitter that trains at one speed and tests at another.

    It works in `cross_validate`, in `GridSearchCV`, and in one of these inside another
    one. `evaluate` returns the predictions themselves.

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
    skarxlag.model_selection.evaluate : Predictions of all splits.

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
        log_speeds_of_groups, at = group_speeds(log_speeds(table["rpm"], len(table)))
        self._check_settings(log_speeds_of_groups, "recording" in table)
        first, second = self._halves(table)
        splits = [
            (np.flatnonzero(first & trains), np.flatnonzero(second & tests))
            for trains, tests in self._sides(log_speeds_of_groups, at)
        ]
        least = min(len(side) for split in splits for side in split)
        name = (
            "Least number of windows of a speed in halves of the recordings in groups"
        )
        expect(least > 0, name, least, "at least 1")
        yield from splits

    def _sides(self, log_speeds_of_groups, at):
        """Yield the windows of the training speeds and of the test speeds of each split."""
        speeds = range(len(log_speeds_of_groups))
        if self.leave_out:
            for speed in speeds:
                yield at != speed, at == speed
            return
        for train in self._training_speeds(log_speeds_of_groups):
            for test in speeds:
                if self.same_speed or test != train:
                    yield at == train, at == test

    def _check_settings(self, log_speeds_of_groups, has_recordings):
        check_flag(self.leave_out, "leave_out")
        check_flag(self.same_speed, "same_speed")
        fits = not self.leave_out or (self.train_rpm is None and not self.same_speed)
        expect(fits, "leave_out", True, "False with `train_rpm` or `same_speed`")
        fits = not self.same_speed or has_recordings
        expected = "False without recordings, the second column of groups"
        expect(fits, "same_speed", True, expected)
        fits = len(log_speeds_of_groups) > 1 or self.same_speed
        expect(fits, "Speeds in groups", np.exp(log_speeds_of_groups), "at least two")

    def _training_speeds(self, log_speeds_of_groups):
        if self.train_rpm is None:
            return range(len(log_speeds_of_groups))
        check_real(self.train_rpm, "train_rpm", **ABOVE_0)
        distance = np.abs(log_speeds_of_groups - np.log(self.train_rpm))
        listed = np.exp(log_speeds_of_groups).round(3).tolist()
        expected = f"one of the speeds in groups, {listed}"
        expect(distance.min() <= SAME_LOG_SPEED, "train_rpm", self.train_rpm, expected)
        return [distance.argmin()]
