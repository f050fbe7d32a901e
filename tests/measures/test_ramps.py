"""Columns that only rise or only fall."""

import numpy as np
import pytest

from skarxlag import signal_quality

RNG = np.random.default_rng(0)
N = 1200
TIME = np.arange(N) / 20_000


@pytest.mark.parametrize(
    "ramp",
    [
        TIME,
        1.7e9 + TIME,
        -TIME,
        np.arange(float(N)),
        np.round(TIME, 4),
        TIME + RNG.normal(scale=5e-6, size=N),
    ],
    ids=["seconds", "dates", "seconds back", "a count", "rounded", "jitter"],
)
def test_a_window_of_times_is_a_ramp(ramp):
    assert signal_quality([ramp]).tolist() == ["ramp"]


@pytest.mark.parametrize(
    "signal",
    [
        RNG.normal(size=N),
        # The signal of a sensor on a strong drift, and slow motion in a short window.
        RNG.normal(size=N) + 0.3 * np.arange(N),
        np.sin(2 * np.pi * 8 * TIME) + 1e-3 * RNG.normal(size=N),
        np.cumsum(RNG.normal(size=N)),
        np.exp(-TIME / 0.01) + 1e-3 * RNG.normal(size=N),
    ],
)
def test_a_signal_is_no_ramp(signal):
    assert signal_quality([signal]).tolist() == ["good"]


def test_short_windows_are_no_ramps():
    assert signal_quality([np.arange(63.0)]).tolist() == ["good"]
    assert signal_quality([np.arange(64.0)]).tolist() == ["ramp"]
