"""Summary of `evaluate`: shares of right verdicts by test, and sentences that read them."""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...kernels.speed_references import SAME_LOG_SPEED
from ...model_selection import locations_of_labels

#: Probability from which a verdict counts as stated with confidence.
STATED = 0.9
#: Number of such verdicts below which no share of them is given.
_LEAST_STATED = 30
#: Name of each protocol in the summary, in its order. A bearing is tested at two kinds
#: of speeds.
_TESTS = {
    "speeds": "another speed",
    "in": "another speed",
    "out": "another speed",
    "bearing": "another bearing",
    "bearing, other speed": "another bearing and speed",
    "load": "another load",
}


def location_columns(
    true: NDArray[Any], conditions: NDArray[Any], probability: NDArray[Any]
) -> dict[str, NDArray[Any]]:
    """Return columns of verdicts on locations.

    Parameters
    ----------
    true : ndarray of shape (n_rows,)
        Conditions.
    conditions : ndarray of shape (n_conditions,)
        Conditions of the training.
    probability : ndarray of shape (n_rows, n_conditions)
        Their probabilities.

    Returns
    -------
    dict of str to ndarray of shape (n_rows,)
        ``is_known``, whether the condition is among those of the training;
        ``is_location``, whether the most probable location is the right one;
        ``location_probability``, its probability.

    Examples
    --------
    >>> found = location_columns(
    ...     np.array(["IR7"]), np.array(["IR2", "IR5", "N"]), np.array([[0.3, 0.3, 0.4]])
    ... )
    >>> {name: column.tolist() for name, column in found.items()}
    {'is_known': [False], 'is_location': [True], 'location_probability': [0.6]}
    """
    of_locations = (
        pd.DataFrame(probability.T).groupby(locations_of_labels(conditions)).sum()
    )
    return {
        "is_known": np.isin(true, conditions),
        "is_location": of_locations.idxmax().to_numpy() == locations_of_labels(true),
        "location_probability": of_locations.max().to_numpy(),
    }


def summary(verdicts: pd.DataFrame) -> pd.DataFrame:
    """Summarize the verdicts of all protocols.

    Parameters
    ----------
    verdicts : DataFrame
        A row for each row of each test, with ``protocol``, ``diagnoser``,
        ``train_rpm``, ``test_rpm``, ``specimen``, ``true``, ``predicted`` and the
        columns of `location_columns`.

    Returns
    -------
    DataFrame
        By test and diagnoser, ``bearings``, the number of specimens that were tested,
        and percentages of rows. ``condition``: the condition is right; NaN if the
        training did not have it. ``location``: the location is right. ``stated``: the location
        is stated with a probability of at least `STATED`. ``of these``: the stated
        location is right; NaN if fewer than 30 rows are stated.
    """
    if (verdicts["protocol"] == "in").any():
        verdicts = verdicts[verdicts["protocol"] != "out"]
    is_same = (
        np.abs(np.log(verdicts["test_rpm"] / verdicts["train_rpm"])) <= SAME_LOG_SPEED
    )
    is_bearing = verdicts["protocol"] == "bearing"
    protocol = verdicts["protocol"].mask(is_bearing & ~is_same, "bearing, other speed")
    is_right = (verdicts["true"] == verdicts["predicted"]).astype(float)
    is_stated = verdicts["location_probability"] >= STATED
    shares = pd.DataFrame(
        {
            "condition": is_right.where(verdicts["is_known"]),
            "location": verdicts["is_location"],
            "stated": is_stated,
            "of these": verdicts["is_location"].astype(float).where(is_stated),
        }
    )
    # Tests of the same bearing at the training speed are not summarized.
    keys = [protocol.map(_TESTS).rename("test"), verdicts["diagnoser"]]
    is_shown = is_bearing | ~is_same
    groups = shares[is_shown].groupby(keys, sort=False)
    table = 100 * groups.mean()
    bearings = verdicts["specimen"][is_shown].groupby(keys, sort=False).nunique()
    table.insert(0, "bearings", bearings)
    table["of these"] = table["of these"].where(
        groups["of these"].count() >= _LEAST_STATED
    )
    order = [*dict.fromkeys(_TESTS.values())]
    return table.reindex([test for test in order if test in table.index], level="test")


