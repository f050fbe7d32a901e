"""Statistics of samples against their definitions in NumPy."""

import itertools

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skarxlag.kernels.sample_statistics import sample_statistics


@pytest.mark.parametrize("n_samples", [1, 2, 50])
@pytest.mark.parametrize("decimals", [0, 1, 6])
def test_statistics_are_those_of_their_definitions(n_samples, decimals):
    signals = np.random.default_rng(0).normal(size=(8, n_samples)).round(decimals)
    signals[0] = 3.0
    signals[1] = signals[1].clip(-0.5, 0.5)
    found = sample_statistics(signals, 0.5, 0.2, 0.15)
    for w, signal in enumerate(signals):
        span = np.ptp(signal)
        steps = np.abs(np.diff(signal))
        least = max(0.2 * np.sqrt(np.sum(steps**2) / n_samples), 0.15)
        stays = steps <= least
        runs = [len([*run]) for held, run in itertools.groupby(stays) if held]
        expected = (
            span,
            np.sum(signal == signal.max()) + np.sum(signal == signal.min()),
            np.sum(steps > 0.5 * span),
            stays.sum(),
            1 + max(runs, default=0),
            steps[~stays].min(initial=np.inf),
        )
        assert_allclose([value[w] for value in found], expected)
