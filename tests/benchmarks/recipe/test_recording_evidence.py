import numpy as np
import pandas as pd
import pytest

from benchmarks.recipe.recording_evidence import (
    ANOTHER,
    CORRELATIONS,
    SUM,
    Answer,
    answer,
    chosen_correlation,
    frame,
    table,
)
from benchmarks.recipe.rigs import Recording, Rig
from skarxlag import ConditionClassifier


def answers(rig, test, losses, right=True):
    """Frame of one recording, with the loss of each way."""
    facts = {"rig": rig, "test": test, "right": right, "confidence": 0.75}
    return pd.DataFrame(
        [facts | {"way": way, "loss": loss} for way, loss in losses.items()]
    )


def test_the_answer_of_a_location_is_the_sum_of_its_conditions():
    rng = np.random.default_rng(0)
    X = rng.normal(size=(24, 600)) * np.repeat([1.0, 2.0, 3.0], 8)[:, np.newaxis]
    y = np.repeat(["IR2", "IR5", "OR2"], 8)
    decide = ConditionClassifier().fit(X, y)
    logs = np.log([0.3, 0.3, 0.3, 0.1])
    groups = ["inner", "inner", "outer"]
    inner = answer(logs, decide, groups, "inner")
    assert inner.right and inner.confidence == pytest.approx(2 / 3)
    assert inner.loss == pytest.approx(-np.log(2 / 3))
    wrong = answer(logs, decide, groups, "outer")
    assert not wrong.right and wrong.loss == pytest.approx(-np.log(1 / 3))


def test_the_other_rigs_choose_and_both_tests_of_a_rig_count():
    best = {rig: dict.fromkeys([SUM, *map(str, CORRELATIONS)], 1.0) for rig in "ab"}
    best["a"][str(CORRELATIONS[1])] = 0.5
    best["b"][str(CORRELATIONS[3])] = 0.2
    best["b"][SUM] = 0.0
    results = pd.concat(
        [
            answers("a", "same", best["a"]),
            answers("a", ANOTHER, best["a"], right=False),
            answers("b", "same", best["b"]),
        ]
    )
    assert chosen_correlation(results) == CORRELATIONS[1]
    shown = table(results).set_index(["test", "rig"])
    assert shown["correlation"].dropna().tolist() == [
        CORRELATIONS[3],
        CORRELATIONS[1],
        CORRELATIONS[3],
    ]
    of_others = shown[shown.index.get_level_values("test") == ANOTHER]
    assert (of_others["accuracy, sum"] == 0).all()


def test_recordings_at_other_speeds_get_an_answer_of_each_way():
    rng = np.random.default_rng(0)
    recordings = [
        Recording(signal, condition, speed)
        for speed in (600.0, 900.0)
        for condition, signal in zip("ab", rng.normal(size=(2, 20_000)), strict=True)
    ]
    for each in recordings:
        if each.condition == "b":
            each.samples[:] = each.samples.cumsum()
    results = frame(Rig("UESTC", 5_000.0, recordings))
    # Two speeds: all but one is one, so each pair is there twice, for each kind of rows.
    assert len(results) == 3 * 8 * (1 + len(CORRELATIONS))
    assert results["right"].all() and set(results) >= set(Answer._fields)
