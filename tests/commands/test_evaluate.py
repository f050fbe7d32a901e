import re
from functools import partial

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter
from sklearn.metrics import confusion_matrix, precision_score, recall_score
from sklearn.pipeline import make_pipeline
from sklearn.utils import Bunch

from skarxlag import (
    ARXLaguerre,
    ExtendedStatePIObserver,
    PIObserver,
    ThresholdLadder,
    make_alpio,
    make_diagnoser,
    make_extended_state_pio,
)
from skarxlag.commands import figures, main, rigs, trials
from skarxlag.datasets.simulated import simulate_rig
from skarxlag.paper import load_tables

from .deadly_tasks import Deadly

TITLES = ("ALPIO", "Extended state", "Diagnoser")
TINY = ("evaluate", "--n-samples", "2400", "--window-length", "400")


@pytest.fixture
def no_figures(monkeypatch):
    monkeypatch.setattr(figures, "why_missing", lambda: "No figures today.")


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    folder = tmp_path_factory.mktemp("results")
    assert main([*TINY, "--output", str(folder)]) == 0
    return folder


@pytest.fixture(scope="module")
def single_ladder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("single")
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setattr(figures, "why_missing", lambda: "No figures today.")
        assert main([*TINY, "--ladder", "single", "--output", str(folder)]) == 0
    return folder


def numbers(folder, name, index=("rig", "condition")):
    return pd.read_csv(folder / name).set_index(list(index))


def paper_makers(ladder):
    """Name in the paper's tables and maker."""
    if ladder == "bank":
        return {
            "proposed": make_extended_state_pio,
            "ALPIO": make_alpio,
            "Diagnoser": make_diagnoser,
        }

    def make(observer, healthy):
        # One model of healthy windows, one residual in the sensor's unit, one ladder.
        identify = ARXLaguerre(healthy=healthy, unit_rms=False)
        return make_pipeline(identify, observer, ThresholdLadder(healthy=healthy))

    return {
        "proposed": partial(make, ExtendedStatePIObserver()),
        "ALPIO": partial(make, PIObserver()),
    }


def test_writes_tables_and_figures(simulated):
    names = {path.name for path in simulated.iterdir()}
    assert all(name.startswith("simulated_") for name in names)
    stems = [f"table{number}" for number in range(2, 10)]
    stems += ["table5_by_halves", "averages", "improvements", "verdicts"]
    assert {f"simulated_{stem}.csv" for stem in stems} == {n for n in names if n.endswith(".csv")}
    for crack in ("3mm", "6mm"):
        for stem in ("speeds", "confusion"):
            content = (simulated / f"simulated_{stem}_{crack}.png").read_bytes()
            assert content.startswith(b"\x89PNG") and len(content) > 10_000


def test_every_figure_of_the_report_has_its_source(simulated):
    lines = (simulated / "simulated_report.txt").read_text().splitlines()
    assert lines[0].startswith(
        "Simulated rig in the place of the paper's: 8 conditions at 300, 400"
    )
    assert lines[1].strip().startswith("6 windows of 400 samples at 250000 Hz. Seed 0.")
    assert any("simulation, not from measurements" in line for line in lines[:8])
    starts = [n for n, line in enumerate(lines) if re.match(r"Table [234589]\b", line)]
    assert len(starts) == 7
    for start in starts:
        heads = lines[start + 1 : start + 3]
        assert any(re.search(r"simulated rig .*paper", head) for head in heads)
    for number in (6, 7):
        (start,) = [n for n, line in enumerate(lines) if line.startswith(f"Table {number}:")]
        assert lines[start + 1] == "paper, proposed; corner: accuracy in %"
        assert "simulated rig, proposed; corner: accuracy in %" in lines[start + 2 : start + 15]
    for title in ("Average accuracy", "Improvement"):
        (start,) = [n for n, line in enumerate(lines) if line.startswith(title)]
        rows = [line for line in lines[start + 1 : start + 13] if "rows of" in line]
        assert len(rows) == 6
        assert all(row.startswith(("paper, ", "simulated rig, ")) for row in rows)
    same = [n for n, line in enumerate(lines) if "same windows are calibrated and scored" in line]
    assert [lines[n - 1][:8] for n in same] == ["Table 5:", "Table 8:", "Table 9:"]


