import numpy as np
import pytest

from benchmarks.recipe.recording_evidence import (
    CORRELATIONS,
    chosen_correlation,
    recording_logs,
    scored,
    table,
)
from benchmarks.recipe.rigs import Recording, Rig


def simulated(correlation, n_recordings, n, rng):
    """Recordings of two conditions whose windows have log odds of this correlation."""
    covariance = np.full((n, n), correlation) + (1 - correlation) * np.eye(n)
    # Mean 1 and variance 2 are calibrated odds of a single window.
    odds = 1 + np.sqrt(2) * rng.multivariate_normal(
        np.zeros(n), covariance, n_recordings
    )
    return [(np.array([mean, 0.0]), 0, n) for mean in odds.mean(axis=1)]


@pytest.mark.parametrize("correlation", [0.05, 0.2, 0.5])
def test_the_correlation_of_simulated_recordings_is_found(correlation):
    recordings = simulated(correlation, 4000, 30, np.random.default_rng(0))
    found = CORRELATIONS.index(chosen_correlation({"rig": recordings}))
    assert abs(found - CORRELATIONS.index(correlation)) <= 1
    probability, right = scored(recordings, correlation)
    assert probability.mean() == pytest.approx(right.mean(), abs=0.02)


def test_every_rig_is_left_out_once():
    rng = np.random.default_rng(0)
    by_rig = {"a": simulated(0.2, 50, 9, rng), "b": simulated(0.5, 70, 9, rng)}
    found = table(by_rig).set_index("rig")
    assert found.loc["a", "correlation"] == chosen_correlation({"b": by_rig["b"]})
    assert found["recordings"].tolist() == [50, 70, 120, 120]


def test_second_halves_at_other_speeds_are_scored():
    rng = np.random.default_rng(0)
    recordings = [
        Recording(signal, condition, speed)
        for speed in (600.0, 900.0)
        for condition, signal in zip("ab", rng.normal(size=(2, 20_000)), strict=True)
    ]
    for each in recordings:
        if each.condition == "b":
            each.samples[:] = each.samples.cumsum()
    found = recording_logs(Rig("r", 10_000.0, recordings), "windows of 1200")
    # Two speeds: all but one is one, so each pair is there twice.
    assert [n for *_, n in found] == [8] * 8
    assert all(logs.argmax() == true for logs, true, _ in found)
