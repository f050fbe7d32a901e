import numpy as np
import pandas as pd
import pytest
from sklearn.utils import Bunch

from benchmarks.stretches import command
from benchmarks.stretches.methods import (
    LargestPeak,
    OrdersAlone,
    PyBearing,
    Stretches,
    WindowsVote,
)
from benchmarks.stretches.rigs import locations
from skarxlag import bearing_orders, make_alpio
from skarxlag.bearings import SKF_6205

from ...impacts import RATE, strikes

ORDERS = bearing_orders(SKF_6205)


@pytest.fixture(scope="module")
def rig():
    """Six stretches of each of three conditions at two speeds."""
    data = []
    target = []
    rpm = []
    recording = []
    start = []
    for speed in (700.0, 900.0):
        for n, name in enumerate(["Normal", "IR", "OR"]):
            order = {"IR": ORDERS["inner"], "OR": ORDERS["outer"]}.get(name)
            length = 6 * RATE
            noise = np.random.default_rng([n, int(speed)]).normal(size=length)
            whole = (
                noise
                if order is None
                else strikes(order, speed, [n, int(speed)], length)
            )
            data.append(whole.reshape(6, RATE))
            target += 6 * [name]
            rpm += 6 * [speed]
            recording += 6 * [f"{name}_{speed:g}"]
            start += range(0, length, RATE)
    return Bunch(
        data=np.concatenate(data), target=np.array(target), rpm=np.array(rpm),
        recording=np.array(recording), start=np.array(start), sampling_rate=float(RATE),
        target_names=["Normal", "IR", "OR"],
    )  # fmt: skip


@pytest.mark.parametrize(
    "make",
    [
        lambda: Stretches(RATE),
        lambda: Stretches(RATE, 0.05),
        lambda: Stretches(RATE, None),
        lambda: OrdersAlone(RATE),
        lambda: WindowsVote(make_alpio, 1000),
    ],
)
def test_methods_name_conditions_at_the_other_speed(rig, make):
    pairs = pd.DataFrame(command.speed_pairs(make, rig))
    assert pairs[["train_rpm", "test_rpm"]].to_numpy().tolist() == [
        [700, 900],
        [900, 700],
    ]
    assert (
        pairs["accuracy"].min() >= 6 / 9
        and (pairs["location"] >= pairs["accuracy"]).all()
    )


@pytest.mark.parametrize("make", [LargestPeak, PyBearing])
def test_rules_name_the_location_by_the_geometry(rig, make):
    if make is PyBearing:
        pytest.importorskip("pybearing.analysis.envelope_analysis")
    pairs = pd.DataFrame(
        command.speed_pairs(lambda: make(RATE, ORDERS), rig, of_location=True)
    )
    assert pairs["accuracy"].isna().all() and pairs["location"].min() >= 5 / 9


def test_locations_of_compound_faults_are_unknown():
    expected = ["inner", "outer", "ball", "healthy", None]
    assert locations(["IR5", "O", "B", "N", "IR-OR"]).tolist() == expected


def test_tables_of_real_and_simulated_rigs_and_of_training():
    ours = command._OURS
    few = next(iter(command.TRAINING))
    rows = [
        ("UESTC", 1.0, ours, 0, 1.0), ("UESTC", 1.0, ours, 0, 0.5), ("UESTC", 1.0, few, 0, 0.25),
        ("UESTC", 2.0, ours, 0, 1.0), ("simulated, 3 mm", 1.0, ours, 21, 0.5),
        ("simulated, 3 mm", 1.0, ours, 21, 0.7), ("simulated, 3 mm", 1.0, ours, 22, 1.0),
    ]  # fmt: skip
    pairs = pd.DataFrame(rows, columns=["rig", "seconds", "method", "seed", "accuracy"])
    blocks = command.blocks(pairs.assign(location=1.0))
    assert list(blocks) == [
        f"stretches {name}" for name in ("overview", "training", "simulated")
    ]
    overview, training, simulated = (text.splitlines() for text in blocks.values())
    assert overview[2:] == [
        "| rig | method | 1 s | 2 s |",
        "| --- | --- | --- | --- |",
        f"| UESTC | {ours} | 0.750 / 0.500 (1.000) | 1.000 / 1.000 (1.000) |",
    ]
    assert training[4] == f"| UESTC | {few} | 0.250 / 0.250 (1.000) |  |"
    assert "over 2 seeds" in simulated[0]
    assert simulated[4] == f"| simulated, 3 mm | {ours} | 0.800 ± 0.283 / 0.500 |"
