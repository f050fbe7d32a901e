"""Groups of windows for cross-validation: recordings, their halves, and columns of `groups`."""

from __future__ import annotations

from typing import Any, ClassVar

import pandas as pd
from numpy.typing import ArrayLike, NDArray
from sklearn.model_selection import BaseCrossValidator
from sklearn.utils import check_consistent_length, column_or_1d

from ..core.state import expect
from ..core.validation import check_count


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
        start = names.groupby(names, dropna=False).cumcount()
        window_length = 1
    check_consistent_length(names, start)
    start = column_or_1d(start)
    of_recording = pd.Series(start).groupby(names, dropna=False)
    ends = of_recording.transform("min") + of_recording.transform("max")
    middle = (ends.to_numpy() + window_length) / 2
    return start + window_length <= middle, start >= middle


class GroupSplitter(BaseCrossValidator):
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
        first = {"rpm": "the speed", "specimen": "the bearing"}[self._COLUMNS[0]]
        expected = f"{first} of each window, as in groups={self._COLUMNS[0]}"
        expect(groups is not None, "groups", groups, expected)
        table = pd.DataFrame(groups)
        names = list(self._COLUMNS)
        fits = 1 <= table.shape[1] <= len(names) and (X is None or len(table) == len(X))
        expected = (
            f"a row for each window, with the first of the columns {', '.join(names)}"
        )
        expect(fits, "groups.shape", table.shape, expected)
        table = table.set_axis(names[: table.shape[1]], axis=1)
        if "start" in table:
            start = pd.to_numeric(table["start"], errors="coerce")
            is_whole = start % 1 == 0
            others = table["start"][~is_whole].tolist()
            expect(is_whole, "Starts in groups", others, "whole numbers")
            check_count(self.window_length, "window_length for the starts in groups")
            table["start"] = start
        return table

    def _halves(self, table):
        """Return the windows of first and of second halves; all of them without recordings."""
        if "recording" not in table:
            return True, True
        return first_and_second_half(
            table["recording"], table.get("start"), self.window_length
        )
