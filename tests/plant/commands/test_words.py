"""What a verdict says about its limits: speeds, loads, fault patterns, training, long files."""

import json
import re

import numpy as np
import pandas as pd
import pytest

from skarxlag import make_diagnoser, save_diagnoser
from skarxlag.plant.commands import models
from skarxlag.plant.commands.fit import fit
from skarxlag.plant.commands.info import describe
from skarxlag.plant.commands.results import csv_of
from skarxlag.plant.readers.listing import list_recordings

from ...impacts import RATE, strikes

pytestmark = pytest.mark.filterwarnings("ignore::UserWarning")
FACTS = ("--sampling-rate", RATE)
SPEED = ("--rpm", 900)


@pytest.fixture(scope="module")
def noise():
    return np.random.default_rng(0).normal(size=4 * RATE)


def write(folder, name, signal):
    np.save(folder / f"{name}.npy", signal)
    return folder / f"{name}.npy"


def results(run, tmp_path, *arguments):
    """Rows of the results of diagnose, and what it prints."""
    output = tmp_path / "out.json"
    code, out, err = run("diagnose", *arguments, "-o", output)
    assert code in (0, 1), err
    return json.loads(output.read_text())["recordings"], out


def test_no_pattern_is_not_called_healthy(run, tmp_path, noise):
    path = write(tmp_path, "noise", noise)
    [row], out = results(run, tmp_path, "--bearing", "6205", path, *FACTS, *SPEED)
    assert row["verdict"] == "no fault pattern found"
    assert "Most ball faults show none" in out
    assert row["window_rows"][0]["verdict"] == "no fault pattern found"
    page = tmp_path / "out.html"
    command = ("diagnose", "--bearing", "6205", path, *FACTS, *SPEED, "-o", page)
    assert run(*command, "--fail-on", "alarm")[0] == 0
    assert '<li class="open"><b>1</b>no fault pattern found' in page.read_text()


@pytest.mark.parametrize(("rpm", "has_remark"), [(50, True), (60, False)])
def test_a_speed_that_may_be_in_hertz_is_repeated(
    run, tmp_path, noise, rpm, has_remark
):
    path = write(tmp_path, "shaft", noise)
    arguments = ("--bearing", "6205", path, *FACTS, "--rpm", rpm)
    [row], out = results(run, tmp_path, *arguments)
    text = f"The speed was read as {rpm} rpm ({rpm / 60:.3g} Hz)."
    assert (text in out) == (text in row["remark"]) == has_remark


@pytest.fixture(scope="module")
def plant(tmp_path_factory):
    """Healthy recordings at load 0, their table, and what fit prints of them."""
    folder = tmp_path_factory.mktemp("plant")
    rng = np.random.default_rng(1)
    lines = ["path,condition,rpm,sampling_rate,load"]
    for number in range(3):
        write(folder, f"h{number}", rng.normal(size=6 * RATE))
        lines.append(f"h{number}.npy,healthy,900,{RATE},0")
    (folder / "table.csv").write_text("\n".join(lines))
    write(folder, "new", rng.normal(size=6 * RATE))
    return folder


@pytest.fixture(scope="module")
def model(plant):
    path = plant / "m.skops"
    lines = fit(list_recordings(plant / "table.csv"), path)
    *_, false_alarms, _ = lines
    assert re.match(r"False alarms: \d of 15 healthy stretches exceed", false_alarms)
    assert f"  - {false_alarms}" in describe(path)[0]
    return path


def table(plant, *lines):
    path = plant / "further.csv"
    path.write_text("\n".join(["path,condition,rpm,sampling_rate,load", *lines]))
    return path


def test_an_alarm_holds_for_the_facts_of_its_training(run, plant, tmp_path, model):
    lines = (f"new.npy,healthy,900,{RATE},{load}" for load in (0, 11))
    (plant / "again.npy").write_bytes((plant / "new.npy").read_bytes())
    listed = table(plant, next(lines), next(lines).replace("new", "again"))
    rows, out = results(run, tmp_path, model, "--table", listed)
    assert [row["alarm"] == "not valid here" for row in rows] == [False, True]
    reason = "the load is 11, but the model was fitted on 0"
    assert rows[1]["verdict"] == f"no verdict: {reason}" and reason in out


