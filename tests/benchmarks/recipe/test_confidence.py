import numpy as np
import pandas as pd
import pytest
from scipy.special import log_softmax

from benchmarks.recipe import confidence
from benchmarks.recipe.confidence import (
    KINDS,
    all_verdicts,
    calibration_table,
    expected_calibration_error,
    held_out_scale,
    reliability_table,
    scale_of_least_log_loss,
    scores_of,
    stated,
)
from skarxlag import make_diagnoser
from tests.benchmarks.speed_rig import LENGTH, OPTIONS, moving_rig


def test_calibration_error_of_calibrated_and_overconfident_verdicts():
    generator = np.random.default_rng(0)
    stated_confidence = generator.uniform(0.5, 1.0, 20_000)
    correct = generator.uniform(size=20_000) < stated_confidence
    assert expected_calibration_error(stated_confidence, correct) < 0.01
    assert expected_calibration_error(np.ones(10), np.arange(10) < 7) == 0.3


def test_groups_by_sum_and_by_mean_of_logarithms():
    logs = np.log(np.tile([0.6, 0.4], (10, 1)))
    frames = {
        frame.verdict[0]: frame
        for frame in stated(logs, np.zeros(10, int), np.full(10, "a"), np.arange(10))
    }
    assert list(frames) == KINDS
    window, summed, averaged = frames.values()
    np.testing.assert_allclose(window.confidence, 0.6)
    np.testing.assert_allclose(summed.confidence, 0.6**10 / (0.6**10 + 0.4**10))
    np.testing.assert_allclose(averaged.log_probability, np.log(0.6))
    assert [len(frame) for frame in frames.values()] == [10, 1, 1]


def test_scores_scaled_back_are_the_probabilities():
    rig = moving_rig()
    diagnoser = make_diagnoser().fit(rig.data, rig.target)
    scores = scores_of(diagnoser, rig.data)
    again = log_softmax(diagnoser["decide"].confidence_scale_ * scores, axis=1)
    np.testing.assert_allclose(np.exp(again), diagnoser.predict_proba(rig.data), atol=1e-12)


def test_held_out_blocks_state_less_confidence():
    # Conditions that do not differ: references of the training windows fit them by chance only.
    X = np.random.default_rng(0).normal(size=(80, LENGTH))
    y = np.repeat(["a", "b"], 40)
    start = np.tile(np.arange(40), 2)
    fitted = make_diagnoser().fit(X, y)["decide"].confidence_scale_
    assert held_out_scale(X, y, y, start) < fitted / 4


def test_scale_of_least_log_loss_recovers_the_factor_of_a_softmax():
    generator = np.random.default_rng(0)
    scores = generator.normal(size=(20_000, 3))
    # The largest of scores plus Gumbel noise is a draw from their softmax.
    target = (3 * scores + generator.gumbel(size=scores.shape)).argmax(axis=1)
    np.testing.assert_allclose(scale_of_least_log_loss(scores, target), 3, rtol=0.05)


@pytest.fixture(scope="module")
def verdicts():
    return all_verdicts(moving_rig(), LENGTH).assign(rig="r")


def test_tables_of_confidence(verdicts):
    table = calibration_table(verdicts)
    assert len(table) == 2 * len(KINDS) * 2  # speeds, verdicts, scales
    assert table["log loss"].between(0, 1).all()
    reliability = reliability_table(verdicts)
    assert reliability.groupby("speed")["share of verdicts"].sum().round(9).eq(1).all()


def test_command(monkeypatch, tmp_path, capsys, verdicts):
    monkeypatch.setattr(confidence, "all_verdicts", lambda rig, length: verdicts)
    confidence.main([*OPTIONS, "--output", str(tmp_path)])
    printed = capsys.readouterr().out
    assert "Accuracy of single windows by stated confidence" in printed
    written = pd.read_csv(tmp_path / "calibration.csv")
    assert written["rig"].unique().tolist() == OPTIONS[1:2]
