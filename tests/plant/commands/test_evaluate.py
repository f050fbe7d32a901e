"""Comparison of diagnosers on rigs, and on the recordings of a table."""

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter

from skarxlag import make_diagnoser
from skarxlag.datasets import simulate_rig
from skarxlag.plant.commands import evaluate
from skarxlag.plant.readers.listing import list_recordings

TINY = ("evaluate", "--n-samples", "2400", "--window-length", "400")
RATE, N = 8_000, 16_000


def test_the_simulated_rig_in_a_few_lines(run, tmp_path):
    code, out, err = run(*TINY, "--output", tmp_path)
    assert code == 0 and "[6/6] make_diagnoser, recommended" in err
    lines = out.splitlines()
    speeds = "300, 400, 450, 500 rpm, trained at 500 rpm."
    assert lines[0] == f"Simulated rig, crack 3 mm: 8 conditions at {speeds}"
    assert lines[1] == (
        "A row has 400 samples, 1.6 ms, so 1 % of false alarms are 2.25e+04 an hour. "
        "Chance is 12.5 %."
    )
    assert len(lines) <= 22
    assert "Results on a simulated rig are no evidence about a real machine." in lines
    assert (tmp_path / "report.txt").read_text().splitlines() == lines[:-1]
    summary = pd.read_csv(tmp_path / "simulated_rig_crack_3_mm_summary.csv")
    columns = ["condition", "location", "recordings", "false alarms", "missed"]
    for row in summary.to_dict("records"):
        printed = next(line for line in lines if line.startswith(row["estimator"]))
        assert printed.split()[-5:] == [f"{row[name]:.1f}" for name in columns]


def test_verdicts_are_those_of_the_diagnosers(run, tmp_path):
    assert run(*TINY, "--output", tmp_path, "-q")[0] == 0
    rig = simulate_rig(crack_mm=3, n_samples=2400, window_length=400)
    train = (rig.start < 1200) & (rig.rpm == 500)
    other = (rig.start >= 1200) & (rig.rpm != 500)
    verdicts = pd.read_csv(tmp_path / "simulated_rig_crack_3_mm_verdicts.csv")
    of_ours = verdicts[verdicts["estimator"] == evaluate.RECOMMENDED]
    ours = make_diagnoser(healthy="Normal")
    ours.fit(rig.data[train], rig.target[train], rpm=rig.rpm[train])
    expected = ours.predict(rig.data[other], rpm=rig.rpm[other])
    assert of_ours["row"].tolist() == np.flatnonzero(other).tolist()
    assert of_ours["predicted"].tolist() == expected.tolist()


@pytest.fixture
def public(monkeypatch):
    """Return the arguments of `load_public_rig`, which returns a simulated rig."""
    asked = {"n_windows": 8}

    def load(name, **options):
        asked.update(options, name=name)
        n_samples = 400 * asked["n_windows"]
        return simulate_rig(n_samples=n_samples, window_length=400, as_frame=True)

    monkeypatch.setattr(evaluate, "load_public_rig", load)
    return asked


@pytest.mark.slow
def test_a_public_rig_is_trained_at_every_speed(run, tmp_path, public):
    choice = ("--channel", "DE", "--where", "fs == 12000", "--data-home", tmp_path)
    options = ("--dataset", "cwru", *choice, "--output", tmp_path / "out")
    code, out, _ = run("evaluate", *options)
    assert code == 0 and "simulated" not in out.lower()
    expected = {"name": "cwru", "channel": "DE", "where": "fs == 12000"}
    assert (expected | {"root": tmp_path}).items() <= public.items()
    speeds = "300, 400, 450, 500 rpm"
    assert f"Data set cwru: 8 conditions at {speeds}, trained at {speeds}." in out
    verdicts = pd.read_csv(tmp_path / "out" / "data_set_cwru_verdicts.csv")
    assert (verdicts["train_rpm"] != verdicts["rpm"]).all()
    is_right = verdicts["true_location"] == verdicts["location"]
    shares = (
        100 * is_right.groupby([verdicts["protocol"], verdicts["estimator"]]).mean()
    )
    shares = shares.groupby("estimator").mean()
    leads = f"Here, {shares.idxmax()} is right more often than {evaluate.RECOMMENDED}."
    assert (leads in out) == (shares.max() > shares[evaluate.RECOMMENDED] + 1)


