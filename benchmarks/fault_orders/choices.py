"""Slip and probabilities of combs, chosen by leaving rigs out."""

import numpy as np
import pandas as pd

from skarxlag import FaultOrderClassifier
from skarxlag.core.fault_locations import FAULTS as FAULT_LOCATIONS
from skarxlag.core.fault_locations import HEALTHY
from skarxlag.decisions.comb_probabilities import VISIBLE_ALONE, comb_evidence

#: Largest slips that are scored.
SLIPS = (0.01, 0.015, 0.02, 0.03, 0.05)
#: Shares of faults that show their comb, which are scored.
VISIBLE = (0.1, 0.2, 0.4, 0.5, 0.6, 0.8, 0.9)


def slips_left_out(rigs):
    """Return the accuracy on each rig with the slip that is best on all others.

    Parameters
    ----------
    rigs : dict of str to list of Recording

    Returns
    -------
    DataFrame
        ``rig left out``, the chosen ``slip``, the share ``right`` with it, and ``right
        with the default``.
    """
    default = FaultOrderClassifier().slip
    accuracy = {}
    for name, rig in rigs.items():
        faulty = [
            recording for recording in rig if recording.location in FAULT_LOCATIONS
        ]
        for slip in SLIPS:
            right = 0
            for recording in faulty:
                samples = recording.samples[np.newaxis]
                classifier = FaultOrderClassifier(
                    bearing=recording.bearing, sampling_rate=recording.rate, slip=slip
                ).fit(samples)
                scores = classifier.match(samples, rpm=recording.rpm).scores[0]
                right += FAULT_LOCATIONS[scores.argmax()] == recording.location
            accuracy[name, slip] = right / len(faulty)
    table = pd.Series(accuracy).unstack(0)
    best = {rig: table.drop(columns=rig).mean(axis=1).idxmax() for rig in table}
    lines = [
        (rig, slip, table.loc[slip, rig], table.loc[default, rig])
        for rig, slip in best.items()
    ]
    columns = ["rig left out", "slip", "right", "right with the default"]
    return pd.DataFrame(lines, columns=columns)


def visible_left_out(recorded, seconds):
    """Return log losses with the share of visible combs that is best on all other rigs.

    Parameters
    ----------
    recorded, seconds : DataFrame
        ``rig``, ``location`` and a score for each location, of recordings and of stretches.

    Returns
    -------
    DataFrame
        ``rig left out``, the share ``visible``, and the ``loss`` with it and ``loss in
        use``.
    """
    limit = (
        FaultOrderClassifier(bearing="6205", sampling_rate=1e3)
        .fit(np.ones((1, 9)))
        .limit_
    )
    losses = {}
    for rig in recorded["rig"].unique():
        parts = [rows[rows["rig"] == rig] for rows in (recorded, seconds)]
        for visible in VISIBLE:
            of_parts = []
            for rows in parts:
                beyond = rows[list(FAULT_LOCATIONS)].to_numpy() - limit
                evidence = comb_evidence(beyond, np.arange(4), visible=visible)
                true = rows["location"].map([*FAULT_LOCATIONS, HEALTHY].index)
                of_parts.append(-evidence[np.arange(len(rows)), true].mean())
            losses[rig, visible] = np.mean(of_parts)
    table = pd.Series(losses).unstack(0)
    best = {rig: table.drop(columns=rig).mean(axis=1).idxmin() for rig in table}
    lines = [
        (rig, v, table.loc[v, rig], table.loc[VISIBLE_ALONE, rig])
        for rig, v in best.items()
    ]
    return pd.DataFrame(
        lines, columns=["rig left out", "visible", "loss", "loss in use"]
    )
