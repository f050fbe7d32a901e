import numpy as np

from benchmarks.fault_orders.runs import BEARING, name_row, names_over_time
from skarxlag.bearings import bearing_orders

RATE = 12_800.0
RPM = 1500.0


def snapshots(n, amplitude, seed):
    """Snapshots of 2.5 revolutions: noise, and impacts of the inner race that scatter by 1 %."""
    rng = np.random.default_rng(seed)
    X = rng.normal(size=(n, 1280))
    interval = 60 * RATE / (RPM * bearing_orders(BEARING)["inner"])
    for row in X:
        at = np.cumsum(
            interval * np.append(rng.uniform(), rng.normal(1, 0.01, size=30))
        )
        row[at[at < 1280].astype(int)] += amplitude
    return X


def test_a_growing_fault_is_named_and_the_name_stays():
    X = np.concatenate([snapshots(80, 0, 0), snapshots(40, 2.8, 1)])
    seconds = 10.0 * np.arange(len(X))
    verdicts = names_over_time(X, seconds, RPM, RATE)
    row = name_row(verdicts, 1200.1)
    assert row["name that stays"] == "inner"
    assert 800 < float(row["from, s"]) < 1100
    assert row["named before, gathered"] == "0.00"
    # Few of the same snapshots are named one by one.
    assert float(row["the same one by one"]) < 0.5
    assert row["before the end, s"] == f"{1200.1 - float(row['from, s']):.0f}"
