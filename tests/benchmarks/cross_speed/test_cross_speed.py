import sys
from collections import Counter
from types import ModuleType

import numpy as np
import pandas as pd
import pytest
from sklearn.neighbors import KNeighborsClassifier
from sklearn.utils import Bunch

from benchmarks.cross_speed import reporting
from benchmarks.cross_speed.command import main
from benchmarks.pages.blocks import write_blocks


def pair(train, test, accuracy, confusion=(), balanced=None):
    scores = {
        "accuracy": accuracy,
        "balanced_accuracy": accuracy if balanced is None else balanced,
        "verdicts": 10,
        "confusion": Counter(dict(confusion)),
    }
    counts = {
        "recording": ["a", "b"],
        "windows": [5, 5],
        "right": [round(5 * accuracy), 5],
    }
    return {
        "recordings": pd.DataFrame(counts),
        "train_rpm": train,
        "test_rpm": test,
        "fit_seconds": 2.0,
        "predict_seconds": 0.5,
        "evidence": "vote",
        "window": scores,
        "group": {**scores, "accuracy": 1.0},
    }


PAIRS = [
    pair(100.0, 100.0, 1.0, {("a", "a"): 100}),
    pair(100.0, 200.0, 0.6, {("a", "a"): 6, ("b", "a"): 4}, balanced=0.5),
    pair(200.0, 100.0, 0.8, {("a", "a"): 8, ("a", "b"): 2}),
    pair(200.0, 200.0, 0.9, {("a", "a"): 100}),
]


def test_summary_by_hand():
    frame = reporting.pair_frame(PAIRS).assign(rig="r", window_length=4, method="m")
    summary = reporting.summarise(frame).set_index("verdict")
    assert summary.loc["window", "mean"] == pytest.approx(0.7)
    assert summary.loc["window", "balanced"] == pytest.approx(0.65)
    assert summary.loc["window", "worst"] == 0.6
    assert summary.loc["window", "worst_pair"] == "100 -> 200"
    assert summary.loc["window", "same_speed"] == pytest.approx(0.95)
    assert summary.loc["window", "verdicts"] == 20
    assert summary.loc["window", "seconds"] == pytest.approx(2 * 2.0 + 4 * 0.5)
    assert summary.loc["group", "mean"] == 1.0
    assert summary.loc["group", "evidence"] == "vote"


def test_confusion_is_summed_over_unequal_speeds_only():
    frame = reporting.confusion_frame(PAIRS).set_index(
        ["verdict", "true", "predicted"]
    )["count"]
    assert frame["window"].to_dict() == {("a", "a"): 14, ("a", "b"): 2, ("b", "a"): 4}


def test_recordings_are_counted_at_unequal_speeds():
    frame = reporting.recording_frame(PAIRS)
    columns = ["train_rpm", "test_rpm", "recording", "right", "windows"]
    assert frame[columns].to_numpy().tolist() == [
        [100.0, 200.0, "a", 3, 5],
        [100.0, 200.0, "b", 5, 5],
        [200.0, 100.0, "a", 4, 5],
        [200.0, 100.0, "b", 5, 5],
    ]


def test_seeds_of_a_method_become_their_mean():
    frames = [
        reporting.pair_frame(PAIRS[1:2]).assign(
            rig="r", window_length=4, method="m", accuracy=each
        )
        for each in (0.2, 0.4)
    ]
    seeds = [frame.assign(method=f"n, seed {i}") for i, frame in enumerate(frames)]
    found = (
        reporting.mean_of_seeds(pd.concat([frames[0], *seeds]))
        .groupby("method")
        .accuracy
    )
    assert found.size().to_dict() == {"m": 2, "n": 2}
    np.testing.assert_allclose(found.mean()[["m", "n"]], [0.2, 0.3])


def test_stored_results_are_added_where_a_method_was_not_run(tmp_path, monkeypatch):
    monkeypatch.setattr(reporting, "STORED", tmp_path / "stored")
    reporting.STORED.mkdir()
    columns = [*reporting.RUN, "accuracy"]
    stored = [("r", 4, "slow", 0.1), ("r", 4, "fast", 0.1), ("other", 4, "slow", 0.1)]
    pd.DataFrame(stored, columns=columns).to_csv(
        reporting.STORED / "pairs.csv", index=False
    )
    path = tmp_path / "pairs.csv"
    pd.DataFrame([("r", 4, "fast", 0.9)], columns=columns).to_csv(path, index=False)
    found = reporting.with_stored(path)
    assert found.to_numpy().tolist() == [["r", 4, "fast", 0.9], ["r", 4, "slow", 0.1]]


