import numpy as np
import pytest
from sklearn.utils import Bunch

from benchmarks.recipe.recording_evidence import (
    CORRELATIONS,
    chosen_correlation,
    recording_logs,
    scored,
    table,
)


def simulated(correlation, n_recordings, n, rng):
    """Recordings of two conditions whose windows have log odds of this correlation."""
    covariance = np.full((n, n), correlation) + (1 - correlation) * np.eye(n)
    # Mean 1 and variance 2 are calibrated odds of a single window.
    odds = 1 + np.sqrt(2) * rng.multivariate_normal(np.zeros(n), covariance, n_recordings)
    return [(np.array([mean, 0.0]), 0, n) for mean in odds.mean(axis=1)]


@pytest.mark.parametrize("correlation", [0.05, 0.2, 0.5])
def test_the_correlation_of_simulated_recordings_is_found(correlation):
    recordings = simulated(correlation, 4000, 30, np.random.default_rng(0))
    found = CORRELATIONS.index(chosen_correlation(recordings))
    assert abs(found - CORRELATIONS.index(correlation)) <= 1
    probability, right, _ = scored(recordings, correlation)
    assert probability.mean() == pytest.approx(right.mean(), abs=0.02)


def test_every_rig_is_left_out_once():
    rng = np.random.default_rng(0)
    by_rig = {"a": simulated(0.2, 50, 9, rng), "b": simulated(0.5, 70, 9, rng)}
    found = table(by_rig).set_index("rig")
    assert found.loc["a", "correlation"] == chosen_correlation(by_rig["b"])
    assert found["recordings"].tolist() == [50, 70, 120, 120]


def test_second_halves_at_other_speeds_are_scored():
    rng = np.random.default_rng(0)
    X = rng.normal(size=(48, 300))
    X[24:] = X[24:].cumsum(axis=1)
    rig = Bunch(
        data=X,
        target=np.repeat(["a", "b"], 24),
        rpm=np.tile(np.repeat([600.0, 900.0], 12), 2),
        recording=np.repeat(["r", "s", "t", "u"], 12),
        start=np.tile(np.arange(12) * 300, 4),
    )
    found = recording_logs(rig, 300)
    assert len(found) == 4 and [n for *_, n in found] == [6] * 4
    assert all(logs.argmax() == true for logs, true, _ in found)
