import re

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter
from sklearn.metrics import confusion_matrix, precision_score, recall_score
from sklearn.utils import Bunch

from skarxlag import make_alpio, make_diagnoser, make_extended_state_pio
from skarxlag.core.capabilities import requests
from skarxlag.datasets import FETCHERS, simulate_rig
from skarxlag.plant.commands import main

MAKERS = {
    "ALPIO": make_alpio,
    "Extended state": make_extended_state_pio,
    "Diagnoser": make_diagnoser,
}
TINY = ("evaluate", "--n-samples", "2400", "--window-length", "400")


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    folder = tmp_path_factory.mktemp("results")
    assert main([*TINY, "--output", str(folder)]) == 0
    return folder


def numbers(folder, name, index):
    return pd.read_csv(folder / name).set_index(list(index))


def confusion(folder, stem, title):
    name = f"{stem}_confusion_{title.lower().replace(' ', '-')}.csv"
    return numbers(folder, name, ["true"])


@pytest.mark.slow
def test_writes_tables_and_figures_of_each_crack_size(simulated):
    names = {path.name for path in simulated.iterdir()}
    tables = ["speeds_windows", "summary", "verdicts", "protocols"]
    tables += [f"confusion_{title.lower().replace(' ', '-')}" for title in MAKERS]
    expected = {"simulated_report.txt"}
    for crack in ("3mm", "6mm"):
        expected |= {f"simulated_{crack}_{stem}.csv" for stem in tables}
        expected.add(f"simulated_{crack}.png")
    assert names == expected
    for path in simulated.glob("*.png"):
        content = path.read_bytes()
        assert content.startswith(b"\x89PNG") and len(content) > 10_000


def test_the_report_says_that_the_rig_is_simulated(simulated):
    lines = (simulated / "simulated_report.txt").read_text().splitlines()
    assert lines[3].startswith("Simulated rig: 8 conditions (Normal, ")
    assert lines[4] == "at 300, 400, 450, 500 rpm, windows of 400 samples at 250000 Hz."
    assert (
        sum(line.startswith("Simulated rig, crack 6 mm: accuracy") for line in lines)
        == 1
    )


def test_one_table_on_one_screen_has_the_best_of_each_test_marked(simulated):
    screen, _, rest = (
        (simulated / "simulated_report.txt").read_text().partition("\n\n\n")
    )
    assert screen.startswith("How often does each method name the right condition")
    # The two lines that the command prints below it make 24.
    assert len(screen.splitlines()) <= 22
    assert "confusion matrix" not in screen and "confusion matrix" in rest
    for crack in ("3 mm", "6 mm"):
        table = pd.read_csv(
            simulated / f"simulated_{crack.replace(' ', '')}_protocols.csv"
        )
        best = table["condition"].max()
        rows = re.search(rf"crack {crack} another speed(.*\n.*\n.*)", screen)[1]
        marked = [float(share) for share in re.findall(r"([\d.]+)\*", rows)]
        assert {*marked} == {round(best, 1), round(table["location"].max(), 1)}
        assert f"Crack {crack}: Diagnoser names the right location in" in screen


@pytest.mark.parametrize("title", MAKERS)
def test_tables_are_those_of_the_diagnosers_themselves(simulated, title):
    rig = simulate_rig(crack_mm=3, n_samples=2400, window_length=400)
    is_first = rig.start < 1200
    verdicts = pd.read_csv(simulated / "simulated_3mm_verdicts.csv")
    assert set(verdicts["train_rpm"]) == {500}
    assert set(verdicts["test_rpm"]) == set(rig.rpm)
    assert set(verdicts["start"]) == {1200, 1600, 2000}
    diagnoser = MAKERS[title](healthy="Normal")

    def metadata(method, rows):
        takes_rpm = requests(diagnoser, method, "rpm")
        return {"rpm": rig.rpm[rows].astype(float)} if takes_rpm else {}

    train = is_first & (rig.rpm == 500)
    diagnoser.fit(rig.data[train], rig.target[train], **metadata("fit", train))
    other = ~is_first & (rig.rpm != 500)
    predicted = diagnoser.predict(rig.data[other], **metadata("predict", other))
    matrix = confusion(simulated, "simulated_3mm", title)
    check_matrix(matrix, rig.target[other], predicted, rig.target_names)
    is_right = (rig.target[other] == predicted)[rig.rpm[other] == 300]
    name = "simulated_3mm_speeds_windows.csv"
    table = numbers(simulated, name, ["diagnoser", "train_rpm"])
    share = 100 * np.mean(is_right)
    assert table.loc[(title, 500), "300"] == pytest.approx(share, rel=1e-5)