def test_merge_replaces_the_same_run_only(tmp_path):
    run = {"rig": "r", "window_length": 4, "method": "m"}
    path = tmp_path / "pairs.csv"
    reporting.merge(path, pd.DataFrame({"accuracy": [0.1, 0.2]}), run)
    reporting.merge(
        path, pd.DataFrame({"accuracy": [0.3]}), {**run, "window_length": 8}
    )
    reporting.merge(path, pd.DataFrame({"accuracy": [0.4]}), run)
    content = pd.read_csv(path)
    assert content.accuracy.tolist() == [0.3, 0.4]
    assert content.window_length.tolist() == [8, 4]


@pytest.mark.parametrize(
    "marks", ["", "<!-- a: end --> <!-- a: begin -->", "<!-- a: begin -->"]
)
def test_a_block_needs_its_marks(tmp_path, marks):
    page = tmp_path / "page.md"
    page.write_text(marks)
    with pytest.raises(ValueError, match=r"contains no marks|expected one"):
        write_blocks(page, {"a": "new"})
    assert page.read_text() == marks


@pytest.fixture
def module(monkeypatch):
    """Two constant conditions that one speed separates and the other one swaps."""
    levels = {("ok", 100.0): 0, ("bad", 100.0): 2, ("ok", 200.0): 2, ("bad", 200.0): 0}
    windows = 24

    def make_rig(window_length):
        return Bunch(
            data=np.repeat([*levels.values()], windows)[:, None]
            * np.ones(window_length),
            target=np.repeat([condition for condition, _ in levels], windows),
            target_names=["ok", "bad"],
            rpm=np.repeat([speed for _, speed in levels], windows),
            recording=np.repeat([f"{name}{speed}" for name, speed in levels], windows),
            start=np.tile(window_length * np.arange(windows), len(levels)),
        )

    found = ModuleType("bench_module")
    found.rig, found.neighbours = make_rig, KNeighborsClassifier
    monkeypatch.setitem(sys.modules, "bench_module", found)
    monkeypatch.setattr(sys, "path", sys.path.copy())


def test_command_writes_tables_and_the_block_of_a_readme(module, tmp_path, capsys):
    readme = tmp_path / "README.md"
    marks = [f"<!-- {reporting.TABLES}: {mark} -->" for mark in ("begin", "end")]
    readme.write_text("\n".join(["before", *marks, "after"]) + "\n")
    options = ["--rig", "bench_module:rig", "--method", "bench_module:neighbours"]
    options += ["--window-length", "4", "--output", str(tmp_path / "out")]
    chart = tmp_path / "chart.svg"
    main([*options, "--write", str(readme), "--figure", str(chart)])
    assert "bench_module:neighbours" in chart.read_text()

    row = "| bench_module:neighbours | 0.000 | 0.000 | 1.000 | 0.000 | 0.000 | 0.000 |"
    text = readme.read_text()
    assert text.startswith("before\n") and text.endswith("after\n")
    assert row in text
    assert row in capsys.readouterr().out
    summary = pd.read_csv(tmp_path / "out" / "summary.csv")
    assert summary["verdict"].tolist() == ["window", "group"]
    assert summary["mean"].tolist() == [0.0, 0.0]
    confusion = pd.read_csv(tmp_path / "out" / "confusion.csv")
    windows = confusion[confusion.verdict == "window"]
    assert windows[["true", "predicted", "count"]].to_numpy().tolist() == [
        ["bad", "ok", 24],
        ["ok", "bad", 24],
    ]


def test_resume_keeps_what_was_scored(module, tmp_path):
    options = [
        "--rig",
        "bench_module:rig",
        "--window-length",
        "4",
        "--output",
        str(tmp_path),
    ]
    options += ["--method", "bench_module:neighbours"]
    main(options)
    path = tmp_path / "pairs.csv"
    pd.read_csv(path).assign(accuracy=0.25).to_csv(path, index=False)
    main([*options, "--resume"])
    assert pd.read_csv(path).accuracy.eq(0.25).all()
    main(options)
    assert not pd.read_csv(path).accuracy.eq(0.25).any()
