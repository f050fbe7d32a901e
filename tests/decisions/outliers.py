"""Rows for the tests of outlier detectors: noise of conditions that drifts with speed."""

import copy
import warnings

import numpy as np
from scipy.signal import lfilter

LENGTH = 1200
RATE = 0.05
#: Pole of the noise of each condition.
POLES = {"good": -0.8, "inner": 0.0, "outer": 0.8}


def rows(condition, n, rpm, seed):
    """Noise of a condition's spectral shape, which drifts a little with speed."""
    rng = np.random.default_rng([seed, int(rpm), list(POLES).index(condition)])
    noise = rng.normal(size=(n, LENGTH))
    return lfilter([1], [1, POLES[condition] + rpm / 1e4], noise)


def rig(conditions, speeds, n, seed=0):
    """Rows, conditions and speeds of a rig."""
    parts = [(name, rpm) for name in conditions for rpm in speeds]
    X = np.concatenate([rows(name, n, rpm, seed) for name, rpm in parts])
    y, rpm = (np.repeat(column, n) for column in zip(*parts, strict=True))
    return X, y, rpm.astype(float)


def struck(n, seed, height):
    """Noise with impacts."""
    noise = np.random.default_rng(seed).normal(size=(n, LENGTH))
    noise[:, ::150] += height
    return noise


def fit(estimator, *data, **options):
    """Fit without the warnings on few rows and speeds."""
    with warnings.catch_warnings(action="ignore", category=UserWarning):
        return estimator.fit(*data, **options)


def changed(fitted, **attributes):
    """Return a copy with other fitted attributes."""
    copied = copy.deepcopy(fitted)
    vars(copied).update(attributes)
    return copied