@pytest.mark.parametrize("crack", [3, 6])
@pytest.mark.parametrize("ladder", ["bank", "single"])
def test_tables_are_those_of_the_diagnosers_themselves(request, ladder, crack):
    folder = request.getfixturevalue({"bank": "simulated", "single": "single_ladder"}[ladder])
    rig = simulate_rig(n_samples=2400, window_length=400)
    own = (rig.crack_mm == 0) | (rig.crack_mm == crack)
    X, y, rpm = (values[own] for values in (rig.data, rig.target, rig.rpm))
    is_first = rig.start[own] < 1200
    by_speed = {
        speed: numbers(folder, f"simulated_table{number}.csv", ["condition"])
        for speed, number in ((300, 2), (400, 3), (450, 4), (500, 5))
    }
    by_crack = numbers(folder, f"simulated_table{ {3: 8, 6: 9}[crack] }.csv", ["condition"])
    by_half = numbers(folder, "simulated_table5_by_halves.csv", ["condition"])
    matrices = numbers(
        folder, f"simulated_table{ {3: 6, 6: 7}[crack] }.csv", ["source", "method", "true"]
    ).sort_index()
    averages = numbers(folder, "simulated_averages.csv", ["source", "basis"]).loc["simulated rig"]
    order = ["Normal", "IR", "OR", "Ball", "IR-Ball", "OR-Ball", "IR-OR", "IR-OR-Ball"]
    for name, maker in paper_makers(ladder).items():
        diagnoser = maker(healthy="Normal").fit(X[rpm == 500], y[rpm == 500])
        if ladder == "single":
            assert diagnoser[:-1].transform(X[:2]).shape == (2, 1)
        all_averages = []
        for speed, table in by_speed.items():
            true, predicted = y[rpm == speed], diagnoser.predict(X[rpm == speed])
            recall = 100 * recall_score(true, predicted, labels=order, average=None)
            all_averages.append(recall.mean())
            for column in (
                table[f"simulated rig, {name}, {crack} mm"],
                by_crack[f"simulated rig, {name}, {speed} rpm"],
            ):
                assert column.index[:8].tolist() == order
                np.testing.assert_allclose(column.iloc[:9], [*recall, recall.mean()], rtol=1e-5)
            if speed == 400:
                check_matrix(matrices.loc["simulated rig", name.lower()], true, predicted)
        assert averages.loc["rows of Tables 2-5", f"{name}, {crack} mm"] == pytest.approx(
            np.mean(all_averages), rel=1e-5
        )
        first, second = ((rpm == 500) & half for half in (is_first, ~is_first))
        diagnoser = maker(healthy="Normal").fit(X[first], y[first])
        predicted = diagnoser.predict(X[second])
        recall = 100 * recall_score(y[second], predicted, labels=order, average=None)
        column = by_half[f"simulated rig, {name}, {crack} mm"]
        np.testing.assert_allclose(column.iloc[:8], recall, rtol=1e-5)


def check_matrix(table, true, predicted):
    order = ["Normal", "Ball", "IR", "OR", "IR-Ball", "OR-Ball", "IR-OR", "IR-OR-Ball"]
    counts = confusion_matrix(true, predicted, labels=order)
    assert table.loc[order, order].to_numpy().tolist() == counts.tolist()
    options = {"labels": order, "average": None}
    recall = 100 * recall_score(true, predicted, **options)
    precision = 100 * precision_score(true, predicted, zero_division=np.nan, **options)
    np.testing.assert_allclose(table.loc[order, "recall %"], recall, rtol=1e-5)
    below = table.loc["precision %", order].astype(float)
    np.testing.assert_allclose(below, precision, rtol=1e-5)


