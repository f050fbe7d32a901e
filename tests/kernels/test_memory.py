"""Compiled loops in plain Python, which checks the indices that compiled loops do not."""

import sys

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher
from numpy.testing import assert_allclose

from skarxlag.kernels import (
    arx_laguerre,
    linear_prediction,
    observer,
    observer_bank,
    residual_levels,
    sample_statistics,
    short_time,
)
from skarxlag.kernels.compiled import _Kernel

LOOP = (0.3, 0.4, 0.1, 5.0)
ORDERS, POLES = np.array([5, 2]), np.array([0.3, -0.2])


def noise(*shape):
    return np.random.default_rng(0).normal(size=shape)


def predictors(order):
    return linear_prediction.predictors(noise(2, 41), order, 1e-9)


#: Sizes of which no part fills the last block of signals, samples, states, models or
#: members.
CALLS = {
    "sums": lambda: arx_laguerre.accumulate_sums(
        noise(3, 2, 21), np.ones(3), ORDERS, POLES, 4
    ),
    "innovations": lambda: arx_laguerre.innovations(
        noise(17, 2, 21), ORDERS, POLES, noise(3, 7), 4, np.empty((17, 3, 17))
    ),
    "observer": lambda: observer.observe(noise(17, 2, 21), LOOP),
    "bank": lambda: observer_bank.bank_levels(
        noise(2, 7), 0.3, *np.full((3, 33), 0.1), 0.05
    ),
    "gain": lambda: residual_levels.switching_gain(noise(3, 5), 0.1),
    "samples": lambda: sample_statistics.sample_statistics(
        noise(2, 7).round(), 0.7, 0.1, 1e-9
    ),
    "bands": lambda: short_time.band_levels(
        noise(1, 180), np.hanning(128), 16, np.ones(1)
    ),
    **{f"order {n}": lambda n=n: predictors(n) for n in (1, 3, 15, 16, 17)},
}


@pytest.mark.parametrize("name", CALLS)
def test_loops_stay_within_their_memory(monkeypatch, name):
    expected = CALLS[name]()
    for module in [
        each for key, each in sys.modules.items() if key.startswith("skarxlag.kernels")
    ]:
        for function, value in list(vars(module).items()):
            if isinstance(value, _Kernel | Dispatcher):
                monkeypatch.setattr(module, function, value.__wrapped__)
    for found, of_compiled in zip(CALLS[name](), expected, strict=True):
        assert_allclose(found, of_compiled, rtol=1e-5, atol=1e-5)
