import numpy as np
import pandas as pd

from benchmarks.detection import constants
from benchmarks.recipe.rigs import Recording, Rig


def test_wider_limits_flag_fewer_healthy_rows_and_miss_more_faults():
    rng = np.random.default_rng(0)
    recordings = []
    for speed in (600.0, 900.0, 1200.0):
        healthy, faulty = rng.normal(size=(2, 200_000))
        faulty[::500] += 4
        recordings += [Recording(healthy, "N", speed), Recording(faulty, "I", speed)]
    rows = constants.score_rig(Rig("r", 20_000.0, recordings), "windows of 4800")
    counts = pd.DataFrame(rows)
    assert set(counts["trained at"]) == set(constants.IN_USE)
    sums = counts.groupby("factor")[["flagged at 0.05", "missed"]].sum()
    assert sums["flagged at 0.05"].is_monotonic_decreasing
    assert sums["missed"].is_monotonic_increasing and sums["missed"].iloc[-1] > 0
    assert constants.report(counts).startswith("9 factors")
