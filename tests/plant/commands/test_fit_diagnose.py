import json
import shutil

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat
from scipy.signal import lfilter

from skarxlag import (
    make_windows,
    recording_verdicts,
)
from skarxlag.persistence.models import load_diagnoser
from skarxlag.plant.commands import main

from .conftest import counts

COLOURS = {"good": [1.0, -0.9], "inner": [1.0, 0.9], "outer": [1.0, 0.0, 0.8]}
WINDOW = 200


def signal(condition, n_samples, seed, gain=1.0):
    noise = np.random.default_rng(seed).normal(size=n_samples)
    return gain * lfilter([1.0], COLOURS[condition], noise)


FIT = ("--window-length", WINDOW, "--healthy", "good")


@pytest.fixture(scope="module")
def original(tmp_path_factory):
    """Recordings of three conditions at two speeds, their table, and a model of them."""
    folder = tmp_path_factory.mktemp("workshop")
    lines = ["path,condition,rpm,sampling_rate"]
    for number, condition in enumerate(["inner", "good", "outer"]):
        for rpm in (300, 500):
            name = f"{condition}_{rpm}.npy"
            gain = 1.0 if condition == "good" else 5.0
            np.save(folder / name, signal(condition, 20 * WINDOW, number + rpm, gain))
            lines.append(f"{name},{condition},{rpm},50e3")
    (folder / "table.csv").write_text("\n".join(lines))
    fit = ("fit", folder / "table.csv", "-o", folder / "bearing.skops", *FIT)
    assert main([str(argument) for argument in fit]) == 0
    return folder


@pytest.fixture
def workshop(original, tmp_path):
    """A copy of the recordings for one test."""
    return shutil.copytree(original, tmp_path, dirs_exist_ok=True)


@pytest.fixture
def model(workshop):
    return workshop / "bearing.skops"


def test_fit_prints_and_stores_what_it_used(run, workshop):
    path = workshop / "m.skops"
    code, out, err = run("fit", workshop / "table.csv", "-o", path, *FIT)
    assert code == 0 and counts(out)["good"] == [2, 40] and str(path) in out
    assert "Limits for a false-alarm rate of 0.01 from 40 healthy rows" in out
    assert "120 windows: fitting" in err
    diagnoser, facts = load_diagnoser(path)
    assert facts["conditions"] == ["good", "inner", "outer"]
    assert facts["train_rpm"] == [300.0, 500.0]
    assert (facts["window_length"], facts["n_channels"]) == (WINDOW, 1)
    assert facts["sampling_rate"] == 50e3 and facts["diagnoser"] == "diagnoser"
    assert facts["skarxlag"] and "known_conditions" in facts
    assert facts["detector"][-1].n_rows_ == 40
    assert diagnoser["identify"].n_jobs is None
    assert diagnoser["decide"].healthy == "good"


def test_the_healthy_condition_is_that_of_its_name_or_stated(run, workshop):
    table, path = workshop / "named.csv", workshop / "m.skops"
    rows = ["good_300.npy,inner,50e3", "inner_300.npy,Healthy bearing,50e3"]
    table.write_text("\n".join(["path,condition,sampling_rate", *rows]))
    fit = ("fit", table, "-o", path, "--window-length", WINDOW)
    for options, healthy in (
        ((), "Healthy bearing"),
        (("--healthy", "inner"), "inner"),
    ):
        assert f"Healthy: {healthy}\n" in run(*fit, *options)[1]
        assert load_diagnoser(path)[1]["conditions"][0] == healthy


