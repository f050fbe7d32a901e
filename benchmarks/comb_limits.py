"""Limits of combs that are chosen on all rigs but one, and parts of the combs without.

The limit of a row of n revolutions is L + g ln(n / 100). All rigs but one choose L and g,
and the other one is named with them. So is each variant, of which a part is left out or
changed. Whole recordings, and the first, the middle and the last row of a second.
"""

from contextlib import ExitStack
from unittest.mock import patch

import numpy as np
import pandas as pd

from benchmarks.blocks import markdown
from benchmarks.rigs import BEARING_RIGS, read_rigs
from skarxlag import make_fault_order_classifier
from skarxlag.core.fault_locations import FAULTS
from skarxlag.decisions import comb_search
from skarxlag.kernels import fault_orders

AS_LANDED = "as in the package"
_STATED_HIGH = 1.015
#: Parameters, constants, and the stated over the nominal speed of the variants.
VARIANTS = {
    AS_LANDED: ({}, {}, 1),
    "speed stated 1.5 % too high": ({}, {}, _STATED_HIGH),
    "slip .01": ({"slip": 0.01}, {}, 1),
    "slip .01, speed stated 1.5 % too high": ({"slip": 0.01}, {}, _STATED_HIGH),
    "slip .03": ({"slip": 0.03}, {}, 1),
    "true speed not searched": ({"speed_tolerance": 0.0}, {}, 1),
    "one band": ({}, {(fault_orders, "_N_BANDS"): 1}, 1),
    "eight bands": ({}, {(fault_orders, "_N_BANDS"): 8}, 1),
    "impacts at fractions of an order count": (
        {},
        {(fault_orders, "_DIVISORS"): (), (fault_orders, "_AS_HIGH"): -np.inf},
        1,
    ),
    "lines of the mains count": ({}, {(comb_search, "MAINS"): ()}, 1),
}
LENGTHS = ("whole", "1 s")
_GROWTHS = (0.0, 0.25, 0.5, 0.75)
_LIMITS = np.round(np.arange(1.5, 3.55, 0.1), 1)
#: The second location is closer than this: no name.
_LEAD = np.log(9) / 8
#: Missed faults that weigh as much as a wrong name or a healthy row with a name.
_WRONG = 5
_COUNTED = ("races", "named right", "faults", "other name", "healthy", "named faulty")


