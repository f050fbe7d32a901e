import doctest
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter
from sklearn.utils import Bunch

from benchmarks.pages import blocks as pages
from benchmarks.recipe import ablation, confidence
from benchmarks.recipe import evidence_over_time as evidence
from benchmarks.recipe import spectral_drift as spectra
from benchmarks.recipe import speed_effects as understanding
from benchmarks.recipe.evidence_over_time import group_accuracy, serial_correlation, speed_pairs
from benchmarks.recipe.spectral_drift import LevelQuarter, mean_square_move, moments
from tests.benchmarks.speed_rig import LENGTH, OPTIONS, moving_rig


@pytest.mark.parametrize("module", [ablation, confidence, evidence, pages, spectra])
def test_examples(module):
    result = doctest.testmod(module)
    assert result.attempted > 0
    assert result.failed == 0


def test_marks_of_a_page():
    assert pages.put_block("<!-- x: begin --><!-- x: end -->", "x", "1") == (
        "<!-- x: begin -->\n1\n<!-- x: end -->"
    )
    with pytest.raises(ValueError, match="expected one '<!-- x: begin -->'"):
        pages.put_block("<!-- y: begin --><!-- y: end -->", "x", "1")


def test_page_has_a_place_for_every_table():
    text = (Path(__file__).parents[3] / "docs" / "cross_speed.md").read_text("utf-8")
    for name in ("ablation", "confidence", *understanding.TEXT):
        assert pages.put_block(text, name, "").count(f"<!-- {name}: begin -->") == 1


def test_moments_recover_means_scatter_and_noise():
    generator = np.random.default_rng(0)
    target, rpm = np.repeat(["a", "b"], 4000), np.tile([1.0, 2.0], 4000)
    centre = np.where(target == "a", 0.0, 5.0) + rpm
    means, within, noise = moments((centre + 2 * generator.normal(size=8000))[:, None], target, rpm)
    np.testing.assert_allclose(means[..., 0], [[1, 2], [6, 7]], atol=0.15)
    np.testing.assert_allclose(within, 4, rtol=0.05)
    np.testing.assert_allclose(noise, 4 / 2000, rtol=0.1)


def test_moves_are_free_of_estimation_noise():
    generator = np.random.default_rng(0)
    means = 0.5 * generator.normal(size=(6, 4, 2000))
    own, shared = mean_square_move(means, np.full(2000, 0.25))
    # Nothing moved: what is left are the positive halves of an error of mean 0.
    assert own.mean() < 0.1
    assert shared.mean() < 0.1
    own, shared = mean_square_move(means + np.arange(4.0)[:, None], np.full(2000, 0.25))
    # Differences of 0..3 have a mean square of 10 / 3 over the pairs, all of it shared.
    np.testing.assert_allclose(own.mean(), 10 / 3, rtol=0.05)
    np.testing.assert_allclose(shared.mean(), 10 / 3, rtol=0.05)


def test_quarters_go_from_valleys_to_peaks():
    X = np.array([[3.0, 0.0, 2.0, 1.0]])
    assert [LevelQuarter(q).fit_transform(X).item() for q in range(4)] == [0, 1, 2, 3]


def test_group_accuracy_adds_up_evidence():
    logs = np.array([[-1.0, -2.0], [-3.0, 0.0], [-1.0, -2.0], [-1.0, -2.0]])
    pair = Bunch(log_probability=logs, target=np.zeros(4, int), recording=np.full(4, "a"))
    assert group_accuracy(pair, 1, np.arange(4)) == 0.75
    assert group_accuracy(pair, 2, np.arange(4)) == 1 / 3
    assert np.isnan(group_accuracy(pair, 5, np.arange(4)))


def test_correlation_between_neighbours():
    correct = np.repeat([1, 1, 0, 0], 50)
    recording = np.repeat(["easy", "hard"], 100)
    start = np.tile(np.arange(100), 2)
    noisy = correct ^ (np.random.default_rng(0).uniform(size=200) < 0.2)
    pooled, within = serial_correlation(noisy, recording, start)
    assert pooled > 0.2
    assert abs(within) < 0.2


@pytest.fixture(scope="module")
def pairs():
    """The speed raises high frequencies, and the amplifier's gain threefold."""
    rig = moving_rig()
    fast = rig.rpm == 200.0
    rig.data[fast] = 3 * lfilter([1.0, -0.4], [1.0], rig.data[fast])
    return list(speed_pairs(rig, LENGTH))


def test_speed_pairs(pairs):
    assert [(p.train_rpm, p.test_rpm) for p in pairs] == [
        (a, b) for a in (100, 200) for b in (100, 200)
    ]
    for p in pairs:
        assert np.mean(p.residual.argmin(axis=1) == p.target) > 0.9
        moved = not np.allclose(p.residual, p.adapted)
        assert moved == (p.train_rpm != p.test_rpm)
    rig = moving_rig()
    expected = 2 * np.log(rig.data[rig.rpm == 100.0].std(axis=1)).reshape(2, 40)
    np.testing.assert_allclose(pairs[0].level.reshape(2, 20), expected[:, 20:], atol=0.01)
    np.testing.assert_allclose(pairs[0].level_mean, expected[::-1, :20].mean(axis=1), atol=0.01)


def test_healthy_windows_move_the_references_towards_themselves(pairs):
    healthy = pairs[1].target == 1  # "bad", "ok"
    own = [np.mean(pairs[1][key][healthy, 1]) for key in ("residual", "adapted", "shifted")]
    assert own[0] > 1.02 * max(own[1:])
    others = [np.mean(pairs[0][key][:, 1]) for key in ("residual", "adapted", "shifted")]
    np.testing.assert_allclose(others, others[0])  # at the training speed nothing has moved


@pytest.mark.slow
def test_command(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(spectra, "POLES", (0.0,))
    monkeypatch.setattr(evidence, "GROUP_SIZES", (1, 2))
    understanding.main([*OPTIONS, "--output", str(tmp_path)])
    printed = capsys.readouterr().out
    for name in understanding.TEXT:
        assert (tmp_path / f"{name.replace(' ', '_')}.csv").stat().st_size > 0
        assert understanding.TEXT[name] in printed