def test_fit_requires_the_healthy_condition_that_no_name_states(run, workshop):
    table, path = workshop / "unnamed.csv", workshop / "m.skops"
    table.write_text(
        "path,condition,sampling_rate\ngood_300.npy,a,5\ninner_300.npy,b,5\n"
    )
    plain = ("fit", table, "-o", path, "--window-length", WINDOW)
    arguments = (*plain, "--diagnoser", "detector")
    for command in (plain, arguments):
        code, _, err = run(*command)
        assert code == 2
        assert "argument --healthy: needed, expected a condition of" in err
        assert ("--healthy none" in err) == (command == plain) and "a, b" in err
        assert not path.exists()
    code, _, err = run(*arguments, "--healthy", "none")
    assert code == 2 and "argument --healthy: none, expected a condition of" in err
    code, out, _ = run(*plain, "--healthy", "none")
    assert code == 0 and "Healthy: none\n" in out
    assert load_diagnoser(path)[1]["healthy"] is None
    code, _, err = run(
        "diagnose", path, workshop / "good_300.npy", "--fail-on", "alarm"
    )
    assert code == 2 and "does not state which condition is healthy" in err
    code, out, err = run("diagnose", path, workshop / "good_300.npy")
    assert code == 0, err
    assert "Healthy: not known" in out and out.count("no healthy limits") == 1
    assert "not stated" in run("info", path)[1]
    table.write_text("path,condition,sampling_rate\ngood_300.npy,a,5\n")
    code, out, _ = run(*arguments)
    assert code == 0 and "Healthy: a\n" in out


def test_a_file_without_facts_and_its_windows(run, model, workshop):
    path, output = workshop / "run_17.npy", workshop / "verdicts.csv"
    recording = signal("inner", 7 * WINDOW + 50, seed=77, gain=3.0)
    np.save(path, recording)
    code, out, _ = run("diagnose", model, path, "-o", output)
    assert code == 0 and "50000 Hz was assumed" in out
    rows = pd.read_csv(output)
    line = next(line for line in out.splitlines() if line.startswith(str(path)))
    probability = min(rows["probability"].item(), 0.999)
    assert line.split()[1:] == ["inner", f"{probability:.1%}", "-"]
    windows = pd.read_csv(workshop / "verdicts_windows.csv")
    assert windows["start"].tolist() == list(range(0, 7 * WINDOW, WINDOW))
    assert set(windows["recording"]) == {str(path)} and windows["alarm"].isna().all()
    diagnoser = load_diagnoser(model)[0]
    predicted = diagnoser.predict(make_windows(recording, WINDOW))
    assert windows["verdict"].tolist() == predicted.tolist()


def test_detector_needs_healthy_recordings_only(run, workshop):
    path, full = workshop / "detector.skops", workshop / "table.csv"
    options = ("--diagnoser", "detector", "--window-length", WINDOW, *FIT[2:])
    code, out, _ = run("fit", full, "-o", path, *options, "--false-alarm-rate", "0.05")
    assert code == 0 and counts(out)["good"] == [2, 40]
    assert "Limits for a false-alarm rate of 0.05 from 40 healthy rows; false" in out
    output = workshop / "v.csv"
    code, out, _ = run("diagnose", path, "--table", full, "-o", output)
    assert code == 0 and "probability" not in out
    verdicts = pd.read_csv(output)["verdict"].tolist()
    assert verdicts == ["changed"] * 2 + ["good"] * 2 + ["changed"] * 2
    code, out, _ = run("diagnose", path, workshop / "good_300.npy")
    assert code == 1
    assert "no verdict: the speed is not stated, and healthy limits hold at 300" in out
    code, _, err = run("diagnose", path, "--table", full, "--rpm", "300")
    assert code == 1 and "rpm 300.0 has no effect, because each line of" in err


def test_channels_of_inputs(run, workshop):
    rng = np.random.default_rng(0)
    lines = ["path,condition,sampling_rate,channel"]
    for condition in ("good", "inner"):
        y = signal(condition, 10 * WINDOW, 3)
        savemat(workshop / f"{condition}.mat", {"y": y, "u": rng.normal(size=y.size)})
        lines.append(f"{condition}.mat,{condition},50e3,y;u")
    table, path = workshop / "two.csv", workshop / "two.skops"
    table.write_text("\n".join(lines))
    code, out, _ = run("fit", table, "-o", path, "--window-length", WINDOW)
    assert code == 0 and "Outputs: y. Inputs: u\n" in out and "have the unit" not in out
    assert load_diagnoser(path)[1]["n_channels"] == 2
    file = workshop / "inner.mat"
    code, out, _ = run("diagnose", path, file, "--channel", "y; u")
    assert code == 0 and " inner " in out
    code, out, err = run("diagnose", path, file, "--channel", "u;y")
    assert code == 1
    assert f"channels u; y, but {path} was fitted on y; u, in this order" in err
    code, out, err = run("diagnose", path, file, "--channel", "y")
    assert code == 1
    reason = f"{file}: 1 channel, but {path} was fitted on 2; --channel chooses"
    assert err.splitlines()[-1] == f"  {reason}"


