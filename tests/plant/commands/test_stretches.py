"""fit and diagnose on stretches of recordings, with the speeds that a table states."""

import numpy as np
import pandas as pd
import pytest

from skarxlag import make_diagnoser
from skarxlag.persistence.models import load_diagnoser
from skarxlag.plant.commands import main

from ...impacts import ORDERS, RATE, strikes
from .conftest import counts

SECONDS = 4
HEALTHY = ("--healthy", "inner")


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


@pytest.fixture(scope="module")
def model(workshop):
    """A saved diagnoser of stretches."""
    path = workshop / "drawn.skops"
    assert main(["fit", str(workshop / "900.csv"), *HEALTHY, "-o", str(path)]) == 0
    return path


def test_long_recordings_are_compared_by_stretches_and_speeds(run, workshop):
    model = workshop / "bearing.skops"
    code, out, err = run("fit", workshop / "900.csv", *HEALTHY, "-o", model)
    assert code == 0 and "8 stretches: fitting" in err
    # Each recording is read once.
    assert err.count(" windows of 1200 samples") == 2
    assert (
        "Stretches of 7200 samples, 0.9 s at 8000 Hz, 13.5 revolutions at 900 rpm"
        in out
    )
    assert counts(out)["inner"] == [1, 4] and "Saved stretches to" in out
    diagnoser, facts = load_diagnoser(model)
    assert facts["window_length"] == 7200 and facts["diagnoser"] == "stretches"
    assert "train rpm             900 rpm" in run("info", model)[1]
    # The number of threads belongs to the machine, not to the file.
    assert diagnoser["decide"].residual_.order_residual_.n_jobs is None
    code, out, _ = run(
        "diagnose", model, "--table", workshop / "600.csv", "-o", workshop / "v.csv"
    )
    assert code == 0 and "stretches of 7200 samples, 0.9 s at 8000 Hz" in out
    verdicts = pd.read_csv(workshop / "v.csv")
    assert verdicts["verdict"].tolist() == list(ORDERS)
    assert verdicts["rpm"].tolist() == [600, 600]


@pytest.mark.slow
def test_a_speed_may_be_unknown(run, workshop, model):
    recording = workshop / "outer_600.npy"
    code, out, _ = run("diagnose", model, recording, "--sampling-rate", RATE)
    assert code == 0
    assert "The speed is not stated. Speeds near those of fit were searched." in out
    code, out, _ = run(
        "diagnose", model, recording, "--sampling-rate", RATE, "--rpm", "600"
    )
    assert code == 0 and "outer" in out and "not stated" not in out


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (("--window-length", "1200"), "Windows of 1200 samples, 0.15 s at 8000 Hz"),
        (("--diagnoser", "diagnoser"), "Windows of 1200 samples, 0.15 s at 8000 Hz"),
        (
            ("--diagnoser", "stretches", "--window-length", "16000"),
            "Stretches of 16000 samples",
        ),
    ],
)
def test_options_that_say_otherwise(run, workshop, options, expected):
    code, out, _ = run(
        "fit", workshop / "900.csv", *HEALTHY, "-o", workshop / "other.skops", *options
    )
    assert code == 0 and expected in out


@pytest.mark.slow
def test_more_than_memory_shall_hold_is_sampled(run, workshop, monkeypatch):
    """By stretches and by windows, as the options say and as they do not."""
    fit = ("fit", workshop / "900.csv", *HEALTHY, "-o", workshop / "sampled.skops")
    # Two recordings of 4 stretches of 7200 samples, or of 26 windows of 1200.
    monkeypatch.setattr("skarxlag.plant.commands.training_rows.MOST_SAMPLES", 4 * 7200)
    code, out, err = run(*fit)
    assert code == 0 and counts(out)["inner"] == [1, 2]
    assert "; at most 2 windows of each, fewer than there are in 2" in out
    assert "[1/2] inner_900.npy: 26 windows of 1200 samples" in err
    assert "[2/2] outer_900.npy: 4 windows of 7200 samples" in err
    assert "4 stretches: fitting" in err
    stretches = load_diagnoser(workshop / "sampled.skops")[0]
    X = [
        np.load(workshop / f"{name}_900.npy")[: 4 * 7200].reshape(4, -1)[::2]
        for name in ORDERS
    ]
    y = np.repeat(list(ORDERS), 2)
    by_hand = make_diagnoser(sampling_rate=RATE, healthy="inner")
    by_hand.fit(np.concatenate(X), y, rpm=np.full(4, 900.0))
    np.testing.assert_array_equal(
        stretches.predict_proba(X[0], rpm=900), by_hand.predict_proba(X[0], rpm=900)
    )
    code, out, err = run(*fit, "--diagnoser", "diagnoser", "-q")
    assert code == 0 and counts(out)["inner"] == [1, 7] and err == ""
    assert "at most 12 windows of each, fewer than there are in 2" in out


def test_short_recordings_are_compared_by_windows(run, workshop):
    lines = ["path,condition,rpm,sampling_rate"]
    for condition in ORDERS:
        np.save(
            workshop / f"short_{condition}.npy",
            np.load(workshop / f"{condition}_900.npy")[:6000],
        )
        lines.append(f"short_{condition}.npy,{condition},900,{RATE}")
    (workshop / "short.csv").write_text("\n".join(lines))
    code, out, _ = run(
        "fit", workshop / "short.csv", *HEALTHY, "-o", workshop / "short.skops"
    )
    assert code == 0
    assert "Windows of 1200 samples" in out
    assert "Saved diagnoser to" in out
    arguments = ("fit", workshop / "short.csv", *HEALTHY, "-o", workshop / "no.skops")
    arguments += ("--diagnoser", "stretches")
    code, _, err = run(*arguments)
    assert code == 1 and "shortest recording is too short for two stretches" in err


@pytest.mark.slow
def test_report_draws_orders_and_marks_the_faults_of_a_bearing(run, workshop, model):
    output, bearing = workshop / "report.html", "9,7.94,39.04"
    options = ("--table", workshop / "600.csv", "-o", output, "--bearing", bearing)
    code, _, err = run("diagnose", model, *options)
    assert code == 0, err
    page = output.read_text()
    # Order spectra, with the learned one of the verdict and that of healthy bearings.
    for condition in ORDERS:
        assert f"{condition}: residual" in page
    assert "nominal 600 rpm" in page and f"lines of bearing {bearing}<" in page
