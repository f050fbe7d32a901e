"""Settings of the score and of its probabilities, chosen by leaving rigs out."""

from itertools import product

import numpy as np
import pandas as pd

from skarxlag import FaultOrderClassifier
from skarxlag.core.fault_locations import FAULTS as FAULT_LOCATIONS
from skarxlag.core.fault_locations import HEALTHY
from skarxlag.decisions.comb_probabilities import VISIBLE_ALONE, comb_evidence
from skarxlag.kernels.fault_orders import (
    contrast_parts,
    fault_comb,
)

#: Settings that are scored: weights of the three contrasts, weight of the cage, and
#: slip.
SETTINGS = list(
    product(
        [
            (1, 0, 0),
            (0, 1, 0),
            (1, 1, 0),
            (1, 1, 0.4),
            (1, 1, 1),
            (1, 0, 0.4),
            (0, 1, 0.4),
        ],
        [0.3, 0.6, 0.9],
        [0.02, 0.03, 0.05],
    )
)
#: Shares of faults that show their comb, which are scored.
VISIBLE = (0.1, 0.2, 0.4, 0.5, 0.6, 0.8, 0.9)


def settings_left_out(rigs):
    """Return the accuracy on each rig with the settings that are best on all others.

    Parameters
    ----------
    rigs : dict of str to list of Recording

    Returns
    -------
    DataFrame
        ``rig``, ``chosen`` settings, ``accuracy`` with them, and ``ours``, that of the
        defaults.
    """
    accuracy = {}
    for name, rig in rigs.items():
        faulty = [
            recording for recording in rig if recording.location in FAULT_LOCATIONS
        ]
        right = np.zeros((len(SETTINGS), len(faulty)))
        for column, recording in enumerate(faulty):
            samples_per_revolution = 60 * recording.rate / recording.rpm
            parts = contrast_parts(
                recording.samples, samples_per_revolution, recording.rate
            )
            for row, (weights, cage, slip) in enumerate(SETTINGS):
                contrast = np.array(weights) / sum(weights) @ parts
                scores = fault_comb(contrast, recording.orders, 0.1, slip, cage).scores
                right[row, column] = (
                    FAULT_LOCATIONS[scores.argmax()] == recording.location
                )
        accuracy[name] = right.mean(axis=1)
    frame = pd.DataFrame(accuracy)
    default = SETTINGS.index(((1, 1, 0.4), 0.6, 0.03))
    rows = []
    for name in frame:
        best = int(frame.drop(columns=name).mean(axis=1).argmax())
        weights, cage, slip = SETTINGS[best]
        rows.append(
            {
                "rig left out": name,
                "weights": " : ".join(f"{w:g}" for w in weights),
                "cage": cage,
                "slip": slip,
                "right": frame.loc[best, name],
                "right with the defaults": frame.loc[default, name],
            }
        )
    return pd.DataFrame(rows)


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
