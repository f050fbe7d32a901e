"""Rig of two conditions whose resonances move little with speed, and whose faults are louder."""

import numpy as np
from scipy.signal import lfilter
from sklearn.utils import Bunch

LENGTH = 400
OPTIONS = [
    "--rig",
    "tests.benchmarks.speed_rig:rig_of_length",
    "--window-length",
    str(LENGTH),
]


def two_conditions(make_windows, n_windows, length, speeds=(100.0, 200.0)):
    """Bunch of recordings of "ok" and "bad" with what `make_windows(speed, condition)` gives."""
    recordings = [(speed, condition) for speed in speeds for condition in ("ok", "bad")]
    return Bunch(
        data=np.concatenate([make_windows(*recording) for recording in recordings]),
        target=np.repeat([condition for _, condition in recordings], n_windows),
        target_names=["ok", "bad"],
        rpm=np.repeat([speed for speed, _ in recordings], n_windows),
        recording=np.repeat(
            [f"{condition}{speed:g}" for speed, condition in recordings], n_windows
        ),
        start=np.tile(length * np.arange(n_windows), len(recordings)),
    )


def moving_rig(
    n_windows=40, length=LENGTH, gain_of_fault=4.0, level=lambda speed: speed / 100
):
    """Two resonances that move little with speed."""
    generator = np.random.default_rng(0)

    def make_windows(speed, condition):
        angle, gain = {"ok": (0.5, 1.0), "bad": (1.5, gain_of_fault)}[condition]
        poles = 0.9 * np.exp(1j * (angle + speed / 5000) * np.array([1, -1]))
        noise = gain * level(speed) * generator.standard_normal((n_windows, length))
        return lfilter([1.0], np.poly(poles).real, noise)

    return two_conditions(make_windows, n_windows, length)


def rig_of_length(window_length):
    assert window_length == LENGTH
    return moving_rig()
