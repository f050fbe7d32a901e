"""Tables of the fault locations that scores name: right, wrong and abstained."""

import numpy as np
import pandas as pd
from scipy.stats import rankdata
from sklearn.utils import Bunch

from skarxlag import FaultOrderClassifier
from skarxlag.core.fault_locations import FAULTS as FAULT_LOCATIONS
from skarxlag.core.fault_locations import NOT_IDENTIFIABLE

_RACES = ("inner", "outer")


def verdicts(scores, **options):
    """Return locations and verdicts that the classifier derives from scores.

    Parameters
    ----------
    scores : ndarray of shape (n, 3)
    **options
        Of `FaultOrderClassifier`.

    Returns
    -------
    list of str
    """
    fitted = FaultOrderClassifier(bearing="6205", sampling_rate=1e3, **options).fit(
        np.ones((1, 9))
    )
    return fitted._judge(_matched(scores, np.ones(len(scores)))).named


def area_under_curve(faulty, healthy):
    """Return the probability that a faulty recording has the larger score.

    Examples
    --------
    >>> area_under_curve([3, 2], [1, 2])
    0.875
    """
    ranks = rankdata([*faulty, *healthy])[: len(faulty)]
    n_faulty = len(faulty)
    return float(
        (ranks.sum() - n_faulty * (n_faulty + 1) / 2) / (n_faulty * len(healthy))
    )


def counted(rows):
    """Count right, wrong and abstained by rig and location, and right without abstaining."""
    scores = rows[list(FAULT_LOCATIONS)].to_numpy()
    rows = rows.assign(
        forced=[FAULT_LOCATIONS[i] for i in scores.argmax(axis=1)],
        verdict=verdicts(scores),
    )
    lines = []
    for (rig, location), group in rows.groupby(["rig", "location"], sort=False):
        named = group[~group["verdict"].isin(["healthy", NOT_IDENTIFIABLE])]
        line = {"rig": rig, "location": location, "recordings": len(group)}
        if location == "healthy":
            right = (group["verdict"] == "healthy").sum()
            wrong = len(named)
        else:
            right = (named["verdict"] == location).sum()
            wrong = len(named) - right
        line |= {
            "right": right,
            "wrong": wrong,
            "abstained": len(group) - right - wrong,
        }
        forced = (
            ""
            if location == "healthy"
            else f"{(group['forced'] == location).mean():.2f}"
        )
        lines.append(line | {"right without abstaining": forced})
    return pd.DataFrame(lines)


def mean_accuracy(rows, locations=FAULT_LOCATIONS):
    """Return the share of right locations on each rig, without abstaining."""
    faulty = rows[rows["location"].isin(locations)]
    best = faulty[list(FAULT_LOCATIONS)].to_numpy().argmax(axis=1)
    right = pd.Series(
        np.array(FAULT_LOCATIONS)[best] == faulty["location"], index=faulty.index
    )
    return right.groupby(faulty["rig"], sort=False).mean()


def compared(rows):
    """Each method: right on the mean of rigs, races, and races above all healthy recordings."""
    lines = []
    for method, group in rows.groupby("method", sort=False):
        by_rig = mean_accuracy(group)
        best = group[list(FAULT_LOCATIONS)].max(axis=1)
        healthy = best[group["location"] == "healthy"].max()
        races = group[group["location"].isin(_RACES)]
        named = (
            np.array(FAULT_LOCATIONS)[
                races[list(FAULT_LOCATIONS)].to_numpy().argmax(axis=1)
            ]
            == races["location"]
        )
        above = (best[races.index] > healthy) & named
        lines.append(
            {
                "method": method,
                "mean of rigs": by_rig.mean(),
                "races": mean_accuracy(group, _RACES).mean(),
                "races right and above every healthy recording": above.mean(),
                **by_rig,
                "ms for 1 s": group["ms"].median(),
            }
        )
    return pd.DataFrame(lines).sort_values("mean of rigs", ascending=False)


def with_reference(rows, rate=0.02):
    """False alarms of healthy stretches with healthy rows of the machine as the reference.

    The first half of each healthy recording calibrates, the second half is tested; or
    recordings of all speeds but one calibrate, and the last speed is tested.
    """
    lines = []
    for rig, group in rows[rows["location"] == "healthy"].groupby("rig", sort=False):
        half = group.groupby("recording")["second"].transform("max") / 2
        early = group[group["second"] < half]
        late = group[group["second"] >= half]
        alarms = [
            _alarms(group[group["rpm"] != rpm], group[group["rpm"] == rpm], rate)
            for rpm in group["rpm"].unique()
        ]
        races = rows[(rows["rig"] == rig) & rows["location"].isin(_RACES)]
        lines.append(
            {
                "rig": rig,
                "healthy stretches": len(group),
                "alarms, same speeds": _alarms(early, late, rate),
                "alarms, speed left out": np.mean(alarms),
                "alarms without reference": _alarms(None, group, rate),
                "races detected": _alarms(early, races, rate),
                "area under the curve": area_under_curve(
                    races[list(FAULT_LOCATIONS)].max(axis=1),
                    group[list(FAULT_LOCATIONS)].max(axis=1),
                ),
            }
        )
    return pd.DataFrame(lines)


def _alarms(reference, tested, rate):
    fitted = FaultOrderClassifier(
        bearing="6205", sampling_rate=1e3, false_alarm_rate=rate
    )
    fitted.fit(np.ones((1, 9)))
    if reference is not None:
        fitted._set_healthy(
            reference[list(FAULT_LOCATIONS)].to_numpy(), reference["rpm"].to_numpy()
        )
    matched = _matched(
        tested[list(FAULT_LOCATIONS)].to_numpy(), tested["rpm"].to_numpy()
    )
    return fitted._judge(matched).alarm.mean()


def _matched(scores, rpm):
    """Return matches as `FaultOrderClassifier.match` returns them, from stored scores."""
    nothing = np.zeros(scores.shape, dtype=int)
    return Bunch(
        scores=scores,
        rpm=rpm,
        factors=nothing + 1.0,
        bearings=nothing,
        speed_errors=np.ones(len(scores)),
        other_orders=np.ones(len(scores)),
        other_scores=np.zeros(len(scores)),
    )
