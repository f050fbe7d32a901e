import numpy as np
import pandas as pd
import pytest

from benchmarks.detection import rates, runs, unknown
from benchmarks.detection.detectors import one_class_svm, peer
from tests.benchmarks.speed_rig import LENGTH, moving_rig


def row_rig():
    rig = moving_rig(n_windows=60, gain_of_fault=1.0, level=lambda speed: 1.0)
    rig.sampling_rate = 1000.0
    return rig


def only_svm(fixed_gain, *, peers):
    return {
        "make_detector": lambda rate, X, rpm: rates.ours(
            rate, X, rpm, fixed_gain=fixed_gain
        ),
        "svm": lambda rate, X, rpm: peer(
            rate, X, rpm, fixed_gain=fixed_gain, make=one_class_svm
        ),
    }


@pytest.fixture(scope="module")
def found():
    original, rates.methods = rates.methods, only_svm
    try:
        return rates.detection_rates(row_rig(), LENGTH, fixed_gain=False)
    finally:
        rates.methods = original


def test_every_split_is_measured(found):
    counts = found.groupby(["detector", "stated", "split"]).size()
    # Two speeds and two conditions: each speed tested once in every split.
    assert counts.eq(4).all() and len(counts) == 2 * 2 * 3
    left_out = found[found["split"] == "left out"]
    assert (left_out["calibrated at"] != left_out["rpm"].map("{:g}".format)).all()
    assert found["healthy rows"].isin([30, 60]).all()
    assert found["flagged"].between(0, 1).all()


def test_tables(found):
    table = rates.rates_table(found.assign(rig="r", row="400"))
    assert table.count("| r | 400 |") == 2
    assert "*left out*: healthy rows of all other speeds" in table
    assert "bad " in rates.family_table(found.assign(rig="r", row="400"))
    assert "| ms a second of signal |" in rates.cost_table(
        found.assign(rig="r", row="400")
    )


def test_threshold_of_a_peer_holds_the_rate_on_its_own_rows():
    X = np.random.default_rng(0).normal(size=(99, 300))
    for rate in (0.05, 0.1):
        score = peer(rate, X, None, fixed_gain=True, make=one_class_svm)
        assert np.sum(score(X, None) < 0) == round(100 * rate) - 1


def test_alarm_times_of_runs(tmp_path, capsys):
    rng = np.random.default_rng(0)
    for name in ("a", "b"):
        signal = rng.normal(size=(200, 2, 600))
        signal[180:, 0] *= 20
        path = tmp_path / "femto" / f"{name}.npz"
        path.parent.mkdir(exist_ok=True)
        np.savez(path, acceleration_g=signal, seconds=60.0 * np.arange(200), rpm=1000)
    figure = tmp_path / "runs.svg"
    options = ["--data-home", str(tmp_path), "--output", str(tmp_path / "out")]
    runs.main([*options, "--figure", str(figure)])
    assert "minutes before the end of the run" in figure.read_text()
    assert "Runs to failure of the PRONOSTIA test bench" in capsys.readouterr().out
    found = pd.read_csv(tmp_path / "out" / "runs.csv")
    assert len(found) == 8
    alarm = found.groupby("level counts")["first alarm, minutes before the end"]
    # Three rows after the change, or sooner where one before it was flagged by chance.
    assert set(alarm.get_group("yes")) <= {17, 18, 19}
    assert alarm.get_group("no").isna().all()


def test_alarm_needs_three_of_five():
    assert runs.first_alarm(np.array([1, 0, 1, 0, 0, 1, 1, 1], dtype=bool)) == 6
    assert runs.first_alarm(np.array([1, 1, 1], dtype=bool)) == 2
    assert runs.first_alarm(np.zeros(9, dtype=bool)) is None


@pytest.mark.slow
def test_what_is_not_known_is_rejected_at_the_training_speed():
    foreign = np.cumsum(np.random.default_rng(0).normal(size=(30, LENGTH)), axis=1)
    rates, kinds = unknown.rejection_rates(row_rig(), LENGTH, foreign)
    assert len(rates) == len(unknown.RATES) * 3 * 2 * 2
    own = rates[(rates["split"] == "training speed") & (rates["stated"] == 0.05)]
    assert own["unknown rejected"].mean() > 0.9 > 0.1 > own["known rejected"].mean()
    assert (own["auc"] > 0.9).all()
    printed = unknown.table(rates.assign(rig="r", row="400"))
    assert printed.count("| r | 400 | rows of ") == 3
    assert set(kinds["kind"]) == {"white noise", "sine", "ramp", "other rig"}
    own = kinds[(kinds["split"] == "training speed") & (kinds["stated"] == 0.05)]
    assert own.groupby("kind")["rejected"].mean().min() > 0.9
    assert (
        unknown.kinds_table(kinds.assign(rig="r", row="400")).count(
            "| r | 400 | rows of "
        )
        == 3
    )