def test_reference_columns_hold_what_the_paper_prints(simulated):
    for number in (2, 3, 4, 5, 8, 9):
        table = numbers(simulated, f"simulated_table{number}.csv", ["condition"])
        printed = load_tables().tables[number]
        unit = "mm" if number < 6 else "rpm"
        columns = [name for name in table if name.startswith("paper, ")]
        assert columns == [f"paper, {m}, {v:g} {unit}" for m, v in printed.frame.columns]
        paper = table[columns].to_numpy()
        assert paper[:8].tolist() == printed.frame.to_numpy().tolist()
        np.testing.assert_allclose(paper[8], printed.frame.mean(), rtol=1e-5)
        assert paper[9].tolist() == printed.average.tolist()
    improvements = numbers(simulated, "simulated_improvements.csv", ["source", "basis"])
    assert improvements.loc["paper", "3 mm"].tolist()[:2] == [17.82, 17.82]
    own = improvements.loc[("simulated rig", "rows of Tables 2-5")]
    averages = numbers(simulated, "simulated_averages.csv", ["source", "basis"])
    row = averages.loc[("simulated rig", "rows of Tables 2-5")]
    for crack in ("3 mm", "6 mm"):
        difference = row[f"proposed, {crack}"] - row[f"ALPIO, {crack}"]
        assert own[crack] == pytest.approx(difference, abs=1e-3)


def test_report_tells_progress_and_folder(run, tmp_path, no_figures):
    folder = tmp_path / "new" / "folder"
    code, out, err = run(*TINY[:3], "--window-length", "600", "--output", folder)
    assert code == 0
    assert "[6/6]" in err and "Diagnoser, crack 6 mm: " in err
    assert "No figures today." in out
    assert out.rstrip().endswith(str(folder))
    assert not list(folder.glob("*.png"))
    assert "4 windows of 600 samples" in out
    verdicts = pd.read_csv(folder / "simulated_verdicts.csv")
    assert set(verdicts["train_rpm"]) == {500} and set(verdicts["test_rpm"]) == {300, 400, 450, 500}
    assert set(verdicts["start"]) == {0, 600, 1200, 1800}


def test_single_ladder_has_no_diagnoser_of_ours(single_ladder):
    report = (single_ladder / "simulated_report.txt").read_text()
    assert "on one model, of the healthy condition" in report and "Diagnoser" not in report
    assert set(pd.read_csv(single_ladder / "simulated_verdicts.csv")["diagnoser"]) == {
        "ALPIO",
        "Extended state",
    }


@pytest.mark.parametrize(
    ("options", "is_same"),
    [
        (["--n-jobs", "1", "--seed", "0"], True),
        (["--n-jobs", "2", "--processes"], True),
        (["--seed", "1"], False),
    ],
)
def test_seed_changes_the_rig_and_threads_and_processes_change_nothing(
    run, tmp_path, no_figures, simulated, options, is_same
):
    assert run(*TINY, "--output", tmp_path, *options)[0] == 0
    name = "simulated_verdicts.csv"
    assert ((tmp_path / name).read_text() == (simulated / name).read_text()) == is_same


def test_a_process_that_dies_each_time_names_its_trial(run, tmp_path, no_figures, monkeypatch):
    monkeypatch.setattr("skarxlag.commands.evaluate.PaperTrial", lambda *arguments: Deadly())
    code, out, err = run(*TINY, "--output", tmp_path, "--n-jobs", "1", "--processes")
    assert code == 1 and not out
    assert "crack 6 mm: every process for it died" in err or "crack 3 mm: every process" in err


