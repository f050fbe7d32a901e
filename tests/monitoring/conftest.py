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
def diagnoser():
    parts = [make_windows(sound(name, 30 * WINDOW, 1), WINDOW) for name in COLOURS]
    return make_diagnoser(healthy="good").fit(np.concatenate(parts), np.repeat(list(COLOURS), 30))


@pytest.fixture(scope="session")
def detector():
    detector = make_detector(false_alarm_rate=0.05, fixed_gain=True)
    return detector.fit(make_windows(sound("good", 24_000, 2), WINDOW))
