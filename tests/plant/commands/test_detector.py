"""A detector from a table of healthy recordings, in diagnose and in watch."""

import json

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter

from skarxlag.persistence.models import load_diagnoser

from ...impacts import ORDERS, RATE, strikes
from ..watch.watching import lines_of
from .conftest import counts

SPEEDS = (600, 750, 900)


def healthy(rpm, seed, n_samples):
    """Noise of the machine, whose colour changes a little with speed."""
    noise = np.random.default_rng([seed, rpm]).normal(size=n_samples)
    return lfilter([1], [1, -0.5 - rpm / 1e4], noise)


@pytest.fixture(scope="module")
def plant(tmp_path_factory):
    """Healthy recordings of 6 s at three speeds with their table, and recordings to diagnose."""
    folder = tmp_path_factory.mktemp("plant")
    lines = ["path,rpm,sampling_rate"]
    for rpm in SPEEDS:
        np.save(folder / f"{rpm}.npy", healthy(rpm, 0, 6 * RATE))
        lines.append(f"{rpm}.npy,{rpm},{RATE}")
    (folder / "healthy.csv").write_text("\n".join(lines))
    lines = ["path,rpm,sampling_rate"]
    for name in ("well", "worn"):
        signal = healthy(680, 1, 4 * RATE)
        if name == "worn":
            signal += strikes(ORDERS["inner"], 680, 2, 4 * RATE)
        np.save(folder / f"{name}.npy", signal)
        lines.append(f"{name}.npy,680,{RATE}")
    (folder / "new.csv").write_text("\n".join(lines))
    return folder


@pytest.fixture
def model(run, plant):
    path = plant / "detector.skops"
    code, out, _ = run(
        "fit", plant / "healthy.csv", "-o", path, "--diagnoser", "detector"
    )
    assert code == 0
    assert "Stretches of 8400 samples, 1.05 s at 8000 Hz, 10.5 revolutions" in out
    assert counts(out)["healthy"] == [3, 15]
    assert "from 15 healthy rows; false alarms at speeds that were left out" in out
    return path


def test_an_alarm_by_few_healthy_stretches_is_said_to_be_weak(run, plant):
    (plant / "one.csv").write_text(f"path,rpm,sampling_rate\n600.npy,600,{RATE}\n")
    path = plant / "few.skops"
    assert run("fit", plant / "one.csv", "-o", path, "--diagnoser", "detector")[0] == 0
    _, out, _ = run(
        "diagnose", path, plant / "well.npy", "--rpm", 600, "--sampling-rate", RATE
    )
    assert "rests on fewer than 9 healthy rows" in out
    assert "few to hold" in run("info", path)[1]


@pytest.mark.parametrize(
    ("condition", "options", "kind"),
    [
        ("Normal", (), "detector"),
        ("x", ("--healthy", "x"), "detector"),
        ("worn", (), None),
    ],
)
def test_one_healthy_condition_alone_makes_a_detector(
    run, plant, condition, options, kind
):
    lines = (plant / "healthy.csv").read_text().splitlines()
    rows = [
        f"{line},{condition if number else 'condition'}"
        for number, line in enumerate(lines)
    ]
    (plant / "named.csv").write_text("\n".join(rows))
    path = plant / "named.skops"
    code, _, err = run("fit", plant / "named.csv", "-o", path, *options)
    if kind is None:
        assert code == 1 and "expected two or more" in err
    else:
        assert code == 0 and load_diagnoser(path)[1]["diagnoser"] == kind


def test_one_speed_for_all_files_of_a_folder(run, plant, tmp_path):
    path, options = tmp_path / "d.skops", ("--sampling-rate", RATE, "--rpm", 750)
    command = ("fit", "--diagnoser", "detector", "-o", path, "--force", *options)
    code, _, err = run(*command, plant / "[679]*0.npy")
    assert code == 0 and "rpm is not given" not in err
    assert load_diagnoser(path)[1]["train_rpm"] == [750.0]
    code, _, err = run(*command[:-4], "--rpm", 750, plant / "healthy.csv")
    assert code == 2 and "argument --rpm: no effect, because each line of" in err


