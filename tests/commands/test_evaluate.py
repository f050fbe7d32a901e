import re

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter
from sklearn.metrics import accuracy_score, confusion_matrix, precision_score, recall_score
from sklearn.utils import Bunch

from skarxlag import make_alpio, make_diagnoser, make_extended_state_pio, speed_splits
from skarxlag.commands import figures, main, rigs
from skarxlag.datasets.simulated import simulate_rig

MAKERS = {
    "ALPIO": make_alpio,
    "Extended state": make_extended_state_pio,
    "Diagnoser": make_diagnoser,
}
TINY = ("evaluate", "--n-samples", "2400", "--window-length", "400")


@pytest.fixture
def no_figures(monkeypatch):
    monkeypatch.setattr(figures, "why_missing", lambda: "No figures today.")


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    folder = tmp_path_factory.mktemp("results")
    assert main([*TINY, "--output", str(folder)]) == 0
    return folder


def numbers(folder, name, index=("rig", "condition")):
    return pd.read_csv(folder / name).set_index(list(index))


def test_writes_tables_and_figures_that_all_name_the_simulated_rig(simulated):
    names = sorted(path.name for path in simulated.iterdir())
    assert all(name.startswith("simulated_") for name in names)
    for rpm in (300, 400, 450, 500):
        assert f"simulated_conditions_500rpm_{rpm}rpm.csv" in names
    for crack in ("3mm", "6mm"):
        for stem in ("speeds", "confusion", "residuals", "trajectories"):
            content = (simulated / f"simulated_{stem}_{crack}.png").read_bytes()
            assert content.startswith(b"\x89PNG") and len(content) > 10_000
    for path in simulated.glob("*.csv"):
        assert (pd.read_csv(path)["rig"] == "Simulated rig").all()
    titles = [
        line
        for line in (simulated / "simulated_report.txt").read_text().splitlines()
        if "accuracy" in line and "rows:" not in line
    ]
    assert len(titles) > 6 and all(line.startswith("Simulated rig") for line in titles)


@pytest.mark.parametrize("crack", [3.0, 6.0])
def test_tables_are_those_of_the_diagnosers_themselves(simulated, crack):
    rig = simulate_rig(n_samples=2400, window_length=400)
    own = (rig.crack_mm == 0) | (rig.crack_mm == crack)
    X, y, rpm, recording = (v[own] for v in (rig.data, rig.target, rig.rpm, rig.recording))
    splits = speed_splits(rpm, recording=recording, train_rpm=500, same_speed=True)
    by_speed = numbers(simulated, f"simulated_conditions_{crack:g}mm_500rpm.csv")
    pairs = numbers(simulated, f"simulated_speeds_{crack:g}mm.csv", ("diagnoser", "train_rpm"))
    for title, maker in MAKERS.items():
        diagnoser = maker(healthy="Normal").fit(X[splits[0][0]], y[splits[0][0]])
        for _, test in splits:
            at = f"{rpm[test[0]]:g} rpm"
            predicted = diagnoser.predict(X[test])
            recall = 100 * recall_score(y[test], predicted, labels=rig.target_names, average=None)
            by_crack = numbers(simulated, f"simulated_conditions_500rpm_{at.replace(' ', '')}.csv")
            expected = [*recall, recall.mean()]
            np.testing.assert_allclose(by_speed[f"{title}, {at}"], expected, rtol=1e-5)
            np.testing.assert_allclose(by_crack[f"{title}, {crack:g} mm"], expected, rtol=1e-5)
            assert pairs.loc[(title, 500), at] == pytest.approx(
                100 * accuracy_score(y[test], predicted), rel=1e-5
            )
            if at == "400 rpm":
                stem = title.lower().replace(" ", "-")
                table = numbers(simulated, f"simulated_confusion_{crack:g}mm_{stem}.csv", ["true"])
                counts = confusion_matrix(y[test], predicted, labels=rig.target_names)
                assert table.loc[rig.target_names, rig.target_names].to_numpy().tolist() == (
                    counts.tolist()
                )
                np.testing.assert_allclose(table["recall %"].iloc[:-1], recall, rtol=1e-5)
                precision = precision_score(
                    y[test], predicted, labels=rig.target_names, average=None, zero_division=np.nan
                )
                np.testing.assert_allclose(
                    table.loc["precision %"].iloc[1:-1].astype(float), 100 * precision, rtol=1e-5
                )


