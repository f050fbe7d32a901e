"""The rule for times of files and streams, against a literal one from sample to sample."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from skarxlag.recordings.formats._clock import DRIFT, MEASURED_FOR, Clock

RATE, TOLERANCE, SHORTEST = 10.0, 0.35, 20


def literal(times):
    """Return the changes, whether each is a break, and whether a rate is wrong."""
    last = origin = known = None
    found, n_wrong, largest, is_wrong = [], 0, 0.0, False
    for place, time in enumerate(times):
        if np.isnan(time):
            continue
        if (
            last is not None
            and place - last[0] > MEASURED_FOR * RATE
            and time == last[1]
        ):
            is_wrong = True
        known = place
        if last is not None and time == last[1]:
            continue
        is_break = False
        if last is not None:
            step, n_samples = time - last[1], place - last[0]
            is_break = abs(step - n_samples / RATE) > TOLERANCE
            n_wrong = n_wrong + 1 if is_break else 0
            is_wrong |= n_wrong >= 10
            largest = max(largest, abs(step))
        if is_break or origin is None:
            origin, largest = (place, time), 0.0
        else:
            expected = (place - origin[0]) / RATE
            wrong_by = abs(time - origin[1] - expected)
            is_long = place - origin[0] >= SHORTEST
            is_wrong |= is_long and wrong_by > DRIFT * expected + 2 * largest
            if expected >= MEASURED_FOR:
                origin, largest = (place, time), 0.0
        found.append((place, time, is_break))
        last = place, time
    assert known is None or last is not None
    return found, is_wrong


def cut_in(times, cuts):
    clock, found, is_wrong, offset = Clock(RATE, TOLERANCE, SHORTEST), [], False, 0
    for part in np.split(times, sorted(cuts)):
        block = clock.compare(part)
        columns = (block.samples + offset, block.seconds, block.is_break)
        found += list(zip(*map(np.ndarray.tolist, columns), strict=True))
        is_wrong |= block.wrong is not None
        offset += len(part)
    return found, is_wrong


@settings(max_examples=200, deadline=None)
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
    expected, is_wrong = literal(times)
    assert cut_in(times, cuts) == (expected, is_wrong)
    assert cut_in(times, []) == (expected, is_wrong)


@pytest.mark.parametrize("n_samples", [95, 105])
def test_equal_times_for_ten_seconds(n_samples):
    times = np.concatenate([np.full(n_samples, 3.0), [np.nan] * 50, [20.0]])
    for cuts in ([], [40], [n_samples], [n_samples + 20]):
        assert cut_in(times, cuts)[1] == (n_samples > 101)


def test_steps_of_the_resolution_are_right_after_any_number_of_samples():
    times = np.floor((np.arange(100) + 37) / RATE / 4) * 4
    fine, coarse = (
        Clock(RATE, TOLERANCE, 100, resolution=r).compare(times) for r in (0.0, 4.0)
    )
    assert fine.is_break.tolist() == [False, True, False, False]
    assert not coarse.is_break.any()