def test_recordings_at_a_speed_between_are_distinguished(run, plant, model):
    detector, facts = load_diagnoser(model)
    assert facts["window_length"] == 8400
    np.testing.assert_allclose(detector[-1].speeds_, SPEEDS)
    output = plant / "v.csv"
    code, out, _ = run("diagnose", model, "--table", plant / "new.csv", "-o", output)
    rows = pd.read_csv(output)
    assert code == 0 and rows["verdict"].tolist() == ["healthy", "changed"]
    assert rows["alarm"].tolist() == ["no", "yes"] and "of 8400 samples" in out


def test_the_alarm_of_a_running_sensor(run, plant, model, piped):
    arguments = ("--rpm", 680, "--sampling-rate", RATE)
    alarms = {}
    for name in ("well", "worn"):
        piped(lines_of(np.load(plant / f"{name}.npy")))
        code, out, err = run("watch", model, "-", *arguments)
        found = [json.loads(line) for line in out.splitlines()]
        assert code == 0 and len(found) == 3, err
        alarms[name] = found[-1]["alarm_level"]
    assert alarms["well"] < 0.1 < alarms["worn"]


def test_the_alarm_takes_the_limits_that_fit_saved(run, plant, piped):
    lines = ["path,condition,rpm,sampling_rate"]
    lines += [f"{rpm}.npy,healthy,{rpm},{RATE}" for rpm in SPEEDS]
    for condition, order in ORDERS.items():
        signal = healthy(750, 3, 6 * RATE) + strikes(order, 750, 4, 6 * RATE)
        np.save(plant / f"{condition}.npy", signal)
        lines.append(f"{condition}.npy,{condition},750,{RATE}")
    (plant / "faults.csv").write_text("\n".join(lines))
    bearing = plant / "bearing.skops"
    assert run("fit", plant / "faults.csv", "-o", bearing)[0] == 0
    last = {}
    for name in ("outer", "750"):
        piped(lines_of(np.load(plant / f"{name}.npy")[: 3 * RATE]))
        code, out, err = run("watch", bearing, "-", "--rpm", 750)
        last[name] = json.loads(out.splitlines()[-1])
        assert code == 0 and "Healthy: healthy" in err
    assert [last[name]["verdict"] for name in last] == ["outer", "healthy"]
    # One stretch more is a part of the way to an alarm; a well bearing makes none.
    assert last["outer"]["alarm_level"] > 0.1 > 0.01 > last["750"]["alarm_level"]
    assert last["outer"]["p_value"] < 0.01 < last["750"]["p_value"]


@pytest.mark.slow
def test_a_fixed_gain_makes_the_level_count(run, plant):
    np.save(plant / "loud.npy", 5 * np.load(plant / "well.npy"))
    path, facts = plant / "level.skops", ("--rpm", 680, "--sampling-rate", RATE)
    for options, verdict in (((), "healthy"), (("--fixed-gain",), "changed")):
        fit = ("fit", plant / "healthy.csv", "-o", path, "--diagnoser", "detector")
        assert run(*fit, *options)[0] == 0
        code, out, err = run("diagnose", path, plant / "loud.npy", *facts)
        assert code == 0 and f" {verdict} " in out, err


@pytest.mark.parametrize("options", [("--window-length", 4800), ("--max-windows", 5)])
def test_options_that_cut_choose_windows(run, plant, options):
    path = plant / "cut.skops"
    arguments = ("fit", plant / "healthy.csv", "-o", path, "--diagnoser", "detector")
    code, out, _ = run(*arguments, *options)
    assert code == 0 and "Windows of 4800 samples" in out and "Stretches" not in out


def test_short_recordings_are_cut_into_windows(run, plant):
    lines = ["path,rpm,sampling_rate"]
    # Ten turns take two seconds at 300 rpm, which 1.2 s cannot hold twice, not even
    # half of it.
    for rpm in (300, 330):
        np.save(plant / f"short_{rpm}.npy", healthy(rpm, 0, 9_700))
        lines.append(f"short_{rpm}.npy,{rpm},{RATE}")
    (plant / "short.csv").write_text("\n".join(lines))
    path = plant / "short.skops"
    code, out, _ = run(
        "fit", plant / "short.csv", "-o", path, "--diagnoser", "detector"
    )
    assert code == 0
    assert "Windows of 4800 samples" in out
    assert counts(out)["healthy"] == [2, 4]
