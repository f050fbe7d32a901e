"""Cross-validation across specimens."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any, ClassVar

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from sklearn.utils import check_consistent_length, column_or_1d

from ..core.fault_locations import location_of_label
from ..core.speeds import log_speeds
from ..core.state import expect
from ..kernels.speed_references import group_speeds
from .groups import GroupSplitter


@dataclass(kw_only=True, eq=False, repr=False)
class SpecimenSplit(GroupSplitter):
    """Splitter that tests specimens that were not used for training.

    A specimen is one bearing. Its conditions have a fault location: the part with the
    fault, or healthy. A fold leaves one specimen of each location out of the training,
    and is tested on these specimens. Score the location, because the condition of a
    specimen, such as a size of a fault, may not be among those of the training.

    Parameters
    ----------
    locations : mapping of label to label or None, default=None
        Fault location of each condition in `y`. A condition that is not among them has
        the location that its name states: ``IR7`` or ``inner race`` are of the inner
        race. A condition whose name states no location is a location of its own.
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
    fault location, so that every location remains in the training. A location with
    fewer specimens than others is complete in the last folds.
    `sklearn.model_selection.StratifiedGroupKFold` would leave such a location out.

    With speeds, each fold trains at one speed, and there is a split for each speed, in
    ascending order. A split whose training would lack a location of the test is left
    out.
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

    With locations as labels, scores are the share of right locations:

    >>> from sklearn.model_selection import cross_val_score
    >>> from sklearn.tree import DecisionTreeClassifier
    >>> levels, y = [[1.0], [1.1], [3.0], [3.2]], ["healthy", "healthy", "inner", "inner"]
    >>> settings = {"groups": ["H1", "H2", "A", "B"], "cv": SpecimenSplit()}
    >>> cross_val_score(DecisionTreeClassifier(), levels, y, **settings)
    array([1., 1.])
    """

    locations: Mapping[Any, Any] | None = None
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
            start is no whole number, `test_speed` is none of its values, no fault
            location has two specimens, or no speed has all tested locations without the
            specimens that are left out.
        TypeError
            If a parameter is of another type.
        """
        table = self._table(X, groups)
        expect(y is not None, "y", y, "the condition of each window")
        conditions = column_or_1d(y)
        check_consistent_length(table, conditions)
        choices = ("all", "same", "other")
        is_choice = self.test_speed in choices
        expect(is_choice, "test_speed", self.test_speed, f"one of {choices}")
        specimen = table["specimen"]
        missing = np.flatnonzero(specimen.isna()).tolist()
        expect(not missing, "Rows of groups without a specimen", missing, "none")
        location = locations_of_labels(conditions, self.locations)
        first, _ = self._halves(table)
        splits = []
        for left_out, (trains, tests) in product(
            _folds(specimen, location), self._speeds(table)
        ):
            is_out = specimen.isin(left_out).to_numpy()
            train = np.flatnonzero(~is_out & first & trains)
            test = np.flatnonzero(is_out & tests)
            if len(test) > 0 and set(location[test]) <= set(location[train]):
                splits.append((train, test))
        counts = specimen.groupby(location).nunique().to_dict()
        expected = (
            "at least two of a fault location, and a speed at which the others show all "
            "locations"
        )
        expect(len(splits) > 0, "Numbers of specimens in groups", counts, expected)
        yield from splits

    def _speeds(self, table):
        """Yield the windows that may train and those that may be tested, for each speed."""
        if "rpm" not in table:
            yield True, True
            return
        speeds, at = group_speeds(log_speeds(table["rpm"], len(table)))
        for speed in range(len(speeds)):
            is_same = at == speed
            tests = {"all": True, "same": is_same, "other": ~is_same}
            yield is_same, tests[self.test_speed]


def locations_of_labels(
    labels: ArrayLike, locations: Mapping[Any, Any] | None = None
) -> NDArray[np.object_]:
    """Return the fault location of each label.

    Parameters
    ----------
    labels : array-like of shape (n,)
        Conditions.
    locations : mapping of label to label or None, default=None
        As in `SpecimenSplit`.

    Returns
    -------
    ndarray of object of shape (n,)
        The location that is given, or that the name states, or else the label itself.

    Examples
    --------
    >>> locations_of_labels(["IR7", "Normal", "worn", "X"], {"X": "ball"}).tolist()
    ['inner', 'healthy', 'worn', 'ball']
    """
    names, index = np.unique(column_or_1d(labels), return_inverse=True)
    locations = [
        (locations or {}).get(name, location_of_label(name) or name)
        for name in names.tolist()
    ]
    return np.array(locations, dtype=object)[index]


def _folds(specimen, location):
    """Return the specimens that each fold leaves out, each of them once.

    A specimen may have several locations: it may be healthy first and faulty later. The
    locations with the fewest specimens choose first. Each location keeps a specimen.
    """
    of_locations = pd.Series(specimen.to_numpy()).groupby(location).agg(set).tolist()
    of_locations.sort(key=len)
    remaining = sorted(set(specimen))
    folds = []
    while True:
        left_out: set[Any] = set()
        for candidates in of_locations:
            if left_out.isdisjoint(candidates):
                left_out.update(
                    _first_to_leave_out(remaining, candidates, left_out, of_locations)
                )
        if not left_out:
            return folds
        remaining = [name for name in remaining if name not in left_out]
        folds.append(left_out)


def _first_to_leave_out(remaining, candidates, left_out, of_locations):
    """Return the first of the candidates without which each location keeps a specimen."""
    for name in remaining:
        rest = [kept - left_out - {name} for kept in of_locations]
        if name in candidates and all(rest):
            return {name}
    return set()
