"""Rig of two conditions whose resonances move little with speed, and whose faults are louder."""

import numpy as np
from scipy.signal import lfilter
from sklearn.utils import Bunch

LENGTH = 400
OPTIONS = ["--rig", "speed_rig:rig_of_length", "--window-length", str(LENGTH)]


def moving_rig(windows=40, speeds=(100.0, 200.0)):
    generator = np.random.default_rng(0)
    data, target, rpm, recording, start = [], [], [], [], []
    for speed in speeds:
        for condition, angle, gain in (("ok", 0.5, 1.0), ("bad", 1.5, 4.0)):
            poles = 0.9 * np.exp(1j * (angle + speed / 5000) * np.array([1, -1]))
            noise = gain * speed / 100 * generator.standard_normal((windows, LENGTH))
            data.append(lfilter([1.0], np.poly(poles).real, noise))
            target += [condition] * windows
            rpm += [speed] * windows
            recording += [f"{condition}{speed:g}"] * windows
            start += list(LENGTH * np.arange(windows))
    return Bunch(
        data=np.concatenate(data),
        target=np.array(target),
        target_names=["ok", "bad"],
        rpm=np.array(rpm),
        recording=np.array(recording),
        start=np.array(start),
    )


def rig_of_length(window_length):
    assert window_length == LENGTH
    return moving_rig()
