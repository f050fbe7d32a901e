"""A detector from a table of healthy recordings, in diagnose and in watch."""

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter
from sklearn.base import BaseEstimator

from skarxlag.persistence.models import load_diagnoser
from skarxlag.plant.commands.fit import error_rates
from skarxlag.plant.commands.training_rows import TrainingRows

from ...impacts import ORDERS, RATE, strikes
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
    ("condition", "options"), [("Normal", ()), ("x", ("--healthy", "x"))]
)
def test_one_healthy_condition_alone_makes_a_detector(run, plant, condition, options):
    table = pd.read_csv(plant / "healthy.csv").assign(condition=condition)
    table.to_csv(plant / "named.csv", index=False)
    path = plant / "named.skops"
    assert run("fit", plant / "named.csv", "-o", path, *options)[0] == 0
    assert load_diagnoser(path)[1]["diagnoser"] == "detector"


@pytest.mark.slow
def test_a_fixed_gain_makes_the_level_count(run, plant):
    np.save(plant / "loud.npy", 5 * np.load(plant / "well.npy"))
    path, facts = plant / "level.skops", ("--rpm", 680, "--sampling-rate", RATE)
    for options, verdict in (((), "healthy"), (("--fixed-gain",), "changed")):
        fit = ("fit", plant / "healthy.csv", "-o", path, "--diagnoser", "detector")
        assert run(*fit, *options)[0] == 0
        code, out, err = run("diagnose", path, plant / "loud.npy", *facts)
        assert code == 0 and f" {verdict} " in out, err


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


class Highest(BaseEstimator):
    """Detector whose limit is the largest sample that it has learned."""

    def fit(self, X):
        self.limit_ = X.max()
        return self

    def predict(self, X):
        return np.where(X[:, 0] > self.limit_, -1, 1)


def test_false_alarms_and_missed_faults_are_counted_on_other_rows():
    # Of each recording, the last fifth exceeds what was before; of the faults, two do.
    X = np.array([*range(10), *range(10), 5, 100, 200])[:, np.newaxis]
    recording = ["a"] * 10 + ["b"] * 10 + ["worn"] * 3
    condition = ["good"] * 20 + ["worn"] * 3
    facts = pd.DataFrame({"recording": recording, "condition": condition})
    rows = TrainingRows(X, facts, None, "windows", 1.0, (), ())
    assert error_rates(Highest(), rows, "good") == [
        "False alarms: 4 of 20 healthy windows exceed limits that were learned without "
        "this part of their recordings.",
        "Missed faults: 1 of 3 windows of recorded faults are within the healthy limits.",
    ]
