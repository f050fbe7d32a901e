"""fit and diagnose on stretches of recordings, with the speeds that a table states."""

import numpy as np
import pandas as pd
import pytest

from skarxlag.persistence import load_diagnoser

from ..test_orders import ORDERS, RATE, strikes

SECONDS = 4


@pytest.fixture(scope="module")
def workshop(tmp_path_factory):
    """Recordings of 4 s of two conditions at two speeds, and tables of each speed."""
    folder = tmp_path_factory.mktemp("workshop")
    for rpm in (900, 600):
        rows = []
        for number, (condition, order) in enumerate(ORDERS.items()):
            name = f"{condition}_{rpm}.npy"
            np.save(folder / name, strikes(order, rpm, [number, rpm], SECONDS * RATE))
            rows.append((name, condition, rpm, RATE))
        columns = ["path", "condition", "rpm", "sampling_rate"]
        pd.DataFrame(rows, columns=columns).to_csv(folder / f"{rpm}.csv", index=False)
    return folder


def test_long_recordings_are_compared_by_stretches_and_speeds(run, workshop):
    model = workshop / "bearing.skops"
    code, out, err = run("fit", workshop / "900.csv", "-o", model)
    assert code == 0 and "8 stretches: fitting" in err
    assert "Stretches of 7200 samples, 0.9 s at 8000 Hz, 13.5 turns at 900 rpm" in out
    assert "inner: 1 recordings, 4 stretches" in out and "Saved stretches to" in out
    diagnoser, facts = load_diagnoser(model)
    assert facts["window_length"] == 7200 and facts["diagnoser"] == "stretches"
    assert diagnoser["compare"].order_residual_.samples_a_turn_ == pytest.approx(60 * RATE / 900)
    code, out, _ = run("diagnose", model, "--table", workshop / "600.csv", "-o", workshop / "v.csv")
    assert code == 0 and "stretches of 7200 samples, 0.9 s, at 8000 Hz" in out
    assert "Verdicts rest on the orders of the shaft at the speeds above" in out
    verdicts = pd.read_csv(workshop / "v.csv")
    assert verdicts["verdict"].tolist() == list(ORDERS) and verdicts["rpm"].tolist() == [600, 600]
    by_hand = diagnoser.predict_proba(
        np.load(workshop / "inner_600.npy")[: 4 * 7200].reshape(4, -1), rpm=600
    )
    windows = pd.read_csv(workshop / "v_windows.csv")
    np.testing.assert_allclose(windows["probability of inner"][:4], by_hand[:, 0])


def test_a_speed_may_be_unknown(run, workshop):
    model = workshop / "bearing.skops"
    run("fit", workshop / "900.csv", "-o", model)
    recording = workshop / "outer_600.npy"
    code, out, _ = run("diagnose", model, recording, "--sampling-rate", RATE)
    assert code == 0 and "1 of 1 recordings state no speed (column rpm, --rpm)" in out
    code, out, _ = run("diagnose", model, recording, "--sampling-rate", RATE, "--rpm", "600")
    assert code == 0 and "outer" in out and "no speed" not in out
    table = pd.read_csv(workshop / "900.csv").drop(columns="rpm")
    table.to_csv(workshop / "unknown.csv", index=False)
    code, out, _ = run("fit", workshop / "unknown.csv", "-o", model)
    assert code == 0 and "the table states no speed: the pattern of strikes is used" in out
    code, out, _ = run("diagnose", model, "--table", workshop / "600.csv")
    assert code == 0 and "stretches of 7200 samples" in out and "Verdicts rest" not in out


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (("--window-length", "1200"), "Windows of 1200 samples, 0.15 s at 8000 Hz"),
        (("--diagnoser", "alpio"), "Windows of 1200 samples, 0.15 s at 8000 Hz"),
        (("--diagnoser", "stretches", "--window-length", "16000"), "Stretches of 16000 samples"),
    ],
)
def test_options_that_say_otherwise(run, workshop, options, expected):
    code, out, _ = run("fit", workshop / "900.csv", "-o", workshop / "other.skops", *options)
    assert code == 0 and expected in out


def test_short_recordings_are_compared_by_windows(run, workshop):
    lines = ["path,condition,rpm,sampling_rate"]
    for condition in ORDERS:
        np.save(
            workshop / f"short_{condition}.npy", np.load(workshop / f"{condition}_900.npy")[:6000]
        )
        lines.append(f"short_{condition}.npy,{condition},900,{RATE}")
    (workshop / "short.csv").write_text("\n".join(lines))
    code, out, _ = run("fit", workshop / "short.csv", "-o", workshop / "short.skops")
    assert code == 0 and "Windows of 1200 samples" in out and "Saved diagnoser to" in out
    code, _, err = run(
        "fit", workshop / "short.csv", "-o", workshop / "no.skops", "--diagnoser", "stretches"
    )
    assert code == 1 and "shortest recording is too short for two stretches" in err
