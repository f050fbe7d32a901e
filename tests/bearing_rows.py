"""Rows of seconds with the impacts of a fault of a bearing 6205, and their classifier."""

import numpy as np

from skarxlag import FaultOrderClassifier, bearing_orders

RATE = 10_000.0
ORDERS = bearing_orders("6205")


def row(location, rpm=900, amplitude=10.0, seed=0, seconds=1):
    """Return seconds of noise, with impacts of a fault location that scatter by 1 %."""
    rng = np.random.default_rng(seed)
    n_samples = int(seconds * RATE)
    signal = rng.normal(size=n_samples)
    if location != "healthy":
        interval = 60 * RATE / (rpm * ORDERS[location])
        intervals = interval * rng.normal(1, 0.01, size=int(1.2 * n_samples / interval))
        impacts = np.cumsum(intervals)
        signal[impacts[impacts < n_samples].astype(int)] += amplitude
    return signal


def classifier(**options):
    settings = {"bearing": "6205", "sampling_rate": RATE} | options
    return FaultOrderClassifier(**settings)
