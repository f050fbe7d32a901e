"""evaluate on a table of one's own recordings, and on rigs of one channel."""

import re

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter
from sklearn.utils import Bunch

from skarxlag.datasets import FETCHERS, simulate_rig

RATE, N = 8_000, 6_000


@pytest.fixture(scope="module")
def workshop(tmp_path_factory):
    """Recordings of two conditions at three speeds in two campaigns, and their table."""
    folder, rows = tmp_path_factory.mktemp("own"), []
    for number, (condition, pole) in enumerate({"good": 0.2, "worn": 0.8}.items()):
        for rpm in (600, 900, 1200):
            for campaign in "ab":
                name = f"{condition}_{rpm}_{campaign}.npy"
                noise = np.random.default_rng([number, rpm, ord(campaign)]).normal(
                    size=N
                )
                np.save(folder / name, lfilter([1], [1, -pole], noise))
                rows.append((name, condition, rpm, RATE, campaign))
    columns = ["path", "condition", "rpm", "sampling_rate", "campaign"]
    table = pd.DataFrame(rows, columns=columns)
    table.to_csv(folder / "campaigns.csv", index=False)
    table.drop(columns="campaign").to_csv(folder / "table.csv", index=False)
    return folder


@pytest.mark.slow
def test_a_folder_is_evaluated_like_a_table(run, workshop, no_figures):
    options = (
        "--pattern",
        r"(?P<condition>[a-z]+)_(?P<rpm>\d+)",
        "--sampling-rate",
        RATE,
    )
    rows = ("--window-length", 1200, "-q")
    code, out, _ = run(
        "evaluate", workshop / "*.npy", *options, *rows, "--output", workshop / "f"
    )
    assert code == 0, out
    table = workshop / "table.csv"
    _, wanted, _ = run("evaluate", table, *rows, "--output", workshop / "of_table")
    named = out.replace(str(workshop / "*.npy"), str(table))
    assert named.splitlines()[1:-1] == wanted.splitlines()[1:-1]


@pytest.mark.parametrize(
    "arguments",
    [
        ("--pattern", "x"),
        ("--rig", "uestc", "--rpm", 900),
        ("table.csv", "--train-rpm", 900),
    ],
)
def test_options_of_the_other_kind_of_rig_are_refused(run, arguments):
    code, _, err = run("evaluate", *arguments)
    assert code == 2 and f"argument {arguments[-2]}: not allowed with" in err


@pytest.mark.slow
@pytest.mark.parametrize("name", ["table", "campaigns"])
def test_own_recordings_are_evaluated_across_speeds(run, workshop, name):
    output = workshop / f"results_{name}"
    arguments = ("evaluate", workshop / f"{name}.csv", "--window-length", 1200)
    code, out, _ = run(*arguments, "--output", output, "-q")
    assert code == 0, out
    assert (
        "2 conditions (good, worn)\nat 600, 900, 1200 rpm, windows of 1200 samples"
        in out
    )
    # The best shares are marked.
    assert re.search(r"make_diagnoser +\d+ +100\* +100\*", out)
    assert ("No column campaign" in out) == (name == "table")
    report = (output / f"{name}_report.txt").read_text()
    for title in (
        "trained at one speed",
        "trained at all speeds but one",
        "confusion matrix",
    ):
        assert title in report and title not in out
    assert report.startswith(out.split("Drawn as PNG")[0].rstrip())
    # The summary fits on a screen.
    assert len(out.splitlines()) <= 24
    for sentence in (
        "make_diagnoser names the right location in 100 % (another speed) of the windows",
        "Another bearing: not measured, because each location has one specimen.",
        "Another load: not measured, because no load is stated.",
    ):
        assert sentence in out
    verdicts = pd.read_csv(output / f"{name}_verdicts.csv")
    assert set(verdicts["diagnoser"]) == {
        "make_diagnoser", "log spectrum + LDA", "band energies + forest"
    }  # fmt: skip
    inside = verdicts[verdicts["protocol"] == "in"]
    assert (inside["train_rpm"] != inside["test_rpm"]).all()
    outside = verdicts[verdicts["protocol"] == "out"]
    assert outside["train_rpm"].isna().all()
    assert (output / f"{name}.png").stat().st_size > 10_000
    # A confusion matrix counts each recording once, and not once more for the other
    # protocol.
    for title in ("make_diagnoser", "log-spectrum-+-lda"):
        matrix = pd.read_csv(output / f"{name}_confusion_{title}.csv", index_col="true")
        assert matrix.iloc[:2, :2].to_numpy().sum() == 12
    assert re.search(
        "confusion matrix of recordings, .*, trained at all speeds but one", report
    )
    # 12 recordings of 5 windows; one speed in tests each of them twice, one speed out
    # once.
    assert len(outside) == 3 * 60 and len(inside) == 3 * 120
    accuracy = (
        (verdicts["true"] == verdicts["predicted"])
        .groupby(verdicts["diagnoser"])
        .mean()
    )
    assert (accuracy > 0.9).all()
    shown = re.search(
        r"recordings in %, trained at all.*?make_diagnoser(.*?)\n", report, re.S
    )[1]
    assert [float(value) for value in shown.split()] == [100.0] * 4


def test_a_table_that_cannot_be_evaluated_is_named(run, workshop):
    table = pd.read_csv(workshop / "table.csv")
    for frame, message in [
        (table.drop(columns="rpm"), "needs the columns condition and rpm"),
        (
            table[table["rpm"] == 600],
            "2 conditions at 1 speed; expected at least two of each",
        ),
        (table[table["condition"] == "good"], "1 condition at 3 speeds"),
        (
            table.assign(campaign="may"),
            "1 campaign (may); expected at least two, and all cond",
        ),
        (
            table.assign(campaign=table["condition"]),
            "2 campaigns (good, worn); expected at least",
        ),
        (
            table[table["rpm"] == 600].assign(campaign="may"),
            "2 conditions at 1 speed; expected",
        ),
    ]:
        frame.to_csv(workshop / "bad.csv", index=False)
        code, _, err = run("evaluate", workshop / "bad.csv", "--output", workshop / "r")
        assert code == 2 and "bad.csv" in err and message in err


@pytest.mark.slow
def test_a_rig_of_one_channel_is_evaluated_with_figures(run, tmp_path, monkeypatch):
    def one_channel(**options):
        rig = simulate_rig(
            rpm=(300, 500), crack_mm=6, n_samples=2400, window_length=400
        )
        return rig | {"data": rig.data[:, 0].copy()}

    monkeypatch.setitem(FETCHERS, "uestc", lambda **o: Bunch(**one_channel()))
    arguments = (
        "evaluate",
        "--rig",
        "uestc",
        "--window-length",
        400,
        "--train-rpm",
        500,
        "-q",
    )
    code, out, err = run(*arguments, "--output", tmp_path)
    assert (code, err) == (0, "") and "Drawn as PNG" in out
    assert (tmp_path / "uestc.png").stat().st_size > 10_000
