"""References that share no code with the kernels, and settings of tests that draw inputs.

The references are loops, explicit sums, dense matrices or exact fractions.
``SKARXLAG_EXAMPLES=500 python -m pytest tests/kernels`` tries more inputs, and other
ones each time.
"""

import math
import os

import numpy as np
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

EXAMPLES = os.environ.get("SKARXLAG_EXAMPLES")

some_examples = settings(
    max_examples=int(EXAMPLES or 15),
    derandomize=EXAMPLES is None,
    deadline=None,
    database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)

many_examples = settings(some_examples, max_examples=int(EXAMPLES or 60))

generators = st.integers(0, 2**32 - 1).map(np.random.default_rng)

shares = st.floats(0, 1)


def walk(rng, *shape):
    """Return an array that looks like a log spectrum."""
    return rng.normal(size=shape).cumsum(axis=-1) / 5


def literal_cepstrum(log_spectrum):
    """Cosine coefficients from 1 on, as explicit sums."""
    n = len(log_spectrum)
    angles = [(i + 0.5) * math.pi / n for i in range(n)]
    return [
        2
        / n
        * math.fsum(
            v * math.cos(c * a) for v, a in zip(log_spectrum, angles, strict=True)
        )
        for c in range(1, n)
    ]


def literal_predictor(samples, order, alpha):
    """Ridge regression on the product of the matrix of lagged samples with itself."""
    lagged = np.stack([samples[order - j : len(samples) - j] for j in range(order + 1)])
    sums = lagged @ lagged.T
    ridge = alpha * np.trace(sums) / len(sums) * np.eye(order)
    return np.linalg.solve(sums[1:, 1:] + ridge, sums[1:, 0])


def literal_motion(x, known):
    """Weights of known values, variance in unit distances, and distance beyond, one by one."""
    weights = np.zeros(len(known))
    if x <= known[0]:
        weights[0] = 1
        return weights, (known[0] - x) / math.log(1.3), x - known[0]
    if x >= known[-1]:
        weights[-1] = 1
        return weights, (x - known[-1]) / math.log(1.3), x - known[-1]
    i = next(i for i in range(len(known)) if known[i] > x)
    below, above = x - known[i - 1], known[i] - x
    weights[i - 1], weights[i] = above / (below + above), below / (below + above)
    # Two resistors in parallel: the precision of either side adds up.
    return (
        weights,
        1 / (1 / below + 1 / above) / math.log(1.3) if below > 0 else 0.0,
        0.0,
    )