def test_a_public_rig_of_short_recordings_is_refused(run, tmp_path, public):
    public["n_windows"] = 1
    code, _, err = run("evaluate", "--dataset", "mini", "--output", tmp_path)
    assert code == 2 and "argument --window-length: 400, expected at most half" in err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("--rpm 900", "rpm: needs a table"),
        ("--outputs 2", "outputs: needs a table"),
        ("--data-home x", "data-home: needs --dataset"),
        ("--dataset cwru", "n-samples: belongs to the simulated rig"),
        ("table.csv", "n-samples: not allowed with a table"),
    ],
)
def test_wrong_arguments_are_named_and_leave_no_folder(
    run, tmp_path, arguments, message
):
    output = ("--output", tmp_path / "new" / "folder")
    command = ("evaluate", "--n-samples", "2400", *output)
    code, out, err = run(*command, *arguments.split())
    assert code == 2 and not out
    assert f"argument --{message}" in err and "Traceback" not in err
    assert not (tmp_path / "new").exists()


@pytest.fixture(scope="module")
def workshop(tmp_path_factory):
    """Recordings of three bearings at three speeds in two campaigns, and their table."""
    folder, rows = tmp_path_factory.mktemp("own"), []
    poles = {"good": 0.2, "inner1": 0.8, "inner2": 0.7, "outer": -0.8}
    for number, (name, pole) in enumerate(poles.items()):
        for rpm in (600, 900, 1200):
            for campaign in "ab":
                path = f"{name}_{rpm}_{campaign}.npy"
                rng = np.random.default_rng([number, rpm, ord(campaign)])
                np.save(folder / path, lfilter([1], [1, -pole], rng.normal(size=N)))
                condition = name.rstrip("12")
                rows.append((path, condition, name, rpm, RATE, campaign))
    columns = ["path", "condition", "specimen", "rpm", "sampling_rate", "campaign"]
    table = pd.DataFrame(rows, columns=columns)
    table.to_csv(folder / "campaigns.csv", index=False)
    table.drop(columns="campaign").to_csv(folder / "table.csv", index=False)
    return folder


def test_own_recordings_are_evaluated_as_fit_would_train(run, workshop):
    output = workshop / "results"
    arguments = ("evaluate", workshop / "campaigns.csv", "--window-length", 1200)
    code, out, err = run(*arguments, "--output", output, "-q")
    assert code == 0, err
    assert "3 conditions at 600, 900, 1200 rpm, trained at 600, 900, 1200 rpm." in out
    assert "no column campaign" not in out
    assert "Another bearing: not measured for healthy, outer, because too few" in out
    assert "Another load: not measured, because no load is stated." in out
    assert "another bearing and speed" in out and "Here, " not in out
    verdicts = pd.read_csv(output / "campaigns_verdicts.csv")
    assert set(verdicts["estimator"]) == {evaluate.RECOMMENDED, evaluate.PEER}
    protocols = {"speed", "speeds", "bearing", "bearing and speed"}
    assert set(verdicts["protocol"]) == protocols


def test_with_a_bearing_the_combs_decide_too(workshop):
    recordings = list_recordings(workshop / "table.csv")
    case = evaluate.table_case(workshop / "table.csv", recordings, bearing="6205")
    ours = case.methods[evaluate.RECOMMENDED]
    params = ours.get_params()
    assert "no column campaign" in case.sentences[0]
    assert params["decide__bearing"] == "6205"
    assert params["decide__sampling_rate"] == RATE
    # A quarter of the shortest recording and less is no row of fit.
    assert case.X.shape[-1] == 4800


def test_a_table_that_cannot_be_evaluated_is_named(run, workshop):
    table = pd.read_csv(workshop / "table.csv")
    is_slow = table["rpm"] == 600
    for frame, message in [
        (table.drop(columns="rpm"), "needs the columns condition and rpm"),
        (table[table["condition"] == "good"], "conditions good at 600, 900, 1200 rpm"),
        (
            table[is_slow & table["path"].str.contains("good|outer")],
            "at 600 rpm; expected at least two of each",
        ),
    ]:
        frame.to_csv(workshop / "bad.csv", index=False)
        options = ("--window-length", 1200, "--output", workshop / "r")
        code, _, err = run("evaluate", workshop / "bad.csv", *options)
        assert code == 2 and "bad.csv" in err and message in err
