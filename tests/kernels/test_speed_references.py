import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from skarxlag.kernels import speed_references
from skarxlag.kernels.speed_references import (
    SAME_LOG_SPEED,
    group_speeds,
)

from .literal import generators, literal_motion, many_examples, some_examples


def test_a_group_spans_as_much_as_is_stated():
    _, at = group_speeds(np.array([0.0, SAME_LOG_SPEED]))
    assert at.tolist() == [0, 0]
    _, at = group_speeds(np.array([0.0, np.nextafter(SAME_LOG_SPEED, 1)]))
    assert at.tolist() == [0, 1]


known_speeds = st.lists(st.integers(1, 60), min_size=1, max_size=5, unique=True).map(
    lambda numbers: 0.03 * np.sort(numbers)
)


@many_examples
@given(generators, known_speeds, st.lists(st.floats(-1, 3), min_size=1, max_size=5))
def test_speeds_beside_known_ones(rng, known, places):
    values = rng.normal(size=(len(known), 2))
    at = speed_references.speed_distance(np.array(places), known)
    interpolated = at.interpolate(values)
    factors = speed_references.drift_factor(at.variance)
    for row, x in enumerate(places):
        weights, variance, beyond = literal_motion(x, known)
        assert_allclose(interpolated[row], weights @ values, atol=1e-9)
        assert at.variance[row] == pytest.approx(variance, abs=1e-9)
        assert at.beyond[row] == pytest.approx(beyond, abs=1e-12)
        assert factors[row] == pytest.approx(max(variance * math.log(1.3) / 0.4, 0.2))


@many_examples
@given(st.lists(st.integers(0, 40), min_size=1, max_size=25))
def test_groups_of_speeds(numbers):
    # In steps of 0.7 % no two speeds differ by exactly 2 %.
    log_speed = [0.007 * n for n in numbers]
    groups = []
    for value in sorted(log_speed):
        if groups and value - groups[-1][0] <= 0.02:
            groups[-1].append(value)
        else:
            groups.append([value])
    known, at = speed_references.group_speeds(np.array(log_speed))
    assert_allclose(known, [math.fsum(g) / len(g) for g in groups], atol=1e-12)
    assert all(
        value in groups[place] for value, place in zip(log_speed, at, strict=True)
    )


@some_examples
@given(generators, st.integers(1, 3), st.integers(0, 12))
def test_means_of_groups(rng, n_groups, more):
    group = np.concatenate([np.arange(n_groups), rng.integers(0, n_groups, more)])
    values, numbers = rng.normal(size=(len(group), 2)), rng.integers(1, 4, len(group))
    means = speed_references.group_means(values, group, numbers.astype(float))
    for g in range(n_groups):
        rows = np.flatnonzero(group == g)
        repeated = values[np.repeat(rows, numbers[rows])]
        assert_allclose(means[g], repeated.mean(axis=0), atol=1e-12)


@some_examples
@given(generators, known_speeds, st.integers(1, 3))
def test_references_at_speeds(rng, known, n_conditions):
    recorded = rng.random((len(known), n_conditions)) < 0.6
    recorded[rng.integers(0, len(known), n_conditions), np.arange(n_conditions)] = True
    log_speed = rng.uniform(-0.5, 2.5, 4)
    variance = speed_references.drift_variance(log_speed, known, recorded)
    means = rng.normal(size=(len(known), n_conditions))
    learned = []
    for place, x in enumerate(known):
        for c in range(n_conditions):
            rest = [i for i in range(len(known)) if recorded[i, c] and i != place]
            if recorded[place, c] and rest:
                by, moved, _ = literal_motion(x, known[rest])
                scale = math.sqrt(max(moved * math.log(1.3) / 0.4, 0.2))
                learned.append((means[place, c] - by @ means[rest, c]) / scale)
    found = speed_references.drift_learned(known, means, recorded)
    assert_allclose(found, learned, atol=1e-9)
    filled = speed_references.filled_references(known, means, recorded)
    at_speeds = speed_references.speed_distance(log_speed, known).interpolate(filled)
    for row, x in enumerate(log_speed):
        widest = 0.0
        for c in range(n_conditions):
            own = np.flatnonzero(recorded[:, c])
            by, moved, _ = literal_motion(x, known[own])
            assert_allclose(at_speeds[row, c], by @ means[own, c], atol=1e-9)
            widest = max(widest, moved)
        assert variance[row] == pytest.approx(widest, abs=1e-9)