def test_report_tells_progress_protocol_and_folder(run, tmp_path, no_figures):
    folder = tmp_path / "new" / "folder"
    arguments = ("--n-samples", "3000", "--window-length", "600", "--train-rpm", "300")
    code, out, err = run("evaluate", "--output", folder, *arguments)
    assert code == 0
    assert "[6/6] Diagnoser, crack 6 mm, calibrated at 300 rpm: fitting, scoring 300 400" in err
    assert "No figures today." in out
    assert out.rstrip().endswith(str(folder))
    assert not list(folder.glob("*.png"))
    assert out.startswith("Simulated rig: 8 conditions at 300, 400, 450, 500 rpm, windows of 600")
    verdicts = pd.read_csv(folder / "simulated_verdicts.csv")
    assert set(verdicts["train_rpm"]) == {300} and set(verdicts["test_rpm"]) == {300, 400, 450, 500}
    assert set(verdicts["start"]) == {1800, 2400}


@pytest.mark.parametrize(
    ("options", "is_same"), [(["--n-jobs", "1", "--seed", "0"], True), (["--seed", "1"], False)]
)
def test_seed_changes_the_rig_and_threads_change_nothing(
    run, tmp_path, no_figures, simulated, options, is_same
):
    assert run(*TINY, "--output", tmp_path, *options)[0] == 0
    name = "simulated_verdicts.csv"
    assert ((tmp_path / name).read_text() == (simulated / name).read_text()) == is_same


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

    monkeypatch.setitem(rigs._FETCHERS, "uestc", fetch)
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
    for title in MAKERS:
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


def test_one_training_speed_of_a_real_rig(run, tmp_path, fetched, no_figures):
    options = ("--rig", "uestc", "--train-rpm", "900", "--output", tmp_path)
    assert run("evaluate", *options)[0] == 0
    assert len(numbers(tmp_path, "uestc_speeds.csv", ["diagnoser"])) == 3
    assert run("evaluate", *options[:3], "all", *options[4:])[0] == 0
    assert len(numbers(tmp_path, "uestc_speeds.csv", ["diagnoser"])) == 6


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--train-rpm", "333"], "--train-rpm: 333, expected one of 300, 400, 450, 500, or all"),
        (["--train-rpm", "fast"], "--train-rpm: 'fast', expected a speed in rpm, or all"),
        (["--train-rpm", "nan"], "--train-rpm: 'nan', expected a speed"),
        (["--window-length", "99"], "--window-length: '99', expected an integer of at least 100"),
        (["--window-length", "2000"], "--window-length: 2000, expected at most half of the 2400"),
        (["--seed", "-1"], "--seed: '-1', expected an integer from 0"),
        (["--n-jobs", "0"], "--n-jobs: '0', expected a number of threads"),
        (["--n-samples", "x"], "--n-samples: 'x', expected an integer of at least 1"),
        (["--rig", "mine"], "--rig: invalid choice: 'mine'"),
        (["--data-home", "x"], "--data-home: the simulated rig reads no files"),
        (["--rig", "uestc"], "--n-samples: only the simulated rig has it, not uestc"),
    ],
)
def test_wrong_arguments_are_named(run, tmp_path, arguments, message):
    code, out, err = run("evaluate", "--n-samples", "2400", "--output", tmp_path, *arguments)
    assert code == 2 and not out
    assert f"argument {message}" in err and "Traceback" not in err


def test_seed_of_a_real_rig_and_windows_longer_than_its_halves_are_refused(
    run, tmp_path, fetched, real_rig
):
    code, _, err = run("evaluate", "--rig", "uestc", "--seed", "1", "--output", tmp_path)
    assert code == 2 and "argument --seed: only the simulated rig" in err
    for name in ("data", "target", "rpm", "recording", "start"):
        real_rig[name] = real_rig[name][::9]
    code, _, err = run("evaluate", "--rig", "uestc", "--output", tmp_path)
    assert code == 2 and "argument --window-length: 1200, expected at most half" in err


def test_damaged_files_end_with_one_line(run, tmp_path, monkeypatch):
    def fetch(**options):
        raise OSError("N_800_1.mat is missing")

    monkeypatch.setitem(rigs._FETCHERS, "hit_sm", fetch)
    code, out, err = run("evaluate", "--rig", "hit_sm", "--output", tmp_path)
    assert code == 1 and not out
    assert err.splitlines()[-1] == "python -m skarxlag evaluate: error: N_800_1.mat is missing"


def test_a_window_length_that_a_fetcher_refuses_is_a_wrong_argument(run, tmp_path, monkeypatch):
    def fetch(**options):
        raise ValueError("N_800_1.mat: fewer samples than window_length=500000")

    monkeypatch.setitem(rigs._FETCHERS, "hit_sm", fetch)
    code, _, err = run("evaluate", "--rig", "hit_sm", "--output", tmp_path)
    assert code == 2 and "argument --window-length: N_800_1.mat: fewer samples" in err


def test_output_that_is_a_file_is_refused_before_anything_is_computed(run, tmp_path):
    (tmp_path / "file").write_text("")
    code, _, err = run(*TINY, "--output", tmp_path / "file")
    assert code == 2 and "argument --output" in err and "loading" not in err
