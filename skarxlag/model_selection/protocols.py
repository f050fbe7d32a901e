"""Protocols of an evaluation: which rows train and which test, so that one thing differs."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from sklearn.model_selection import GroupKFold
from sklearn.utils import column_or_1d

from ..core.speeds import log_speeds
from ..core.state import expect
from ..kernels.speed_references import group_speeds
from .groups import first_and_second_half
from .specimen_split import SpecimenSplit, locations_of_labels

#: What differs between training and test, by the name of the protocol.
PROTOCOLS = {
    "speed": "another speed, one in training",
    "speeds": "another speed, all others in training",
    "bearing": "another bearing, same speed",
    "bearing and speed": "another bearing and speed",
    "load": "another load",
}
#: Most folds of loads.
_MOST_FOLDS = 5


class Split(NamedTuple):
    """Rows of a training and of its test.

    Parameters
    ----------
    train, test : ndarray of int
        Row numbers.
    protocol : str
        A key of `PROTOCOLS`.
    train_rpm : float
        Training speed; NaN if there are several or none is stated.
    """

    train: NDArray[Any]
    test: NDArray[Any]
    protocol: str
    train_rpm: float


def protocol_splits(
    y: ArrayLike,
    facts: pd.DataFrame,
    *,
    halves: bool = False,
    window_length: int | None = None,
    protocols: Sequence[str] = tuple(PROTOCOLS),
) -> tuple[list[Split], list[str]]:
    """Return the splits of an evaluation, and why some protocols have none.

    Parameters
    ----------
    y : array-like of shape (n_rows,)
        Condition of each row.
    facts : DataFrame of n_rows rows
        Facts of each row, as far as they are known: ``rpm``, ``recording``, ``start``
        (index of the first sample in the recording), ``specimen`` (the bearing; each
        condition is one if there is no such column), ``load``, and ``campaign``: a set
        of recordings between which nothing was remounted. If there are several
        campaigns, no campaign of a test across speeds is in its training.
    halves : bool, default=False
        Whether only the first halves of recordings train, and only the second halves
        test. It needs recordings.
    window_length : int or None, default=None
        Samples in a row. It is needed if rows of a recording overlap.
    protocols : sequence of str, default=all
        Keys of `PROTOCOLS`.

    Returns
    -------
    splits : list of Split
        In the order of `PROTOCOLS`.
    sentences : list of str
        What is not measured, and why.

    Raises
    ------
    ValueError
        If a name is no protocol, or `halves` is True without recordings.

    Examples
    --------
    >>> facts = pd.DataFrame({"rpm": [300, 300, 400, 400]})
    >>> splits, sentences = protocol_splits(["a", "b", "a", "b"], facts, protocols=["speed"])
    >>> [(split.train.tolist(), split.test.tolist()) for split in splits]
    [([0, 1], [2, 3]), ([2, 3], [0, 1])]
    """
    for name in protocols:
        expect(name in PROTOCOLS, "protocols", name, f"among {list(PROTOCOLS)}")
    y = column_or_1d(y)
    expect(len(facts) == len(y), "Length of facts", len(facts), f"that of y, {len(y)}")
    may_train = may_test = np.ones(len(y), dtype=bool)
    if halves:
        has_recordings = "recording" in facts
        expect(has_recordings, "Columns of facts", list(facts), "recording, for halves")
        may_train, may_test = first_and_second_half(
            facts["recording"], facts.get("start"), window_length or 1
        )
    makers = {
        "speed": _across_speeds,
        "speeds": _across_speeds,
        "bearing": _across_bearings,
        "bearing and speed": _across_bearings,
        "load": _across_loads,
    }
    splits: list[Split] = []
    sentences: list[str] = []
    for maker in dict.fromkeys(makers[name] for name in PROTOCOLS if name in protocols):
        made, why = maker(y, facts, may_train, may_test)
        splits += [split for split in made if split.protocol in protocols]
        sentences += why
    splits.sort(key=lambda split: list(PROTOCOLS).index(split.protocol))
    return splits, sentences


def _across_speeds(y, facts, may_train, may_test):
    """Train at one speed, or at all but one. A training that lacks a condition is left out."""
    speeds, at = _speeds(facts)
    if len(speeds) < 2:
        return [], ["Another speed: not measured, because one speed is stated at most."]
    parts = [(may_train, may_test)]
    campaign = facts.get("campaign", pd.Series("", facts.index)).astype(str).to_numpy()
    if len(set(campaign)) > 1:
        parts = [
            (may_train & (campaign != name), may_test & (campaign == name))
            for name in np.unique(campaign)
        ]
    splits = []
    for protocol, place, (trains, tests) in product(
        ["speed", "speeds"], range(len(speeds)), parts
    ):
        is_one = protocol == "speed"
        train = np.flatnonzero(((at == place) == is_one) & trains)
        test = np.flatnonzero(((at == place) != is_one) & tests)
        # Of two speeds, one in training and one left out are the same.
        is_new = is_one or len(speeds) > 2
        if is_new and len(test) > 0 and set(y[train]) == set(y):
            train_rpm = speeds[place] if is_one else np.nan
            splits.append(Split(train, test, protocol, train_rpm))
    if splits:
        return splits, []
    return [], [
        "Another speed: not measured, because no training has all conditions if a speed "
        "is left out."
    ]


def _across_bearings(y, facts, may_train, may_test):
    """Leave a bearing of each location out, and train at one speed."""
    rows = np.flatnonzero(may_train | may_test)
    conditions = pd.Series(y, facts.index)
    has_specimens = "specimen" in facts and facts["specimen"].notna().all()
    specimen = facts["specimen"] if has_specimens else conditions
    speeds, at = _speeds(facts)
    groups = pd.DataFrame({"specimen": specimen}).iloc[rows]
    if len(speeds) > 0:
        groups["rpm"] = speeds[at[rows]]
    location = locations_of_labels(y[rows])
    counts = groups["specimen"].groupby(location).nunique()
    if counts.max() < 2:
        reason = "because each location has one specimen"
        return [], [f"Another bearing: not measured, {reason}."]
    try:
        folds = list(SpecimenSplit().split(None, y[rows], groups))
    except ValueError:
        reason = (
            "because without one bearing of each location, no speed has all locations"
        )
        return [], [f"Another bearing: not measured, {reason}."]
    splits = []
    for train, test in ((rows[train], rows[test]) for train, test in folds):
        speed = at[train[0]]
        train_rpm = speeds[speed] if len(speeds) > 0 else np.nan
        train = train[may_train[train]]
        for protocol, tested in [
            ("bearing", test[at[test] == speed]),
            ("bearing and speed", test[at[test] != speed]),
        ]:
            if len(tested) > 0:
                splits.append(Split(train, tested, protocol, train_rpm))
    sentences = []
    if not has_specimens:
        sentences.append("Another bearing: each condition counts as one bearing.")
    tested = {place for split in splits for place in locations_of_labels(y[split.test])}
    if untested := ", ".join(sorted(set(counts.index) - tested)):
        sentences.append(
            f"Another bearing: not measured for {untested}, because too few such "
            "bearings were recorded."
        )
    return splits, sentences


def _across_loads(y, facts, may_train, may_test):
    """Leave loads out. Rows whose load is not stated are in no split."""
    load = facts.get("load", pd.Series(np.nan, facts.index))
    is_stated = (load.notna() & (load.astype(str) != "")).to_numpy()
    rows = np.flatnonzero(is_stated & (may_train | may_test))
    names = load.astype(str).to_numpy()[rows]
    n_loads = len(set(names))
    if n_loads < 2:
        reason = "only one load is stated" if n_loads else "no load is stated"
        return [], [f"Another load: not measured, because {reason}."]
    splits = []
    folds = GroupKFold(min(n_loads, _MOST_FOLDS)).split(rows, groups=names)
    for train, test in ((rows[train], rows[test]) for train, test in folds):
        train = train[may_train[train]]
        test = test[may_test[test]]
        if set(y[train]) == set(y) and len(test) > 0:
            splits.append(Split(train, test, "load", np.nan))
    if not splits:
        reason = "because a condition was recorded at one load only"
        return [], [f"Another load: not measured, {reason}."]
    n_unstated = int((~is_stated).sum())
    if n_unstated == 0:
        return splits, []
    return splits, [f"Another load: {n_unstated} rows without a load were left out."]


def _speeds(facts):
    """Return the different speeds, and the index of that of each row; none if unknown."""
    if "rpm" not in facts or facts["rpm"].isna().any():
        return np.empty(0), np.zeros(len(facts), dtype=int)
    speeds, at = group_speeds(log_speeds(facts["rpm"], len(facts)))
    return np.exp(speeds).round(3), at