@pytest.fixture
def real_rig():
    """What a fetcher returns, small: three conditions, two speeds, nine windows a recording."""
    rng = np.random.default_rng(1)
    names = [(condition, rpm) for condition in ("good", "inner", "outer") for rpm in (800.0, 900.0)]
    colours = {(c, r): [1.0, {"good": -0.9, "inner": 0.9, "outer": 0.0}[c]] for c, r in names}
    # The outer race changes its colour with the speed, so that some verdicts are wrong.
    colours["outer", 900.0] = [1.0, 0.7]
    data = [lfilter([1.0], colours[key], rng.normal(size=(9, 200))) for key in names]
    return Bunch(
        data=np.concatenate(data),
        target=np.repeat([condition for condition, _ in names], 9),
        target_names=["good", "inner", "outer"],
        rpm=np.repeat([rpm for _, rpm in names], 9),
        recording=np.repeat([f"{condition}_{rpm:g}" for condition, rpm in names], 9),
        start=np.tile(np.arange(9) * 200, len(names)),
        sampling_rate=20e3,
    )


@pytest.fixture
def fetched(monkeypatch, real_rig):
    asked = {}

    def fetch(**options):
        asked.update(options)
        return real_rig

    monkeypatch.setitem(rigs.FETCHERS, "uestc", fetch)
    return asked


def test_real_rig_is_calibrated_at_every_speed(run, tmp_path, fetched, real_rig):
    code, out, _ = run(
        "evaluate", "--rig", "uestc", "--data-home", tmp_path, "--output", tmp_path / "out"
    )
    assert code == 0
    assert fetched == {"data_home": tmp_path, "window_length": 1200}
    assert "simulat" not in out.lower()
    assert (tmp_path / "out" / "uestc_speeds.png").stat().st_size > 10_000
    pairs = numbers(tmp_path / "out", "uestc_speeds.csv", ("diagnoser", "train_rpm"))
    summary = numbers(tmp_path / "out", "uestc_summary.csv", ["diagnoser"])
    assert len(pairs) == 6
    for title in TITLES:
        accuracy = pairs.loc[title, ["800 rpm", "900 rpm"]].to_numpy()
        other = accuracy[[0, 1], [1, 0]]
        assert len(np.unique(accuracy)) > 1
        assert summary.loc[title, "mean_other_speed"] == pytest.approx(other.mean(), rel=1e-5)
        assert summary.loc[title, "worst_pair"] == pytest.approx(other.min(), rel=1e-5)
        assert summary.loc[title, "mean_same_speed"] == pytest.approx(
            accuracy.diagonal().mean(), rel=1e-5
        )
        line = next(line for line in out.splitlines() if line.startswith(f"{title}, 800 rpm"))
        assert re.search(rf"\[{accuracy[0, 0]:.1f}\] +{accuracy[0, 1]:.1f} *$", line)
    # The middle window of nine belongs to neither half: 4 windows, 3 conditions, 2 pairs.
    counts = numbers(tmp_path / "out", "uestc_confusion_alpio.csv", ["true"])
    assert counts.iloc[:3, 1:4].to_numpy().sum() == 24


def test_threads_change_nothing_and_progress_can_be_silenced(run, tmp_path, fetched, no_figures):
    outputs = tmp_path / "a", tmp_path / "b"
    for output, options in zip(outputs, (["--n-jobs", "1"], ["--n-jobs", "3", "-q"]), strict=True):
        code, _, err = run("evaluate", "--rig", "uestc", "--output", output, *options)
        assert code == 0 and ("[6/6]" in err) == ("-q" not in options)
        assert bool(err) == ("-q" not in options)
    first, second = ((output / "uestc_verdicts.csv").read_bytes() for output in outputs)
    assert first == second


def test_a_worker_loads_the_rig_itself(fetched, real_rig, tmp_path):
    rigs.loaded_rigs.clear()
    scores = trials.Trial(rigs.FetchedRig("uestc", tmp_path, 200), 800.0, "alpio", 1)()
    assert fetched == {"data_home": tmp_path, "window_length": 200}
    assert set(scores.verdicts["test_rpm"]) == {800, 900} and len(scores.diagnoser.classes_) == 3


