import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter

from benchmarks.recipe.constants import NAMES, score_rig
from benchmarks.recipe.rigs import Recording, Rig


@pytest.fixture(scope="module")
def scores():
    rng = np.random.default_rng(0)
    recordings = [
        Recording(lfilter([1], [1, pole], rng.normal(size=24_000)), condition, speed)
        for speed in (600.0, 900.0)
        for condition, pole in {"dull": -0.8, "even": 0.0, "sharp": 0.8}.items()
    ]
    grid = ((4,), (64,), (0.1, 0.4))
    kinds = ["windows of 1200", "windows of 4800"]
    rig = Rig("coloured noise", 12_000.0, recordings)
    return [
        pd.DataFrame(rows)
        for rows in score_rig(rig, kinds, grid, report=lambda _: None)
    ]


def test_every_setting_is_scored_in_every_cell(scores):
    accuracies, calibrations = scores
    # Two smooth drifts, five weights of orders, two kinds of rows and two protocols.
    assert len(accuracies) == 2 * 5 * 2 * 2
    assert not accuracies.duplicated([*NAMES, "rows", "trained at"]).any()
    assert accuracies["right"].min() == 1
    assert set(calibrations["exponent"]) >= {8, 32, 64}
