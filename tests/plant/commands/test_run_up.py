"""Run-ups: the speed varies within a recording, from the file to the verdict."""

import json
import re

import numpy as np
import pytest
from scipy.signal import lfilter

from skarxlag import bearing_orders
from skarxlag.plant.commands import main

RATE, SECONDS = 5000, 6
LOWEST, HIGHEST = 900.0, 1500.0


def run_up(order, seed, seconds=SECONDS):
    """A signal with impacts at an order of the shaft (none: noise), and pulses of a tachometer."""
    rng, n_samples = np.random.default_rng(seed), RATE * seconds
    speed = np.geomspace(LOWEST, HIGHEST, n_samples)
    turns = np.cumsum(speed / 60) / RATE
    noise = rng.normal(size=n_samples)
    if order is not None:
        angles = np.cumsum(rng.normal(1, 0.01, size=int(turns[-1] * order))) / order
        impacts = np.zeros(n_samples)
        impacts[
            np.interp(angles[angles < turns[-1]], turns, np.arange(n_samples)).astype(
                int
            )
        ] = 6
        noise += lfilter([1], [1, -0.9, 0.8], impacts)
    return np.stack([noise, 5.0 * (turns % 1 < 0.1)])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs")
    for name in ("inner", "outer", None):
        order = bearing_orders("6205")[name] if name else None
        for seed in (1, 2):
            acc, key = run_up(order, seed)
            np.savez(
                folder / f"{name or 'healthy'}_{seed}.npz", acc=acc, key=key, fs=RATE
            )
    return folder


@pytest.fixture(scope="module")
def model(folder):
    path = folder / "model.skops"
    fit = [
        "fit",
        folder / "healthy_*.npz",
        "--bearing",
        "6205",
        "--channel",
        "acc",
        "-o",
        path,
    ]
    assert main([*map(str, fit), "--rpm", "tacho:key", "-q"]) == 0
    return path


@pytest.mark.parametrize("name", ["inner", "healthy"])
def test_the_place_of_a_fault_is_found_where_the_mean_speed_fails(run, folder, name):
    mean = (HIGHEST - LOWEST) / np.log(HIGHEST / LOWEST)
    output = folder / "results.json"
    none = "no fault pattern found"
    of_name = none if name == "healthy" else name
    log = folder / "speeds.csv"
    log.write_text(f"recording,rpm\n{name}_1,{mean}\n")
    # Pulses that are taken for four in a revolution give a quarter of the speed.
    for speed, n_pulses, expected in (
        ("tacho:key", 1, of_name),
        ("tacho:key", 4, none),
        (log, None, none),
    ):
        pulses = () if n_pulses is None else ("--pulses-per-revolution", n_pulses)
        diagnose = ("diagnose", "--bearing", "6205", "--channel", "acc", "-o", output)
        speeds = ("--rpm", speed, *pulses)
        code, _, err = run(*diagnose, *speeds, folder / f"{name}_1.npz")
        assert code == 0, err
        found = json.loads(output.read_text())["recordings"]
        assert [row["verdict"] for row in found] == [expected], speed


def test_a_run_up_from_rest_is_used_from_a_fifth_of_its_speed_on(run, tmp_path):
    acc, _ = run_up(bearing_orders("6205")["inner"], 1)
    rest = np.concatenate([np.zeros(RATE), np.linspace(0, LOWEST, RATE // 2)])
    noise = np.random.default_rng(0).normal(size=len(rest))
    rpm = np.concatenate([rest, np.geomspace(LOWEST, HIGHEST, len(acc))])
    np.savez(tmp_path / "run.npz", acc=np.concatenate([noise, acc]), rpm=rpm, fs=RATE)
    output = tmp_path / "results.json"
    diagnose = ("diagnose", tmp_path / "run.npz", "--bearing", "6205")
    diagnose += ("--channel", "acc")
    code, _, err = run(*diagnose, "-o", output)
    (row,) = json.loads(output.read_text())["recordings"]
    assert code == 0 and row["verdict"] == "inner", err
    # A fifth of 1500 rpm is reached after a second, and a third of the half second to
    # 900 rpm.
    assert row["window_rows"][0]["start"] == pytest.approx(RATE * (1 + 0.5 / 3), abs=60)


def test_fit_and_diagnose_with_speeds_over_time(run, model, folder):
    facts = json.loads(run("info", model, "--json")[1])
    assert facts["rows"] == "stretches" and len(facts["train_rpm"]) == 5
    output = folder / "of_model.json"
    diagnose = ("diagnose", model, folder / "*.npz", "--channel", "acc")
    diagnose += ("--rpm", "tacho:key")
    code, _, err = run(*diagnose, "-o", output)
    assert code == 0, err
    rows = json.loads(output.read_text())["recordings"]
    assert [row["verdict"] for row in rows] == ["healthy"] * 2 + ["inner"] * 2 + [
        "outer"
    ] * 2
    speeds = [window["rpm"] for window in rows[0]["window_rows"]]
    assert speeds[0] < 1000 and speeds[-1] > 1400


def test_evaluate_leaves_recordings_out_by_their_mean_speed(run, tmp_path):
    lines = ["path,condition,channel,rpm"]
    for factor in (1, 2):
        for name, order in {"healthy": None, "inner": 5.415}.items():
            acc, key = run_up(order, factor)
            path = tmp_path / f"{name}_{factor}.npz"
            np.savez(path, acc=acc, key=key, fs=RATE)
            lines.append(
                f"{path.name},{name},acc,{'tacho:key' if factor == 1 else 2000}"
            )
    table = tmp_path / "table.csv"
    table.write_text("\n".join(lines))
    code, out, err = run("evaluate", table, "--output", tmp_path / "report")
    assert code == 0, err
    assert re.search(r"at 11[67]\d\S*, 2000 rpm", out)


def test_pulses_per_turn_belong_to_a_tachometer(run, model, piped):
    piped(b"1\n2\n")
    code, _, err = run("watch", model, "-", "--rpm", 900, "--pulses-per-revolution", 2)
    assert code == 2
    assert "--pulses-per-revolution: belongs to --rpm tacho:CHANNEL" in err