def check_matrix(table, true, predicted, order):
    counts = confusion_matrix(true, predicted, labels=order)
    assert table.loc[order, order].to_numpy().tolist() == counts.tolist()
    options = {"labels": order, "average": None}
    recall = 100 * recall_score(true, predicted, **options)
    precision = 100 * precision_score(true, predicted, zero_division=np.nan, **options)
    np.testing.assert_allclose(table.loc[order, "recall %"], recall, rtol=1e-5)
    below = table.loc["precision %", order].astype(float)
    np.testing.assert_allclose(below, precision, rtol=1e-5)


def test_progress_and_folder_are_printed(run, tmp_path, no_figures):
    folder = tmp_path / "new" / "folder"
    code, out, err = run(*TINY, "-o", folder)
    assert code == 0
    assert "[6/6]" in err and "crack 6 mm: Diagnoser" in err
    assert "No figures: they need matplotlib" in out
    assert out.rstrip().endswith(str(folder))
    assert not list(folder.glob("*.png"))


@pytest.fixture
def real_rig():
    """Return a rig as a fetcher does: one channel, three conditions, two speeds."""
    rng = np.random.default_rng(1)
    names = [
        (condition, rpm)
        for condition in ("good", "inner", "outer")
        for rpm in (800.0, 900.0)
    ]
    colours = {
        (c, r): [1.0, {"good": -0.9, "inner": 0.9, "outer": 0.0}[c]] for c, r in names
    }
    # The outer race changes its colour with the speed, so that some verdicts are wrong.
    colours["outer", 900.0] = [1.0, 0.7]
    data = [lfilter([1.0], colours[key], rng.normal(size=(9, 400))) for key in names]
    return Bunch(
        data=np.concatenate(data),
        target=np.repeat([condition for condition, _ in names], 9),
        target_names=["good", "inner", "outer"],
        rpm=np.repeat([rpm for _, rpm in names], 9),
        recording=np.repeat([f"{condition}_{rpm:g}" for condition, rpm in names], 9),
        start=np.tile(np.arange(9) * 400, len(names)),
        sampling_rate=20e3,
    )


@pytest.fixture
def fetched(monkeypatch, real_rig):
    asked = {}

    def fetch(**options):
        asked.update(options)
        return real_rig

    monkeypatch.setitem(FETCHERS, "uestc", fetch)
    return asked


@pytest.mark.slow
def test_real_rig_is_calibrated_at_every_speed(run, tmp_path, fetched):
    output = tmp_path / "out"
    options = ("--rig", "uestc", "--data-home", tmp_path, "--output", output)
    code, out, _ = run("evaluate", *options)
    assert code == 0
    assert fetched == {"data_home": tmp_path, "window_length": 1200}
    assert "simulat" not in out.lower()
    assert (output / "uestc.png").stat().st_size > 10_000
    report = (output / "uestc_report.txt").read_text()
    assert out.startswith("How often does each method name the right condition")
    assert "UESTC rig: 3 conditions" in out and report.startswith(out.split("Drawn")[0])
    name = "uestc_speeds_windows.csv"
    pairs = numbers(output, name, ["diagnoser", "train_rpm"])[["800", "900"]]
    summary = numbers(output, "uestc_summary.csv", ["diagnoser"])
    assert len(pairs) == 6
    for title in MAKERS:
        accuracy = pairs.loc[title].to_numpy()
        other = accuracy[[0, 1], [1, 0]]
        assert len(np.unique(accuracy)) > 1
        expected = {
            "mean_other_speed": other.mean(),
            "worst_pair": other.min(),
            "mean_same_speed": accuracy.diagonal().mean(),
        }
        assert summary.loc[title].to_dict() == pytest.approx(expected, rel=1e-5)
        shares = " +".join(f"{round(share, 1):g}" for share in accuracy[0])
        assert re.search(rf"{title} +800 rpm +{shares}", report)
    # The middle window of nine belongs to neither half: 4 windows, 3 conditions, 2
    # pairs.
    assert confusion(output, "uestc", "ALPIO").iloc[:3, :3].to_numpy().sum() == 24