def test_one_training_speed_of_a_real_rig(run, tmp_path, fetched, no_figures):
    options = ("--rig", "uestc", "--train-rpm", "900", "--output", tmp_path)
    assert run("evaluate", *options)[0] == 0
    assert len(numbers(tmp_path, "uestc_speeds.csv", ["diagnoser"])) == 3
    assert run("evaluate", *options[:3], "all", *options[4:])[0] == 0
    assert len(numbers(tmp_path, "uestc_speeds.csv", ["diagnoser"])) == 6


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--train-rpm", "300"], "--train-rpm: only the real rigs have it; the paper calibrates"),
        (["--train-rpm", "fast"], "--train-rpm: 'fast', expected a speed in rpm, or all"),
        (["--train-rpm", "nan"], "--train-rpm: 'nan', expected a speed"),
        (["--window-length", "99"], "--window-length: '99', expected an integer of at least 100"),
        (["--window-length", "2000"], "--window-length: 2000, expected at most half of the 2400"),
        (["--seed", "-1"], "--seed: '-1', expected an integer from 0"),
        (["--n-jobs", "0"], "--n-jobs: '0', expected a number of threads"),
        (["--n-samples", "x"], "--n-samples: 'x', expected an integer of at least 1"),
        (["--ladder", "none"], "--ladder: invalid choice: 'none'"),
        (["--rig", "mine"], "--rig: invalid choice: 'mine'"),
        (["--data-home", "x"], "--data-home: the simulated rig reads no files"),
        (["--rig", "uestc"], "--n-samples: only the simulated rig has it, not uestc"),
    ],
)
def test_wrong_arguments_are_named(run, tmp_path, arguments, message):
    code, out, err = run("evaluate", "--n-samples", "2400", "--output", tmp_path, *arguments)
    assert code == 2 and not out
    assert f"argument {message}" in err and "Traceback" not in err


def test_options_that_do_not_fit_a_real_rig_and_windows_longer_than_its_halves_are_refused(
    run, tmp_path, fetched, real_rig
):
    code, _, err = run("evaluate", "--rig", "uestc", "--seed", "1", "--output", tmp_path)
    assert code == 2 and "argument --seed: only the simulated rig" in err
    code, _, err = run("evaluate", "--rig", "uestc", "--ladder", "bank", "--output", tmp_path)
    assert code == 2 and "argument --ladder: only the simulated rig has it, not uestc" in err
    code, _, err = run("evaluate", "--rig", "uestc", "--train-rpm", "850", "--output", tmp_path)
    assert code == 2 and "argument --train-rpm: 850, expected 800, 900, or all" in err
    for name in ("data", "target", "rpm", "recording", "start"):
        real_rig[name] = real_rig[name][::9]
    code, _, err = run("evaluate", "--rig", "uestc", "--output", tmp_path)
    assert code == 2 and "argument --window-length: 1200, expected at most half" in err


def test_damaged_files_end_with_one_line(run, tmp_path, monkeypatch):
    def fetch(**options):
        raise OSError("N_800_1.mat is missing")

    monkeypatch.setitem(rigs.FETCHERS, "hit_sm", fetch)
    code, out, err = run("evaluate", "--rig", "hit_sm", "--output", tmp_path)
    assert code == 1 and not out
    assert err.splitlines()[-1] == "skarxlag evaluate: error: N_800_1.mat is missing"


def test_a_window_length_that_a_fetcher_refuses_is_a_wrong_argument(run, tmp_path, monkeypatch):
    def fetch(**options):
        raise ValueError("N_800_1.mat: fewer samples than window_length=500000")

    monkeypatch.setitem(rigs.FETCHERS, "hit_sm", fetch)
    code, _, err = run("evaluate", "--rig", "hit_sm", "--output", tmp_path)
    assert code == 2 and "argument --window-length: N_800_1.mat: fewer samples" in err


def test_output_that_is_a_file_is_refused_before_anything_is_computed(run, tmp_path):
    (tmp_path / "file").write_text("")
    code, _, err = run(*TINY, "--output", tmp_path / "file")
    assert code == 2 and "argument --output" in err and "loading" not in err
