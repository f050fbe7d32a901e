"""False alarms, missed faults and rejected conditions."""

import numpy as np
import pandas as pd
import pytest

from benchmarks.detection import rates, runs, unknown
from benchmarks.detection.detectors import one_class_svm, peer
from tests.benchmarks.speed_rig import LENGTH, moving_rig


@pytest.fixture(scope="module")
def rig():
    rig = moving_rig(n_windows=60, gain_of_fault=1.0, level=lambda speed: 1.0)
    rig.sampling_rate = 1000.0
    return rig


def test_every_split_is_measured(rig):
    frame = rates.detection_rates(rig, LENGTH, fixed_gain=False, peers=False)
    counts = frame.groupby(["detector", "stated", "split"]).size()
    # Two speeds and two conditions: each speed tested once in every split.
    assert counts.eq(4).all() and len(counts) == 2 * 3
    left_out = frame[frame["split"] == "left out"]
    assert (left_out["calibrated at"] != left_out["rpm"].map("{:g}".format)).all()
    assert frame["healthy rows"].isin([30, 60]).all()
    table = rates.rates_table(frame.assign(rig="r", row="400"))
    flagged = frame[(frame["split"] == "same") & (frame["stated"] == 0.05)]
    shares = flagged.groupby("condition")["flagged"].mean()
    assert shares["bad"] > 0.9 > 0.2 > shares["ok"]
    assert f"{100 * (1 - shares['bad']):.0f}" in table


@pytest.mark.parametrize("rate", [0.05, 0.1])
def test_threshold_of_a_peer_holds_the_rate_on_its_training_rows(rate):
    X = np.random.default_rng(0).normal(size=(99, 300))
    score = peer(rate, X, None, fixed_gain=True, make=one_class_svm)
    assert np.sum(score(X, None) < 0) == round(100 * rate) - 1


def test_alarm_times_of_runs(tmp_path, capsys):
    rng = np.random.default_rng(0)
    (tmp_path / "femto").mkdir()
    for name in ("a", "b"):
        signal = rng.normal(size=(200, 2, 600))
        signal[180:, 0] *= 20
        path = tmp_path / "femto" / f"{name}.npz"
        np.savez(path, acceleration_g=signal, seconds=60.0 * np.arange(200), rpm=1000)
    output = tmp_path / "out"
    runs.main(["--data-home", str(tmp_path), "--output", str(output)])
    assert "Runs to failure of the PRONOSTIA test bench" in capsys.readouterr().out
    frame = pd.read_csv(output / "runs.csv")
    assert len(frame) == 8
    alarm = frame.groupby("level counts")["first alarm, minutes before the end"]
    # Three rows after the change, or sooner where one before it was flagged by chance.
    assert set(alarm.get_group("yes")) <= {17, 18, 19}
    assert alarm.get_group("no").isna().all()


@pytest.mark.parametrize(
    ("flagged", "first"),
    [([1, 0, 1, 0, 0, 1, 1, 1], 6), ([1, 1, 1], 2), ([0] * 9, None)],
)
def test_alarm_needs_three_of_five(flagged, first):
    assert runs.first_alarm(np.array(flagged, dtype=bool)) == first


@pytest.mark.slow
def test_an_unknown_condition_is_rejected_at_the_training_speed(rig):
    foreign = np.cumsum(np.random.default_rng(0).normal(size=(30, LENGTH)), axis=1)
    conditions, kinds = unknown.rejection_rates(rig, LENGTH, foreign)
    assert len(conditions) == len(unknown.RATES) * 3 * 2 * 2
    conditions, kinds = (
        frame[(frame["split"] == "training speed") & (frame["stated"] == 0.05)]
        for frame in (conditions, kinds)
    )
    assert conditions["unknown rejected"].mean() > 0.9
    assert conditions["known rejected"].mean() < 0.1
    assert (conditions["auc"] > 0.9).all()
    rejected = kinds.groupby("kind")["rejected"].mean()
    assert {*rejected.index} == {"white noise", "sine", "ramp", "other rig"}
    assert rejected.min() > 0.9
