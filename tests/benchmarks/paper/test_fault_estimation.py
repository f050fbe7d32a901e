from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from benchmarks.paper.fault_estimation import command as fault_estimation
from benchmarks.paper.fault_estimation import metrics, signals

ROOT = Path(__file__).parents[3]
N_SAMPLES = 2 * signals.WINDOW_LENGTH


@pytest.fixture(scope="module")
def healthy():
    return signals.identified(1001, N_SAMPLES)


@pytest.fixture(scope="module")
def rig():
    return signals.recordings(1, N_SAMPLES)


@pytest.mark.parametrize("lag", [-7, 0, 1, 40])
def test_known_delay_is_found_and_taken_out(lag):
    true = np.random.default_rng(0).normal(size=(3, 500))
    estimate = np.roll(true, lag, axis=1)
    delay, correlation = metrics.delay(2 * estimate + 5, true)
    assert delay == lag
    assert correlation == pytest.approx(1 - abs(lag) / 500, abs=0.03)
    moved, kept = metrics.aligned(estimate, true, delay)
    assert moved.shape == (3, 500 - abs(lag))
    np.testing.assert_array_equal(moved, kept)


def test_known_bias_and_error():
    true = np.random.default_rng(0).normal(size=(3, 500))
    size = np.sqrt(np.mean(true**2))
    assert metrics.bias(true - 0.25 * size, true) == pytest.approx(-0.25)
    assert metrics.normalised_error(true - 0.25 * size, true) == pytest.approx(0.25)
    assert metrics.normalised_error(1.5 * true, true) == pytest.approx(0.5)


def test_settling_counts_from_the_onset_to_the_last_sample_outside():
    path = np.array([9.0, 9.0, 0.0, 2.0, 0.94, 1.04, 0.96])
    assert metrics.settling_time(path, 1.0, 2) == 3
    assert metrics.settling_time(-path, -1.0, 2) == 3
    assert metrics.settling_time(path, 1.0, 5) == 0
    assert metrics.settling_time(path, 1.0, 5, tolerance=0.03) == 2


def test_disturbance_is_what_drives_the_innovations():
    d = np.random.default_rng(0).normal(size=(2, 100))
    seen = signals.seen_through(0.3, d)
    # By hand: eps(k + 1) = 0.3 eps(k) + d(k) from 0.
    by_hand = np.zeros(100)
    for k in range(99):
        by_hand[k + 1] = 0.3 * by_hand[k] + d[0, k]
    np.testing.assert_allclose(seen[0], by_hand, atol=1e-12)
    np.testing.assert_allclose(signals.disturbance(seen, 0.3), d[:, :-1], atol=1e-12)


@pytest.mark.parametrize("shape", signals.SHAPES)
def test_synthetic_fault_has_its_shape(healthy, rig, shape):
    fault = signals.synthetic_fault(healthy, rig, shape)
    quiet = healthy.innovations(rig.data[rig.target == "Normal"])
    true = fault.true[0]
    ends = {"constant": (1, 1), "step": (0, 1), "ramp": (0, 1), "impact": (0, 0)}[shape]
    np.testing.assert_allclose(true[[0, -1]], ends, atol=2e-3)
    if shape == "step":
        middle = len(true) - signals.WINDOW_LENGTH // 2
        assert np.flatnonzero(true > 0.5)[0] == middle + 1
    # In the innovations the fault is added as it is.
    added = signals.disturbance(fault.innovations - quiet)
    np.testing.assert_allclose(added, fault.true, atol=1e-9)


def test_tables_of_all_observers_and_faults(tmp_path, capsys):
    pytest.importorskip("matplotlib")
    names = {"observers": 4, "synthetic": 4 * 4, "bearing": 2 * 3 * 4, "gains": 6 * 2}
    output = tmp_path / "out"
    arguments = ["--seed", "1", "--n-samples", str(N_SAMPLES), "--output", str(output)]
    fault_estimation.main(arguments)
    assert "| 6 | OR | linear, dead-beat |" in capsys.readouterr().out
    frames = {name: pd.read_csv(output / f"{name}.csv") for name in names}
    assert {name: len(frame) for name, frame in frames.items()} == names
    synthetic = frames["synthetic"].set_index(["fault", "observer"])
    assert synthetic.loc["constant", "bias"].abs().max() < 0.01
    centred = synthetic["bias, centred windows"]
    np.testing.assert_allclose(centred["constant"], -1, atol=0.02)
    np.testing.assert_allclose(centred["step"], -0.5, atol=0.02)
    # The estimate of impacts is no better than none at all, at any gain.
    assert frames["bearing"].error.min() > 1
    assert frames["gains"].settling.notna().all()
