import math
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from skarxlag.kernels import ladder
from skarxlag.kernels.ladder import (
    confidence_scale,
    rung_scores,
)

from .literal import generators, many_examples, some_examples


def test_equal_cuts_leave_an_empty_rung():
    scores = rung_scores(np.array([0.9, 1.0, 1.1]), np.array([1.0, 1.0]))
    assert_array_equal(np.argmax(scores, axis=1), [0, 0, 2])


# Platt: five windows of a class count as 6/7 certain, so exp(scale) = 6.
@pytest.mark.parametrize(
    ("size", "expected"), [(1, np.log(6)), (1e-9, np.exp(10)), (-1, np.exp(-10))]
)
def test_confidence_scale_is_bounded(size, expected):
    scores = size * np.array([[1.0, 0.0], [0.0, 1.0]] * 5)
    scale = confidence_scale(scores, np.array([0, 1] * 5), np.ones(10))
    assert scale == pytest.approx(expected, rel=0.01)
    assert confidence_scale(np.zeros((3, 1)), np.zeros(3, dtype=int), np.ones(3)) == 1.0


levels_and_numbers = st.lists(
    st.tuples(st.integers(0, 30).map(float), st.integers(1, 3)), min_size=1, max_size=30
)


@many_examples
@given(levels_and_numbers, st.integers(1, 99))
def test_thresholds(rows, percent):
    levels, numbers = (np.array(column) for column in zip(*rows, strict=True))
    repeated = sorted(level for level, number in rows for _ in range(number))
    rank = math.ceil((len(repeated) + 1) * (1 - Fraction(percent, 100)))
    expected = repeated[min(rank, len(repeated)) - 1]
    found = ladder.false_alarm_threshold(levels, numbers.astype(float), percent / 100)
    assert found == expected
    assert ladder.weighted_median(levels, numbers.astype(float)) == np.median(repeated)


@many_examples
@given(st.integers(1, 999))
def test_rows_that_hold(per_mille):
    enough = (
        n for n in range(1, 1000) if Fraction(1, n + 1) <= Fraction(per_mille, 1000)
    )
    assert ladder.rows_that_hold(per_mille / 1000) == next(enough)


@many_examples
@given(
    st.lists(st.floats(1e-30, 1e30) | st.just(0.0), min_size=1, max_size=9),
    st.lists(st.floats(1e-20, 1e20), min_size=0, max_size=4).map(sorted),
)
def test_scores_of_rungs(levels, cuts):
    # A cut itself belongs to the rung below it.
    levels = levels + cuts
    found = ladder.rung_scores(np.array(levels), np.array(cuts))
    for level, scores in zip(levels, found, strict=True):
        bounds = [-746.0, *map(math.log, cuts), 745.0]
        log = math.log(level) if level > 0 else -745.0
        expected = [min(log - low, high - log) for low, high in pairwise(bounds)]
        assert_allclose(scores, expected, atol=1e-8)
        near = any(0 < abs(log - bound) < 1e-6 for bound in bounds)
        # Logarithms of neighbouring numbers are equal.
        are_apart = all(high - low > 1e-6 for low, high in pairwise(bounds))
        if not near and are_apart:
            assert scores.argmax() == sum(level > cut for cut in cuts)


@some_examples
@given(
    st.lists(
        st.lists(st.floats(1e-50, 1e50), min_size=3, max_size=3), min_size=1, max_size=5
    )
)
def test_scores_relative_to_the_geometric_mean(levels):
    found = ladder.relative_scores(np.array(levels))
    for row, scores in zip(levels, found, strict=True):
        mean = math.fsum(math.log(level) for level in row) / 3
        assert_allclose(scores, [mean - math.log(v) for v in row], atol=1e-9)


@some_examples
@given(generators, st.integers(2, 4), st.floats(-2, 2))
def test_confidence_scale(rng, n_classes, log_size):
    scores, target = rng.normal(size=(30, n_classes)), rng.integers(0, n_classes, 30)
    scores[np.arange(30), target] += 0.5
    scores *= math.exp(log_size)
    numbers = rng.integers(1, 4, 30)
    counts = [int(numbers[target == c].sum()) for c in range(n_classes)]

    def loss(log_factor):
        total = 0.0
        for row, true, number in zip(scores, target, numbers, strict=True):
            powers = np.exp(math.exp(log_factor) * (row - row.max()))
            logs = np.log(np.maximum(powers / powers.sum(), 1e-300))
            sure = (counts[true] + 1) / (counts[true] + 2)
            for c in range(n_classes):
                total -= (
                    number
                    * logs[c]
                    * (sure if c == true else (1 - sure) / (n_classes - 1))
                )
        return total

    found = math.log(ladder.confidence_scale(scores, target, numbers.astype(float)))
    assert loss(found) <= min(loss(log) for log in np.arange(-10, 4, 0.25)) + 1e-4
