"""Rows of impacts in noise: a fault of the inner or of the outer race at any speed."""

import numpy as np
from scipy.signal import lfilter

RATE = 8_000
ORDERS = {"inner": 5.4, "outer": 3.6}


def strikes(order, rpm, seed, n_samples=RATE, slip=0.01):
    """Rings of a resonance in noise, `order` times a revolution; rpm is one number or one a sample.

    A fault of the inner ring turns through the load's zone with the shaft.
    """
    rng = np.random.default_rng(seed)
    revolutions = np.cumsum(np.full(n_samples, rpm) / (60 * RATE))
    angle = revolutions * order
    jitter = np.cumsum(1 + slip * rng.normal(size=int(angle[-1]) + 2)) - rng.random()
    train = np.zeros(n_samples)
    at = np.searchsorted(angle, jitter[(jitter > 0) & (jitter < angle[-1])])
    train[at] = 10
    if order == ORDERS["inner"]:
        train *= 1 + np.cos(2 * np.pi * revolutions)
    return lfilter([1], [1, -1.2, 0.8], train) + rng.normal(size=n_samples)


def stretches(rpm, seed=0, n=4, **kwargs):
    X = [
        strikes(order, rpm, [seed, i, j], **kwargs)
        for i, order in enumerate(ORDERS.values())
        for j in range(n)
    ]
    return np.array(X), np.repeat(list(ORDERS), n)
