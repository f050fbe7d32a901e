"""Protocols of `evaluate`: which rows train and which test, so that one thing differs."""

from collections.abc import Iterator, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from sklearn.model_selection import GroupKFold
from sklearn.utils import Bunch

from ...model_selection import SpecimenSplit, first_and_second_half, locations_of_labels

#: Most folds of loads.
_MOST_FOLDS = 5


class Split(NamedTuple):
    """Rows of a training and of its test.

    Parameters
    ----------
    train, test : ndarray of int
        Row numbers.
    protocol : str
        "speeds", "in" or "out" across speeds, "bearing" or "load".
    train_rpm : float
        Training speed; NaN if there are several.
    """

    train: NDArray[Any]
    test: NDArray[Any]
    protocol: str
    train_rpm: float


def half_splits(rig: Bunch, train_rpm: Sequence[float]) -> list[Split]:
    """Return the splits that train on first halves at one speed, and test all second halves.

    Parameters
    ----------
    rig : Bunch
        The rig.
    train_rpm : sequence of float
        Training speeds.
    """
    is_first, is_second = first_and_second_half(rig.recording)
    tested = np.flatnonzero(is_second)
    return [
        Split(np.flatnonzero(is_first & (rig.rpm == rpm)), tested, "speeds", rpm)
        for rpm in train_rpm
    ]


def speed_splits(rig: Bunch, usable: NDArray[np.bool_]) -> Iterator[Split]:
    """Yield the splits that train at one speed, and those that leave one out.

    A training that lacks a condition has no split.

    Parameters
    ----------
    rig : Bunch
        The rig. If it states campaigns, each of them is left out in turn, too.
    usable : ndarray of bool of shape (n_rows,)
        Rows that may be used.
    """
    parts = [(True, True)]
    if "campaign" in rig.further:
        campaign = rig.further["campaign"].loc[rig.recording].to_numpy(dtype=str)
        parts = [(campaign != name, campaign == name) for name in np.unique(campaign)]
    for protocol, rpm, (may_train, may_test) in product(
        ["in", "out"], np.unique(rig.rpm), parts
    ):
        is_train = (rig.rpm == rpm) == (protocol == "in")
        train = np.flatnonzero(is_train & may_train & usable)
        test = np.flatnonzero(~is_train & may_test & usable)
        if len(test) > 0 and len(set(rig.target[train])) == len(rig.target_names):
            train_rpm = float(rpm) if protocol == "in" else np.nan
            yield Split(train, test, protocol, train_rpm)


def splits_at_any_speed(
    rig: Bunch, usable: NDArray[np.bool_], halves: bool
) -> tuple[list[Split], list[str]]:
    """Return the results of `bearing_splits` and of `load_splits` together."""
    bearings, on_bearings = bearing_splits(rig, usable, halves)
    loads, on_loads = load_splits(rig, usable)
    return bearings + loads, on_bearings + on_loads


def bearing_splits(
    rig: Bunch, usable: NDArray[np.bool_], halves: bool
) -> tuple[list[Split], list[str]]:
    """Return the splits that leave bearings out, and sentences on what is not measured.

    Parameters
    ----------
    rig : Bunch
        The rig.
    usable : ndarray of bool of shape (n_rows,)
        Rows that may be used.
    halves : bool
        Whether first halves of recordings train, or whole recordings.

    Returns
    -------
    splits : list of Split
        Empty if bearings cannot be left out.
    sentences : list of str
        Empty if every location is tested and the specimens are stated.
    """
    rows = np.flatnonzero(usable)
    specimen = rig.get("specimen", rig.target)
    groups = pd.DataFrame({"specimen": specimen, "rpm": rig.rpm}).iloc[rows]
    if halves:
        groups["recording"] = rig.recording[rows]
        groups["start"] = rig.start[rows]
    target = rig.target[rows]
    location = locations_of_labels(target)
    counts = groups["specimen"].groupby(location).nunique()
    if counts.max() == 1:
        return [], [
            "Another bearing: not measured, because each location has one specimen."
        ]
    splitter = SpecimenSplit(window_length=rig.data.shape[-1])
    try:
        folds = list(splitter.split(None, target, groups))
    except ValueError:
        return [], [
            "Another bearing: not measured, because without one bearing of each "
            "location, no speed has all locations."
        ]
    splits = [
        Split(rows[train], rows[test], "bearing", float(rig.rpm[rows[train[0]]]))
        for train, test in folds
    ]
    tested = np.unique(np.concatenate([location[test] for _, test in folds]))
    sentences = []
    if np.array_equal(specimen, rig.target):
        sentences.append("Another bearing: each condition counts as one bearing.")
    if untested := ", ".join(sorted(set(counts.index) - set(tested))):
        sentences.append(
            f"Another bearing: not measured for {untested}, because too few such "
            "bearings were recorded."
        )
    return splits, sentences


def load_splits(rig: Bunch, usable: NDArray[np.bool_]) -> tuple[list[Split], list[str]]:
    """Return the splits that leave loads out, and sentences on what is not measured.

    Rows whose load is not stated are in no split, because their load may be any.

    Parameters
    ----------
    rig : Bunch
        The rig.
    usable : ndarray of bool of shape (n_rows,)
        Rows that may be used.

    Returns
    -------
    splits : list of Split
        Empty if loads cannot be left out.
    sentences : list of str
        Empty if all loads are stated.
    """
    load = rig.get("load", np.full(len(rig.target), np.nan))
    is_stated = pd.notna(load) & (load.astype(str) != "")
    rows = np.flatnonzero(usable & is_stated)
    n_loads = len(np.unique(load[rows]))
    if n_loads < 2:
        reason = "only one load is stated" if n_loads else "no load is stated"
        return [], [f"Another load: not measured, because {reason}."]
    folds = GroupKFold(min(n_loads, _MOST_FOLDS)).split(rows, groups=load[rows])
    conditions = set(rig.target)
    splits = [
        Split(rows[train], rows[test], "load", np.nan)
        for train, test in folds
        if set(rig.target[rows[train]]) == conditions
    ]
    if not splits:
        return [], [
            "Another load: not measured, because a condition was recorded at one load "
            "only."
        ]
    n_unstated = len(np.unique(rig.recording[usable & ~is_stated]))
    if n_unstated == 0:
        return splits, []
    return splits, [
        f"Another load: {n_unstated} recordings without a stated load were left out."
    ]
