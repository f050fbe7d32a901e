"""Tables of the accuracy at other speeds."""

from collections import Counter

import numpy as np
import pandas as pd
import pytest
from sklearn.neighbors import KNeighborsClassifier
from sklearn.utils import Bunch

from benchmarks.cross_speed import reporting
from benchmarks.cross_speed.command import main


def pair(train, test, accuracy, confusion, balanced):
    scores = {
        "accuracy": accuracy,
        "balanced_accuracy": balanced,
        "verdicts": 10,
        "confusion": Counter(confusion),
    }
    right = [round(5 * accuracy), 5]
    counts = {"recording": ["a", "b"], "windows": [5, 5], "right": right}
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
    pair(100.0, 100.0, 1.0, {("a", "a"): 100}, 1.0),
    pair(100.0, 200.0, 0.6, {("a", "a"): 6, ("b", "a"): 4}, 0.5),
    pair(200.0, 100.0, 0.8, {("a", "a"): 8, ("a", "b"): 2}, 0.8),
    pair(200.0, 200.0, 0.9, {("a", "a"): 100}, 0.9),
]
RUN = {"rig": "r", "window_length": 4, "method": "m"}


def test_summary_by_hand():
    frame = reporting.pair_frame(PAIRS).assign(**RUN)
    summary = reporting.summarise(frame).set_index("verdict")
    expected = {
        "mean": 0.7,
        "balanced": 0.65,
        "worst": 0.6,
        "same_speed": 0.95,
        "verdicts": 20,
        "seconds": 2 * 2.0 + 4 * 0.5,
    }
    window = summary.loc["window"]
    assert window[[*expected]].to_dict() == pytest.approx(expected)
    assert window["worst_pair"] == "100 -> 200"
    assert summary.loc["group", ["mean", "evidence"]].tolist() == [1.0, "vote"]


def test_confusion_is_summed_over_unequal_speeds_only():
    frame = reporting.confusion_frame(PAIRS)
    counts = frame.set_index(["verdict", "true", "predicted"])["count"]
    expected = {("a", "a"): 14, ("a", "b"): 2, ("b", "a"): 4}
    assert counts["window"].to_dict() == expected


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
    one = reporting.pair_frame(PAIRS[1:2]).assign(**RUN)
    seeds = [
        one.assign(method=f"n, seed {seed}", accuracy=accuracy)
        for seed, accuracy in enumerate((0.2, 0.4))
    ]
    frame = reporting.mean_of_seeds(pd.concat([one, *seeds]))
    accuracy = frame.groupby("method").accuracy
    assert accuracy.size().to_dict() == {"m": 2, "n": 2}
    np.testing.assert_allclose(accuracy.mean()["n"], 0.3)


def swapped_rig(window_length):
    """Two constant conditions that one speed separates and the other one swaps."""
    levels = {("ok", 100.0): 0, ("bad", 100.0): 2, ("ok", 200.0): 2, ("bad", 200.0): 0}
    n_windows = 24
    rows = [key for key in levels for _ in range(n_windows)]
    return Bunch(
        data=np.array([[levels[row]] * window_length for row in rows]),
        target=np.array([condition for condition, _ in rows]),
        target_names=["ok", "bad"],
        rpm=np.array([speed for _, speed in rows]),
        recording=np.array([f"{condition}{speed}" for condition, speed in rows]),
        start=np.tile(window_length * np.arange(n_windows), len(levels)),
    )


def neighbours():
    return KNeighborsClassifier()


def test_command_writes_tables_and_the_block_of_a_readme(tmp_path, capsys):
    readme, chart, output = (tmp_path / name for name in ("a.md", "a.svg", "out"))
    marks = [f"<!-- {reporting.TABLES}: {mark} -->" for mark in ("begin", "end")]
    readme.write_text("\n".join(["before", *marks, "after"]) + "\n")
    options = ["--rig", f"{__name__}:swapped_rig", "--method", f"{__name__}:neighbours"]
    options += ["--window-length", "4", "--output", str(output)]
    main([*options, "--write", str(readme), "--figure", str(chart)])
    assert f"{__name__}:neighbours" in chart.read_text()
    row = f"| {__name__}:neighbours | 0.000 | 0.000 | 1.000 | 0.000 | 0.000 | 0.000 |"
    text = readme.read_text()
    assert text.startswith("before\n") and text.endswith("after\n")
    assert row in text and row in capsys.readouterr().out
    summary = pd.read_csv(output / "summary.csv")
    assert summary[["verdict", "mean"]].to_numpy().tolist() == [
        ["window", 0],
        ["group", 0],
    ]
    confusion = pd.read_csv(output / "confusion.csv").query("verdict == 'window'")
    assert confusion[["true", "predicted", "count"]].to_numpy().tolist() == [
        ["bad", "ok", 24],
        ["ok", "bad", 24],
    ]
    # What is there is kept.
    path = output / "pairs.csv"
    pd.read_csv(path).assign(accuracy=0.25).to_csv(path, index=False)
    main([*options, "--resume"])
    assert pd.read_csv(path).accuracy.eq(0.25).all()
