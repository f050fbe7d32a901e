"""Sensitivity to the gains of the observers, and to the evaluation of their error."""

import numpy as np
import pandas as pd

from benchmarks.paper.sensitivity.protocol import (
    CRACKS,
    HEALTHY,
    TRAIN_RPM,
    is_refused,
    percentage,
    rows_of,
    standard_rig,
)
from skarxlag import ARXLaguerre, ExtendedStatePIObserver, PIObserver, ThresholdLadder
from skarxlag.models.residual_evaluations import RESIDUAL_EVALUATIONS

KP = (-0.3, 0.0, 0.1, 0.3, 0.6, 1.2)
KI = (0.0, 0.01, 0.05, 0.2, 0.6, 1.2)
KI_A = (0.005, 0.025, 0.1, 0.2)
SATURATION = (0.0, 1.0, 4.0, 16.0)
GAIN = (0.5, 2.0, 8.0)
EVALUATIONS = tuple(RESIDUAL_EVALUATIONS)


def _settings():
    """Yield the grid name, the varied parameters and the observer of every cell of every grid."""
    for kp in KP:
        for ki in KI:
            yield "linear", {"kp": kp, "ki": ki}, PIObserver(kp=kp, ki=ki)
    for saturation in SATURATION:
        for ki_a in KI_A:
            yield (
                "extended state, gain 2",
                {"saturation": saturation, "ki_a": ki_a},
                ExtendedStatePIObserver(ki_a=ki_a, saturation=saturation),
            )
        for gain in GAIN:
            yield (
                "extended state, ki_a 0.025",
                {"saturation": saturation, "gain": gain},
                ExtendedStatePIObserver(gain=gain, saturation=saturation),
            )
    for evaluation in EVALUATIONS:
        for name, make in (
            ("linear", PIObserver),
            ("extended state", ExtendedStatePIObserver),
        ):
            yield (
                "evaluation",
                {"observer": name, "evaluation": evaluation},
                make(evaluation=evaluation),
            )
        yield (
            "evaluation",
            {"observer": "none", "evaluation": evaluation},
            PIObserver(kp=0.0, ki=0.0, evaluation=evaluation),
        )


def gains(seeds, n_samples):
    """Accuracy of every grid of gains; the identification is shared.

    One row for each cell, crack size and draw, with the columns that the cell's grid
    varies.
    """
    chosen = [(*setting, is_refused(setting[-1])) for setting in _settings()]
    rows = []
    for seed in seeds:
        rig = standard_rig(seed, n_samples)
        for crack_mm in CRACKS:
            kept = rows_of(rig, crack_mm)
            target = rig.target[kept]
            train = rig.rpm[kept] == TRAIN_RPM
            identify = ARXLaguerre().fit(rig.data[kept][train], target[train])
            innovations = identify.transform(rig.data[kept])
            for grid, varied, observer, refused in chosen:
                score = np.nan
                if not refused:
                    levels = observer.fit(innovations).transform(innovations)
                    ladder = ThresholdLadder(healthy=HEALTHY).fit(
                        levels[train], target[train]
                    )
                    score = percentage(ladder.predict(levels[~train]) == target[~train])
                rows.append(
                    {
                        "grid": grid,
                        **varied,
                        "seed": seed,
                        "crack_mm": crack_mm,
                        "accuracy": score,
                    }
                )
    return pd.DataFrame(rows)
