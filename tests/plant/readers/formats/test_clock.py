"""The rule for times of files and streams, against a literal one from sample to sample."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from skarxlag.plant.readers.formats.clock import DRIFT, MEASURED_FOR, Clock

RATE = 10.0
TOLERANCE = 0.35
SHORTEST = 20


def literal(times):
    """Return the changes, whether each is a break, and whether a rate is wrong."""
    last = origin = None
    changes = []
    n_breaks = 0
    largest = 0.0
    is_wrong = False
    for sample, time in enumerate(times):
        if np.isnan(time):
            continue
        if last is not None and time == last[1]:
            is_wrong |= sample - last[0] > MEASURED_FOR * RATE
            continue
        is_break = False
        if last is not None:
            step = time - last[1]
            is_break = abs(step - (sample - last[0]) / RATE) > TOLERANCE
            n_breaks = n_breaks + 1 if is_break else 0
            is_wrong |= n_breaks >= 10
            largest = max(largest, abs(step))
        expected = 0.0 if origin is None else (sample - origin[0]) / RATE
        if not is_break and origin is not None and sample - origin[0] >= SHORTEST:
            wrong_by = abs(time - origin[1] - expected)
            is_wrong |= wrong_by > DRIFT * expected + 2 * largest
        if is_break or origin is None or expected >= MEASURED_FOR:
            origin = (sample, time)
            largest = 0.0
        changes.append((sample, time, is_break))
        last = (sample, time)
    return changes, is_wrong


def cut_in(times, cuts):
    clock = Clock(RATE, TOLERANCE, SHORTEST)
    changes = []
    is_wrong = False
    for part in np.split(times, sorted(cuts)):
        offset = clock.n_samples
        block = clock.compare(part)
        columns = (block.samples + offset, block.seconds, block.is_break)
        changes += zip(*map(np.ndarray.tolist, columns), strict=True)
        is_wrong |= block.wrong is not None
    return changes, is_wrong


@settings(max_examples=100, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    cuts=st.lists(st.integers(0, 600), max_size=6),
    n_jumps=st.integers(0, 30),
    rate=st.sampled_from([1.0, 1.005, 1.03, -1.0, 0.0]),
    resolution=st.sampled_from([0.0, 0.1, 0.25]),
)
def test_the_literal_rule(seed, cuts, n_jumps, rate, resolution):
    rng = np.random.default_rng(seed)
    steps = rate / RATE + rng.normal(scale=0.01, size=600)
    steps[rng.choice(600, n_jumps)] += rng.normal(scale=3, size=n_jumps)
    times = np.cumsum(steps)
    if resolution:
        times = np.round(times / resolution) * resolution
    times[rng.random(600) < rng.choice([0, 0.3])] = np.nan
    expected = literal(times)
    assert cut_in(times, cuts) == expected
    assert cut_in(times, []) == expected


@pytest.mark.parametrize("n_samples", [95, 105])
@pytest.mark.parametrize("cut", [0, 40, 95, 105, 120])
def test_equal_times_for_ten_seconds(n_samples, cut):
    times = np.concatenate([np.full(n_samples, 3.0), [np.nan] * 50, [20.0]])
    assert cut_in(times, [cut])[1] == (n_samples > 101)


def test_steps_of_the_resolution_are_right_after_any_number_of_samples():
    times = np.floor((np.arange(100) + 37) / RATE / 4) * 4
    fine = Clock(RATE, TOLERANCE, 100).compare(times)
    assert fine.is_break.tolist() == [False, True, False, False]
    assert not Clock(RATE, TOLERANCE, 100, resolution=4.0).compare(times).is_break.any()
