"""fit says which rows it leaves out, and refuses speeds that cannot be true."""

import numpy as np
import pytest

from skarxlag.persistence.models import load_diagnoser

from ...impacts import ORDERS, RATE, strikes
from .conftest import counts

SECONDS = 1.3
COLUMNS = "path,condition,rpm,sampling_rate"


@pytest.fixture
def workshop(tmp_path):
    """Two recordings of 1.3 s of each condition, and their table at 500 rpm."""
    lines = [COLUMNS]
    for number, (condition, order) in enumerate(ORDERS.items()):
        for run in (0, 1):
            name = f"{condition}_{run}.npy"
            signal = strikes(order, 500, [number, run], int(SECONDS * RATE))
            np.save(tmp_path / name, signal)
            lines.append(f"{name},{condition},500,{RATE}")
    (tmp_path / "table.csv").write_text("\n".join(lines))
    return tmp_path


def fit(workshop, *options, table="table.csv"):
    model = workshop / "bearing.skops"
    return ("fit", workshop / table, "--healthy", "inner", "-o", model, *options)


def test_rows_without_a_signal_are_left_out_and_reported(run, workshop):
    windows = ("--window-length", 1000)
    code, out, _ = run(*fit(workshop, *windows))
    assert (
        code == 0 and counts(out)["outer"] == [2, 20] and "without a signal" not in out
    )
    signal = np.load(workshop / "outer_0.npy")
    signal[:3000] = signal[0]
    signal[3000:4000] = signal[3000:4000].clip(-0.05, 0.05)
    np.save(workshop / "outer_0.npy", signal)
    code, out, _ = run(*fit(workshop, *windows))
    assert code == 0 and counts(out) == {"inner": [2, 20], "outer": [2, 16]}
    assert "4 windows left out, without a signal: " in out
    assert "3 constant in outer_0.npy" in out and "1 clipped in outer_0.npy" in out
    facts = load_diagnoser(workshop / "bearing.skops")[1]
    assert facts["n_windows"] == [20, 16]
    # diagnose refuses the same rows.
    recording = workshop / "outer_0.npy"
    model = workshop / "bearing.skops"
    code, out, _ = run(
        "diagnose", model, recording, "--sampling-rate", RATE, "--rpm", 500
    )
    assert code == 0
    assert "4 of 10 windows carry no signal (constant: 3, clipped: 1)" in out


def test_a_condition_without_any_signal_is_an_error(run, workshop):
    for i in (0, 1):
        np.save(workshop / f"outer_{i}.npy", np.full(int(SECONDS * RATE), float(i)))
    code, _, err = run(*fit(workshop, "--window-length", 1000))
    assert code == 1
    assert "table.csv: outer: no signal (constant); check the sensor" in err
    assert not (workshop / "bearing.skops").exists()


@pytest.fixture
def model(run, workshop):
    code, out, _ = run(*fit(workshop))
    assert code == 0 and "0.6 s at 8000 Hz, 5 revolutions at 500 rpm" in out
    assert "Order spectra" not in out
    return workshop / "bearing.skops"


TOO_SLOW = "Order spectra are not compared: 0.6 s are 1.5 revolutions at 150 rpm, and it takes 3."


def test_info_says_at_which_speeds_orders_do_not_count(run, model):
    limit = "no order spectra below 300 rpm: a stretch needs 3 revolutions."
    assert limit in run("info", model)[1]


@pytest.mark.parametrize(("rpm", "is_too_slow"), [(300, False), (150, True)])
def test_it_is_said_at_which_speeds_orders_do_not_count(
    run, workshop, model, piped, rpm, is_too_slow
):
    path = workshop / "outer_0.npy"
    facts = ("--sampling-rate", RATE, "--rpm", rpm)
    code, out, _ = run("diagnose", model, path, *facts)
    assert code == 0 and (TOO_SLOW in out) == is_too_slow
    piped(np.tile(np.load(path), 2).astype("<f8").tobytes())
    code, _, err = run("watch", model, "-", "--dtype", "<f8", *facts)
    assert code == 0 and err.count(TOO_SLOW) == is_too_slow


def test_fit_says_that_its_stretches_are_too_short_for_orders(run, workshop):
    options = ("--diagnoser", "stretches", "--window-length", 2000)
    code, out, _ = run(*fit(workshop, *options))
    assert code == 0
    assert (
        "Note: Order spectra are not compared: 0.25 s are 2.08 revolutions at 500 rpm"
        in out
    )
