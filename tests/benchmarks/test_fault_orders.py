import numpy as np
import pandas as pd
import pytest

from benchmarks.fault_orders.choices import slips_left_out
from benchmarks.fault_orders.command import stretches, whole
from benchmarks.fault_orders.rigs import Recording
from benchmarks.fault_orders.tables import compared, counted, with_reference
from skarxlag.bearings import SKF_6205, bearing_orders

RATE = 10_000


def recording(location, seed, seconds=3):
    rng = np.random.default_rng(seed)
    signal = rng.normal(size=seconds * RATE)
    if location != "healthy":
        interval = RATE / (15 * bearing_orders(SKF_6205)[location])
        strikes = np.cumsum(
            interval * rng.normal(1, 0.01, size=int(len(signal) / interval))
        )
        signal[strikes[strikes < len(signal)].astype(int)] += 10
    return Recording(
        "rig", f"{location}{seed}", location, 900.0, float(RATE), SKF_6205, signal
    )


@pytest.fixture(scope="module")
def rig():
    locations = ("healthy", "inner", "outer")
    return [recording(location, seed) for seed, location in enumerate(locations)]


def test_tables_of_a_rig(rig):
    methods = ["FaultOrderClassifier", "largest peaks at the orders"]
    frames = [whole("rig", rig, method) for method in methods]
    rows = pd.concat(frames, ignore_index=True)
    table = counted(rows[rows["method"] == methods[0]])
    assert table["right"].tolist() == [1, 1, 1] and not table["wrong"].any()
    by_method = compared(rows).set_index("method")
    assert by_method.loc[methods[0], "mean of rigs"] == 1
    assert by_method["races right and above every healthy recording"].max() == 1
    seconds = stretches("rig", rig)
    assert len(seconds) == 9
    reference = with_reference(seconds)
    assert reference["races detected"].tolist() == [1]
    assert reference["area under the curve"].tolist() == [1]


def test_wrong_names_and_abstaining_are_counted():
    rows = pd.DataFrame(
        {
            "rig": "a",
            "location": ["inner", "inner", "outer", "healthy"],
            "ball": 0.0,
            "inner": [3.0, 1.0, 4.0, 3.0],
            "outer": [1.0, 0.5, 1.0, 2.95],
        }
    )
    table = counted(rows).set_index("location")
    assert table.loc["inner", ["right", "wrong", "abstained"]].tolist() == [1, 0, 1]
    assert table.loc["outer", ["right", "wrong", "abstained"]].tolist() == [0, 1, 0]
    assert table.loc["healthy", ["right", "wrong", "abstained"]].tolist() == [0, 0, 1]
    assert table["right without abstaining"].tolist() == ["1.00", "0.00", ""]


def test_the_slip_is_chosen_without_the_rig(rig):
    table = slips_left_out({"one": rig, "other": rig})
    assert table["right"].tolist() == [1, 1]
