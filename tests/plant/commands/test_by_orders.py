import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from skarxlag import bearing_orders
from skarxlag.plant.commands.fit import fit
from skarxlag.plant.readers.listing import list_files

from ...bearing_rows import RATE, row
from .conftest import counts

RATES = ("--sampling-rate", RATE)


@pytest.fixture(scope="module")
def plant(tmp_path_factory):
    """Recordings of a bearing 6205, healthy and with faults, at 900 rpm."""
    folder = tmp_path_factory.mktemp("plant")
    for place in ("healthy", "inner", "outer"):
        np.save(
            folder / f"{place}.npy",
            np.concatenate([row(place, seed=s) for s in (0, 1)]),
        )
    return folder


def test_places_are_named_without_a_model(run, plant):
    files = [plant / f"{place}.npy" for place in ("healthy", "outer")]
    code, out, _ = run("diagnose", "--bearing", "6205", "--rpm", 900, *RATES, *files)
    lines = out.splitlines()
    head = "No model: fault locations by the orders of bearing 6205."
    assert code == 0 and lines[0].startswith(head)
    assert " no fault pattern found " in lines[2] and " outer " in lines[3]
    # A remark on the first recording, and on no other.
    [line] = [line for line in lines if "ball faults" in line]
    assert line.startswith(f"{files[0]}: No comb exceeds its limit")
    assert line.endswith(" No fault pattern was found. Most ball faults show none.")


@pytest.mark.parametrize("bearing", ["9,7.94,39.04", "outer=3.585,inner=5.415"])
def test_bearings_by_dimensions_and_orders_and_speeds_of_a_table(run, plant, bearing):
    lines = ["path,rpm,sampling_rate", f"inner.npy,900,{RATE}"]
    (plant / "table.csv").write_text("\n".join(lines))
    output = plant / "results.csv"
    options = ("--bearing", bearing, "--table", plant / "table.csv", "-o", output)
    assert run("diagnose", *options)[0] == 0
    found = pd.read_csv(output)
    assert found["verdict"][0] == "inner" and found["alarm"][0] == "yes"
    assert found["p_value"][0] < 0.02 and found["probability"][0] > 0.9
    assert "impacts at 5.4" in found["remark"][0].lower()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--bearing", "6299", "x.npy"), "bearing '6299' is not known"),
        (
            ("--bearing", "6205", "x.npy", "--resample"),
            "--resample: belongs to a model",
        ),
        ((), "expected a model or --bearing"),
    ],
)
def test_wrong_arguments_are_named(run, plant, monkeypatch, arguments, message):
    monkeypatch.chdir(plant)
    code, _, err = run("diagnose", *arguments)
    assert code == 2 and message in err


def test_what_is_wrong_with_one_recording_is_reported(run, plant):
    code, _, err = run("diagnose", plant / "none.npy", plant / "inner.npy", "--bearing", "6205",
                       "--rpm", 900, *RATES)  # fmt: skip
    assert code == 1 and "none.npy" in err
    code, _, err = run(
        "diagnose", plant / "inner.npy", "--bearing", "6205", "--rpm", 900
    )
    assert code == 1 and "sampling_rate is missing; expected --sampling-rate" in err
    code, _, err = run("diagnose", plant / "inner.npy", "--bearing", "6205", *RATES)
    assert code == 1 and "rpm is missing; expected --rpm" in err


@pytest.mark.slow
def test_fit_stores_the_bearing_and_healthy_limits(run, plant):
    rng = np.random.default_rng(9)
    lines = ["path,rpm,sampling_rate"]
    for number in range(3):
        np.save(plant / f"good{number}.npy", rng.normal(size=int(10 * RATE)))
        lines.append(f"good{number}.npy,900,{RATE}")
    (plant / "table.csv").write_text("\n".join(lines))
    model = plant / "orders.skops"
    code, out, err = run("fit", plant / "table.csv", "-o", model, "--bearing", "6205")
    assert code == 0, err
    assert counts(out)["healthy"][0] == 3 and "Saved stretches to" in out
    code, out, _ = run("info", model)
    assert code == 0 and "healthy limits  " in out and "healthy stretches" in out
    rough = np.repeat(rng.normal(size=int(3 * RATE)), 2)[: int(3 * RATE)]
    np.save(plant / "rough.npy", rough)
    files = [plant / "inner.npy", plant / "good0.npy", plant / "rough.npy"]
    code, out, err = run("diagnose", model, *files, "--rpm", 900, *RATES)
    assert code == 0, err
    rows = [line.split() for line in out.splitlines() if ".npy" in line]
    verdicts = {Path(name).name: verdict for name, _, verdict, *_ in rows}
    assert verdicts["inner.npy"] == "inner"
    assert verdicts["good0.npy"] == "healthy"
    # The healthy limits are exceeded and no comb is found.
    assert verdicts["rough.npy"] == "changed"
    assert "No comb of bearing 6205 shows a fault." in out


@pytest.fixture(scope="module")
def joint(plant):
    """A model of recorded faults of a bearing 6205."""
    for place in ("healthy", "inner", "outer"):
        rows = [row(place, seed=seed) for seed in range(2, 8)]
        np.save(plant / f"learned_{place}.npy", np.concatenate(rows))
    pattern = r"learned_(?P<condition>\w+)\."
    facts = {"pattern": pattern, "sampling_rate": RATE, "rpm": 900.0}
    model = plant / "joint.skops"
    lines = fit(list_files(plant / "learned_*.npy", **facts), model, bearing="6205")
    assert lines[-1] == f"Saved stretches to {model}"
    return model


def test_a_model_is_asked_about_another_bearing(run, plant, joint):
    """An impact train at the inner race of a 6203 is that of no location of a 6205."""
    output = plant / "out.json"
    factor = bearing_orders("6203")["inner"] / bearing_orders("6205")["inner"]
    rows = [row("inner", rpm=900 * factor, seed=seed) for seed in (8, 9)]
    np.save(plant / "other.npy", np.concatenate(rows)[:10_800])
    found = []
    for bearing in ("6205", "6203"):
        asked = ("--bearing", bearing, "--rpm", 900, *RATES, "-o", output)
        code, out, err = run("diagnose", joint, plant / "other.npy", *asked)
        assert code == 0, err
        found += json.loads(output.read_text())["recordings"]
    own, other = found
    assert other["verdict"] == "inner" and other["alarm"] == "not valid here"
    assert own["alarm"] != "not valid here"
    assert other["dB_of_inner_comb"] > own["dB_of_inner_comb"] + 3
    [window] = other["window_rows"]
    assert "of 6203" in window["evidence"]
    assert window["dB_of_inner"] > max(window["dB_of_outer"], window["dB_of_ball"])
    assert "Asked about bearing 6203" in out.splitlines()[0]
    assert "the bearing is 6203, but the model was fitted on 6205" in out


def test_fit_by_orders_needs_bearing_and_speed(run, plant):
    table = plant / "table.csv"
    table.write_text(f"path,sampling_rate\ninner.npy,{RATE}\nouter.npy,{RATE}")
    output = ("-o", plant / "orders.skops")
    code, _, err = run(
        "fit", table, *output, "--diagnoser", "diagnoser", "--bearing", "6205"
    )
    assert code == 2 and "argument --diagnoser: is stretches with --bearing" in err
    code, _, err = run(
        "fit", table, *output, "--bearing", "6205", "--window-length", "10000"
    )
    assert code == 1 and "no speed is stated" in err
