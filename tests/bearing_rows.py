"""Rows of a second with the impacts of a fault of a bearing 6205, and their classifier."""

import numpy as np

from skarxlag import FaultOrderClassifier, bearing_orders

RATE = 10_000.0
ORDERS = bearing_orders("6205")


def row(location, rpm=900, amplitude=10.0, seed=0):
    """Return a second of noise, with impacts of a fault location that scatter by 1 %."""
    rng = np.random.default_rng(seed)
    signal = rng.normal(size=int(RATE))
    if location != "healthy":
        interval = 60 * RATE / (rpm * ORDERS[location])
        intervals = interval * rng.normal(1, 0.01, size=int(1.2 * RATE / interval))
        impacts = np.cumsum(intervals)
        signal[impacts[impacts < RATE].astype(int)] += amplitude
    return signal


def classifier(**options):
    settings = {"bearing": "6205", "sampling_rate": RATE} | options
    return FaultOrderClassifier(**settings)