def with_marks(table: pd.DataFrame) -> str:
    """Return a summary as text, in which the best shares of each test are marked.

    Parameters
    ----------
    table : DataFrame
        As `summary` returns it, also with further levels before those.

    Returns
    -------
    str
        The table. Equal shares are all marked.

    Examples
    --------
    >>> tests = pd.MultiIndex.from_product([["another speed"], ["A", "B"]])
    >>> table = pd.DataFrame({"bearings": [8, 8], "location": [97.14, 61.0]}, tests)
    >>> print(with_marks(table))
                     bearings  location
    another speed A         8  97.1*
                  B         8    61
    """
    rounded = table.round(1)
    texts = rounded.map("{:g}".format).where(table.notna(), "-")
    tests = list(range(table.index.nlevels - 1))
    for name in rounded.columns.intersection(["condition", "location", "of these"]):
        best = rounded[name].groupby(level=tests).transform("max")
        texts[name] += np.where(rounded[name] == best, "*", " ")
    return texts.rename_axis(table.index.nlevels * [None]).to_string()


def reading(table: pd.DataFrame, diagnoser: str) -> str:
    """Return a sentence that reads the summary of one diagnoser.

    Parameters
    ----------
    table : DataFrame
        As `summary` returns it.
    diagnoser : str
        Name of the diagnoser.

    Returns
    -------
    str
        The sentence.

    Examples
    --------
    >>> tests = pd.MultiIndex.from_product([["another speed", "another bearing"], ["D"]])
    >>> table = pd.DataFrame({"location": [98.2, 61.0], "of these": [99.9, np.nan]}, tests)
    >>> print(reading(table, "D"))  # doctest: +NORMALIZE_WHITESPACE
    D names the right location in 98 % (another speed), 61 % (another bearing) of the windows;
    of the locations that it states with a probability of 0.9 or more, 100 % (another
    speed) are right.
    """
    shares = table.xs(diagnoser, level=1)
    right = _shares(shares["location"].dropna())
    of_stated = _shares(shares["of these"].dropna())
    sentence = f"{diagnoser} names the right location in {right} of the windows"
    if not of_stated:
        return f"{sentence}."
    stated = f"of the locations that it states with a probability of {STATED:g} or more"
    return f"{sentence}; {stated}, {of_stated} are right."


def better_ones(table: pd.DataFrame, diagnoser: str) -> list[str]:
    """Return sentences on diagnosers that name more conditions right than one of them.

    Parameters
    ----------
    table : DataFrame
        As `summary` returns it.
    diagnoser : str
        Name of the one that is recommended.

    Returns
    -------
    list of str
        A sentence for each test in which another diagnoser is better by a percent or
        more.

    Examples
    --------
    >>> tests = pd.MultiIndex.from_product([["another speed"], ["ALPIO", "D"]])
    >>> better_ones(pd.DataFrame({"condition": [97.1, 95.0]}, tests), "D")
    ['Another speed: ALPIO names the right condition in 97 % of the windows, D in 95 %.']
    """
    sentences = []
    for test, shares in table["condition"].groupby(level=0, sort=False):
        of_diagnosers = shares.droplevel(0).dropna()
        if diagnoser not in of_diagnosers:
            continue
        share = of_diagnosers[diagnoser]
        best = of_diagnosers.idxmax()
        if of_diagnosers[best] >= share + 1:
            sentences.append(
                f"{test.capitalize()}: {best} names the right condition in "
                f"{of_diagnosers[best]:.0f} % of the windows, {diagnoser} in {share:.0f} %."
            )
    return sentences


def _shares(shares):
    return ", ".join(f"{share:.0f} % ({test})" for test, share in shares.items())
