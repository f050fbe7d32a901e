import functools
import warnings

import numpy as np
import pytest
from scipy.signal import lfilter

from skarxlag import make_detector, make_diagnoser, make_windows

RATE = 1000.0
WINDOW = 200
COLOURS = {"good": [1.0, -0.9], "worn": [1.0, 0.9]}


def sound(condition, n_samples, seed, gain=1.0):
    noise = np.random.default_rng(seed).normal(size=n_samples)
    return gain * lfilter([1.0], COLOURS[condition], noise)


@pytest.fixture(scope="session")
def diagnoser_of():
    @functools.cache
    def fitted(length):
        parts = [make_windows(sound(name, 30 * length, 1), length) for name in COLOURS]
        y = np.repeat(list(COLOURS), 30)
        return make_diagnoser(healthy="good").fit(np.concatenate(parts), y)

    return fitted


@pytest.fixture(scope="session")
def diagnoser(diagnoser_of):
    return diagnoser_of(WINDOW)


@pytest.fixture(scope="session")
def detector():
    detector = make_detector(false_alarm_rate=0.05, fixed_gain=True)
    with warnings.catch_warnings(action="ignore"):
        # The speed is not known.
        return detector.fit(make_windows(sound("good", 24_000, 2), WINDOW))