def test_threads_change_nothing_and_progress_can_be_silenced(
    run, tmp_path, fetched, no_figures
):
    verdicts = []
    for threads, quiet in ((1, ()), (3, ("-q",))):
        options = ("--rig", "uestc", "--output", tmp_path, "--n-jobs", threads)
        code, _, err = run("evaluate", *options, *quiet)
        assert code == 0 and ("[3/3]" in err) == (not quiet) == bool(err)
        verdicts.append((tmp_path / "uestc_verdicts.csv").read_bytes())
    assert verdicts[0] == verdicts[1]


@pytest.mark.parametrize(("rpm", "n_rows"), [("900", 3), ("all", 6)])
def test_training_speeds_of_a_real_rig(run, tmp_path, fetched, no_figures, rpm, n_rows):
    options = ("--rig", "uestc", "--train-rpm", rpm, "--output", tmp_path)
    assert run("evaluate", *options)[0] == 0
    assert len(pd.read_csv(tmp_path / "uestc_speeds_windows.csv")) == n_rows


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("--train-rpm 310", "train-rpm: 310, expected 300, 400, 450, 500, or all"),
        ("--train-rpm fast", "train-rpm: 'fast', expected a speed in rpm, or all"),
        ("--train-rpm nan", "train-rpm: 'nan', expected a speed"),
        ("--window-length 99", "window-length: '99', expected an integer of at least"),
        ("--window-length 2000", "window-length: 2000, expected at most half of the"),
        ("--n-jobs 0", "n-jobs: '0', expected a number of threads"),
        ("--n-samples x", "n-samples: 'x', expected an integer of at least 1"),
        ("--rig mine", "rig: invalid choice: 'mine'"),
        ("--data-home x", "data-home: not allowed with --rig simulated"),
        ("--rpm 900", "rpm: not allowed with --rig simulated"),
        ("--rig uestc", "n-samples: not allowed with --rig uestc"),
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


def test_speeds_and_halves_that_a_real_rig_does_not_have(
    run, tmp_path, fetched, real_rig
):
    options = ("evaluate", "--rig", "uestc", "--output", tmp_path)
    code, _, err = run(*options, "--train-rpm", "850")
    assert code == 2 and "argument --train-rpm: 850, expected 800, 900, or all" in err
    for name in ("data", "target", "rpm", "recording", "start"):
        real_rig[name] = real_rig[name][::9]
    code, _, err = run(*options)
    assert code == 2 and "argument --window-length: 400, expected at most half" in err


@pytest.mark.parametrize(
    "error",
    [
        OSError("N_800_1.mat is missing"),
        ValueError("N_800_1.mat: fewer samples than window_length=500000"),
    ],
)
def test_an_error_of_a_fetcher_is_one_line(run, tmp_path, monkeypatch, error):
    def fetch(**options):
        raise error

    monkeypatch.setitem(FETCHERS, "hit_sm", fetch)
    code, out, err = run("evaluate", "--rig", "hit_sm", "--output", tmp_path)
    assert code == 1 and not out
    assert err.splitlines()[-1] == f"skarxlag evaluate: error: {error}"


def test_an_output_that_is_a_file_is_refused_before_anything_is_computed(run, tmp_path):
    (tmp_path / "file").write_text("")
    code, _, err = run(*TINY, "--output", tmp_path / "file")
    assert code == 2 and "argument --output" in err and "loading" not in err
    code, _, err = run("evaluate", "no_such_table.csv", "--output", tmp_path / "new")
    assert code == 1 and "error:" in err and not (tmp_path / "new").exists()
