"""fit and diagnose recognize recordings that are of no condition of the training."""

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter

from skarxlag.kernels.evidence import NEAREST_CORRELATION, combined_p_value
from skarxlag.plant.commands import main

from .test_fit_diagnose import signal

WINDOW, N = 600, 60
OTHERS = {
    "noise": np.random.default_rng(0).normal(size=6 * WINDOW),
    # Without noise, it would have no signal.
    "sine": np.sin(0.3 * np.arange(6 * WINDOW))
    + 1e-3 * np.random.default_rng(2).normal(size=6 * WINDOW),
    "untrained": signal("outer", 6 * WINDOW, 5),
    "sensor": lfilter(
        [1], [1, -1.2, 0.9], np.random.default_rng(1).normal(size=6 * WINDOW)
    ),
}


@pytest.fixture(scope="module")
def plant(tmp_path_factory):
    """Recordings of two conditions, of those again, and of other things; tables of all."""
    folder = tmp_path_factory.mktemp("plant")
    lines = ["path,condition,rpm,sampling_rate"]
    for number, condition in enumerate(["good", "inner"]):
        np.save(folder / f"{condition}.npy", signal(condition, N * WINDOW, number))
        np.save(
            folder / f"new_{condition}.npy", signal(condition, 6 * WINDOW, 10 + number)
        )
        lines.append(f"{condition}.npy,{condition},500,50e3")
    (folder / "table.csv").write_text("\n".join(lines))
    for name, samples in OTHERS.items():
        np.save(folder / f"{name}.npy", samples)
    return folder


@pytest.fixture(scope="module")
def model(plant):
    path = plant / "bearing.skops"
    fit = ("fit", plant / "table.csv", "-o", path, "--window-length", WINDOW)
    assert main([str(argument) for argument in fit]) == 0
    return path


def diagnose(run, model, plant, *options, names=OTHERS):
    output = plant / "out.csv"
    paths = [plant / f"{name}.npy" for name in names]
    code, out, _ = run("diagnose", model, *paths, "-o", output, *options)
    return code, out, pd.read_csv(output)


def test_what_is_of_no_condition_is_reported(run, plant, model):
    code, out, rows = diagnose(run, model, plant, "--rpm", 500)
    assert code == 0
    assert set(rows["verdict"]) == {"unknown condition"}
    assert (rows["p_value_of_nearest"] < 0.01).all()
    assert rows["probability"].isna().all()
    assert rows["remark"].str.contains("resembles no condition of the model").all()
    assert out.count("All recordings: The recording resembles no condition") == 1
    windows = pd.read_csv(plant / "out_windows.csv")
    p_values = windows.groupby("recording")["p_value_of_nearest"].agg(
        combined_p_value, correlation=NEAREST_CORRELATION
    )
    np.testing.assert_allclose(rows["p_value_of_nearest"], p_values[rows["recording"]])


@pytest.mark.parametrize("options", [(), ("--rpm", 600)])
def test_other_and_unknown_speeds_are_said(run, plant, model, options):
    _, out, rows = diagnose(
        run, model, plant, *options, names=["new_good", "untrained"]
    )
    # Healthy limits widen with the distance in speed; without a speed they do not hold.
    assert out.count("All recordings: No alarm: the speed is not stated") == (
        not options
    )
    assert (rows["alarm"] == "-").all() == (not options)
    at_500 = diagnose(run, model, plant, "--rpm", 500, names=["new_good", "untrained"])[
        2
    ]
    assert (rows["p_value_of_nearest"] > at_500["p_value_of_nearest"]).all()
    assert at_500["verdict"][0] == "good" and at_500["p_value_of_nearest"][0] > 0.01
    assert rows["verdict"][0] == "good"