def test_results_state_levels(run, tmp_path):
    time = np.arange(4 * RATE) / RATE
    path = write(tmp_path, "sine", 3 + 2 * np.sin(2 * np.pi * 50 * time))
    arguments = ("--bearing", "6205", path, *FACTS, *SPEED)
    [row], _ = results(run, tmp_path, *arguments, "--unit", "g")
    assert row["rms"] == pytest.approx(np.sqrt(2), rel=1e-3)
    assert row["peak"] == pytest.approx(2, rel=1e-3)
    assert row["crest_factor"] == pytest.approx(np.sqrt(2), rel=1e-3)
    assert row["unit"] == "g"
    expected = 9806.65 * np.sqrt(2) / (100 * np.pi)
    assert row["velocity_rms_mm_s"] == pytest.approx(expected, rel=1e-2)
    assert row["window_rows"][0]["rms"] == pytest.approx(np.sqrt(2), rel=1e-3)
    [row], _ = results(run, tmp_path, *arguments)
    assert row["unit"] is None and "velocity_rms_mm_s" not in row


def test_a_long_recording_is_read_in_rows(run, tmp_path, noise, monkeypatch):
    """The rows are those of the recording, and the last part that fills none is left out."""
    monkeypatch.setattr(models, "_LONGEST_ROW", 10_000)
    signal = strikes(5.415, 900, [0], 34_000)
    arguments = ("--bearing", "6205", write(tmp_path, "long", signal), *FACTS, *SPEED)
    [row], _ = results(run, tmp_path, *arguments)
    starts = [each["start"] for each in row["window_rows"]]
    assert starts == [0, 10_000, 20_000]


def test_info_describes_a_model_of_a_bearing(run, tmp_path, noise):
    rows = noise.reshape(8, -1)
    rows[4:, :: RATE // 54] += 6
    model = make_diagnoser(sampling_rate=RATE, bearing="6205")
    model.fit(rows, np.repeat(["healthy", "outer"], 4), rpm=900)
    save_diagnoser(model, tmp_path / "m.skops", sampling_rate=float(RATE))
    code, out, err = run("info", tmp_path / "m.skops")
    assert code == 0, err
    assert "the detection threshold" in out


def test_fit_with_a_bearing_and_one_healthy_row_ends_well(run, tmp_path, noise):
    path = write(tmp_path, "h", noise[:RATE])
    (tmp_path / "t.csv").write_text(
        f"path,condition,rpm,sampling_rate\nh.npy,healthy,900,{RATE}"
    )
    options = ("--bearing", "6205", "--window-length", RATE)
    code, out, err = run(
        "fit", tmp_path / "t.csv", "-o", tmp_path / "m.skops", *options
    )
    assert code == 0 and "No healthy limits: " in out and "combs" in out, err
    assert path.exists()


def test_bearings_are_listed_and_found(run, tmp_path):
    out = run("bearings")[1]
    assert out.splitlines()[0].split() == ["BPFO", "BPFI", "2", "BSF", "FTF"]
    assert "61806  8.649 10.351" in out
    path = write(tmp_path, "inner", strikes(5.415, 900, [0, 1], 4 * RATE))
    code, out, _ = run("bearings", path, *FACTS, *SPEED)
    names = [line.split()[0] for line in out.splitlines()[1:]]
    assert code == 0 and len(names) == 10 and "6205" in names[:5]
    assert out.splitlines()[1].split()[3] == "inner"
    code, _, err = run("bearings", path, *FACTS)
    assert code == 1 and "the speed is missing; state it with --rpm" in err


def test_cells_are_inert():
    cells = ["=1+1", "a;=2", "\x1b[2Jx", "-3", "-"]
    lines = csv_of(
        pd.DataFrame({"+name": cells}, index=["@i"] * 5), index=True
    ).splitlines()
    assert lines[0] == ",'+name"
    assert lines[1:] == ["'@i,'=1+1", "'@i,a;'=2", "'@i,\\x1b[2Jx", "'@i,'-3", "'@i,-"]


def test_show_draws_a_table(run, plant, tmp_path):
    page, line = tmp_path / "page.html", f"new.npy,healthy,900,{RATE},0"
    code, out, _ = run("show", "--table", table(plant, line), "-o", page)
    assert code == 0 and out == f"Written: {page}\n" and "new.npy" in page.read_text()