def test_tables_that_cannot_be_fitted_are_named(run, workshop):
    table = workshop / "other.csv"
    for content, message in [
        ("path,sampling_rate\ngood_300.npy,5\n", "conditions not stated; expected two"),
        (
            "path,condition,sampling_rate\ngood_300.npy,worn,5\n",
            "conditions worn; expected two",
        ),
        ("path,condition,sampling_rate\ngone.npy,good,5\n", "line 2"),
    ]:
        table.write_text(content)
        code, _, err = run(
            "fit", table, "-o", workshop / "m.skops", "--window-length", WINDOW
        )
        assert code == 1 and message in err and str(table) in err
    table.write_text("path,sampling_rate\ngood_300.npy,5\n")
    options = ("--diagnoser", "detector", "--healthy", "good")
    options += ("--window-length", WINDOW)
    code, _, err = run("fit", table, "-o", workshop / "m.skops", *options)
    assert code == 2 and "--healthy" in err
    assert not (workshop / "m.skops").exists()


def test_wrong_arguments_of_diagnose_are_named(run, model, workshop):
    table = workshop / "table.csv"
    code, out, err = run("diagnose", model, "--table", table, "--pattern", "(?P<rpm>.)")
    assert code == 2 and "argument --pattern: for a folder" in err and not out


def test_a_recording_that_fails_costs_no_other_its_verdict(run, model, workshop):
    short, gone = workshop / "short.npy", workshop / "gone.npy"
    np.save(short, np.zeros(WINDOW - 1))
    output = workshop / "v.csv"
    good = [workshop / "good_300.npy", workshop / "inner_300.npy"]
    code, _, err = run("diagnose", model, gone, good[0], short, good[1], "-o", output)
    assert code == 1
    assert err.splitlines()[-3] == "2 of 4 recordings failed:"
    assert str(gone) in err.splitlines()[-2] and "fewer than" in err.splitlines()[-1]
    rows = pd.read_csv(output)
    assert rows["verdict"].tolist()[1::2] == ["good", "inner"]
    assert rows["error"].notna().tolist() == [True, False, True, False]


def test_the_alarm_needs_a_speed_near_those_of_the_training(run, model, workshop):
    file = workshop / "inner_300.npy"
    code, out, _ = run("diagnose", model, file, "--rpm", 300)
    assert code == 0 and "Healthy: good" in out and "yes (p " in out
    code, out, _ = run("diagnose", model, file, "--rpm", 5, "--fail-on", "alarm")
    assert code == 3 and "no verdict: speed 5 rpm is outside 60 to 2500 rpm" in out


def test_the_shell_says_what_recording_verdicts_says(run, model, workshop):
    output = workshop / "v.json"
    run("diagnose", model, "--table", workshop / "table.csv", "-o", output)
    rows = pd.DataFrame(json.loads(output.read_text())["recordings"])
    rows = rows.set_index("recording")
    diagnoser, facts = load_diagnoser(model)
    listed = pd.read_csv(workshop / "table.csv")
    X = [make_windows(np.load(workshop / name), WINDOW) for name in listed["path"]]
    counts = [len(windows) for windows in X]
    expected = recording_verdicts(
        diagnoser,
        np.concatenate(X),
        np.repeat(listed["path"], counts),
        facts["conditions"],
        rpm=np.repeat(listed["rpm"], counts),
        known=facts["known_conditions"],
        detector=facts["detector"],
        train_rpm=facts["train_rpm"],
    )
    assert (rows[["verdict", "alarm"]] == expected[["verdict", "alarm"]]).all(axis=None)
    for name in ("probability", "p-value", "p-value of nearest", "share of good"):
        column = rows[name.replace("-", "_").replace(" ", "_")].astype(float)
        np.testing.assert_array_equal(column, expected[name])


def test_recordings_are_brought_to_one_rate(run, workshop):
    path = workshop / "slow.skops"
    options = ("--resample-to", 25e3, "--window-length", WINDOW)
    code, _, _ = run("fit", workshop / "table.csv", "-o", path, *options)
    assert code == 0 and load_diagnoser(path)[1]["sampling_rate"] == 25e3