def lines(home=None, rigs=BEARING_RIGS, methods=tuple(VARIANTS), every=1):
    """Yield the scores of the three locations in each row, for each variant.

    Parameters
    ----------
    home : path or None
        Folder of the rigs.
    rigs, methods : sequence of str
        Those that are computed.
    every : int
        Of so many recordings one is taken.
    """
    for rig in read_rigs(rigs, home):
        second = int(rig.sampling_rate)
        for number, recording in list(enumerate(rig.recordings))[::every]:
            samples = recording.samples[np.newaxis, np.newaxis]
            options = {"bearing": rig.bearing, "sampling_rate": rig.sampling_rate}
            pipeline = make_fault_order_classifier(**options).fit(samples)
            last = samples.shape[-1] // second - 1
            starts = second * np.unique([0, (last + 1) // 2, last])
            rows = [("whole", pipeline[0].transform(samples))]
            for start in starts:
                row = samples[..., start : start + second]
                rows.append(("1 s", pipeline[0].transform(row)))
            for method in methods:
                facts = {"method": method, "rig": rig.name, "recording": number}
                facts |= {"location": recording.location}
                for row, (length, innovations) in enumerate(rows):
                    found = _match(pipeline[1], innovations, recording.rpm, method)
                    scores = dict(zip(FAULTS, found.scores[0].round(3), strict=True))
                    line = facts | {"length": length, "row": row} | scores
                    yield line | {"revolutions": round(found.n_revolutions[0], 2)}


def _match(classifier, innovations, rpm, method):
    options, constants, factor = VARIANTS[method]
    stated = {name: getattr(classifier, name) for name in options}
    with ExitStack() as stack:
        for (module, name), value in constants.items():
            stack.enter_context(patch.object(module, name, value))
        found = classifier.set_params(**options).match(innovations, rpm=factor * rpm)
    classifier.set_params(**stated)
    return found


def count(lines, limits, growths):
    """Count the names that each pair of limit and growth gives.

    Examples
    --------
    >>> lines = pd.DataFrame({"location": ["inner", "healthy"], "ball": 0.0, "inner": 2.0,
    ...                       "outer": [0.0, 1.9], "revolutions": 100.0})
    >>> print(count(lines, limits=[1.5, 2.5], growths=[0.5, 0.5]).to_string(index=False))
     races  named right  faults  other name  healthy  named faulty
         1            1       1           0        1             0
         1            0       1           0        1             0
    """
    scores = lines[list(FAULTS)].to_numpy()
    second, best = np.sort(scores, axis=1)[:, 1:].T
    turns = np.log(lines["revolutions"].to_numpy() / 100)
    allowed = np.array(limits)[:, np.newaxis] + np.outer(growths, turns)
    location = lines["location"].to_numpy()
    is_race, is_healthy = np.isin(location, ["inner", "outer"]), location == "healthy"
    is_right = np.array(FAULTS)[scores.argmax(axis=1)] == location
    is_named = (best > allowed) & (best - second >= _LEAD)
    counts = (
        is_race,
        is_race & is_right & is_named,
        ~is_healthy,
        ~is_healthy & ~is_right & is_named,
        is_healthy,
        is_healthy & is_named,
    )
    return pd.DataFrame(
        {
            name: np.broadcast_to(of_rows, allowed.shape).sum(axis=1)
            for name, of_rows in zip(_COUNTED, counts, strict=True)
        }
    )


def _utility(counts):
    wrong = counts["other name"] / counts["faults"]
    wrong += counts["named faulty"] / np.maximum(counts["healthy"], 1)
    return counts["named right"] / counts["races"] - _WRONG * wrong


def left_out(lines):
    """Name each rig with the limit that the others choose.

    Returns
    -------
    DataFrame
        A line for each rig and length: "limit" and "growth", and the counts.
    """
    growths = np.repeat(_GROWTHS, len(_LIMITS))
    limits = np.tile(_LIMITS, len(_GROWTHS))
    rigs = list(dict.fromkeys(lines["rig"]))
    counts = {
        key: count(group, limits, growths)
        for key, group in lines.groupby(["rig", "length"], sort=False)
    }
    utility = {
        rig: sum(_utility(counts[rig, length]) for length in LENGTHS) for rig in rigs
    }
    found = []
    for rig in rigs:
        best = int(np.argmax(sum(utility[other] for other in rigs if other != rig)))
        setting = {"limit": limits[best], "growth": growths[best]}
        for length in LENGTHS:
            facts = {"rig": rig, "length": length} | setting
            found.append(facts | counts[rig, length].loc[best].to_dict())
    return pd.DataFrame(found)


def choices(lines):
    """Tabulate what the other rigs choose, and what it names on the left-out one."""
    table = left_out(lines[lines["method"] == AS_LANDED])
    table = table.rename(columns={"limit": "L (nepers)", "growth": "g"})
    n_settings = len(_GROWTHS) * len(_LIMITS)
    return (
        f"Of {n_settings} pairs of L and g, the pair that all other rigs choose, and the names "
        "that it gives on the rig that had no part in the choice. A wrong name or a healthy "
        f"row with a name costs as much as {_WRONG} races without a name. Nothing is "
        f"trained.\n\n{markdown(table)}"
    )


def variants(lines):
    """Tabulate the sums over left-out rigs of each variant."""
    rows = []
    groups = dict(list(lines.groupby("method")))
    for method in VARIANTS:
        table = left_out(groups[method])
        line = {"variant": method}
        for length in LENGTHS:
            total = table.loc[table["length"] == length, list(_COUNTED)].sum()
            line[f"races, {length}"] = f"{total['named right']} of {total['races']}"
            line[f"other name, {length}"] = total["other name"]
            line[f"healthy named, {length}"] = total["named faulty"]
        rows.append(line)
    return (
        "Sums over the rigs, each with the limit that the other rigs choose for the variant."
        f"\n\n{markdown(pd.DataFrame(rows))}"
    )
