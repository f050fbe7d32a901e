import numpy as np
import pandas as pd
import pytest
from sklearn.utils import Bunch

from benchmarks.cross_speed.protocol import leave_one_speed_in
from benchmarks.recipe import ablation
from benchmarks.recipe.ablation import (
    RECIPE,
    comparisons,
    difference_table,
    differences,
    variants,
)
from benchmarks.recipe.parts import WITHOUT, part_table
from tests.benchmarks.speed_rig import LENGTH, moving_rig


def frame(scores, rig="a"):
    """Pairs 1>2 and 2>1 of each method, and one pair of equal speeds that must not count."""
    rows = []
    for method, (up, down) in scores.items():
        rows += [(rig, method, 1.0, 2.0, up), (rig, method, 2.0, 1.0, down)]
        rows.append((rig, method, 1.0, 1.0, 0.0))
    pairs = pd.DataFrame(
        rows, columns=["rig", "method", "train_rpm", "test_rpm", "accuracy"]
    )
    return pairs.assign(verdict="window", window_length=1200)


def test_differences_are_paired():
    scores = {"linear, power": (0.9, 0.7), "no observer, power": (0.8, 0.4)}
    rows = differences(pd.concat([frame(scores), frame(scores, "b")]))
    assert rows.rig.tolist() == ["a", "b"]
    assert rows.variant.unique().tolist() == ["linear, power"]
    np.testing.assert_allclose(rows.difference, 0.2)
    # Differences 0.1 and 0.3: standard deviation sqrt(0.02), over sqrt(2).
    np.testing.assert_allclose(rows.standard_error, 0.1)
    table = difference_table(rows)
    assert table["a"].tolist() == ["+0.200 ± 0.100"]
    assert table["mean over rigs"].tolist() == ["+0.200 ± 0.071"]


def test_accuracies_leave_equal_speeds_out():
    table = ablation.accuracies(frame({"x": (0.9, 0.7)}))
    assert table["a: mean"].tolist() == [0.8]
    assert table["a: worst pair"].tolist() == [0.7]


def test_every_comparison_names_variants():
    names = set(variants())
    assert len(names) == 26
    assert {name for _, *pair in comparisons() for name in pair} == names


@pytest.mark.parametrize(
    "name",
    [
        RECIPE,
        f"{RECIPE}, spectral shape alone",
        "linear, power",
        "healthy model alone, sensor's unit",
    ],
)
def test_variant_runs_the_protocol(name):
    rig = moving_rig()
    pairs = list(leave_one_speed_in(lambda: variants()[name]("ok"), rig, LENGTH))
    assert len(pairs) == 4
    same = [p["window"]["accuracy"] for p in pairs if p["train_rpm"] == p["test_rpm"]]
    cross = [p["window"]["accuracy"] for p in pairs if p["train_rpm"] != p["test_rpm"]]
    assert min(same) > 0.9
    # The level of the healthy condition doubles with speed, and one threshold cannot
    # follow.
    assert (min(cross) > 0.9) == (name != "healthy model alone, sensor's unit")


def test_a_rig_without_a_healthy_condition_has_no_healthy_model():
    with_healthy = Bunch(target_names=["Normal", "IR"])
    without = Bunch(target_names=["inner007", "ball007"])
    names, fewer = (
        {name for name, _ in ablation.variants_of(rig)}
        for rig in (with_healthy, without)
    )
    unit, sensor = (f"healthy model alone, {u}" for u in ("unit RMS", "sensor's unit"))
    assert names - fewer == {unit, sensor}
    shown = ablation.variants_of(with_healthy, parts_alone=True)
    assert {name for name, _ in shown} == {RECIPE, *WITHOUT.values()}


def test_a_part_earns_what_is_lost_without_it():
    right = {"a": (90, 70), "b": (80, 80), "simulated rig": (50, 10)}
    methods = (RECIPE, f"{RECIPE}, no drift at all")
    names = ["rig", "window_length", "method", "train_rpm", "test_rpm", "recording"]
    rows = [
        (rig, 4, method, train, 3 - train, f"x{train}", 100, count)
        for rig, counts in right.items()
        for method, count in zip(methods, counts, strict=True)
        for train in (1.0, 2.0)
    ]
    text = part_table(pd.DataFrame(rows, columns=[*names, "windows", "right"]))
    assert text.splitlines()[-4:] == [
        "| part | mean of rigs | 90 % interval | a | b | simulated rig |",
        "| --- | ---: | --- | ---: | ---: | ---: |",
        "| all parts | 0.850 |  | 0.900 | 0.800 | 0.500 |",
        "| expected change with speed | +0.100 | 0.000 to 0.200 | +0.200 | +0.000 | +0.400 |",
    ]
