import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy import stats

from skarxlag.kernels import healthy_limits, healthy_rows
from skarxlag.kernels.drift import drift_covariance
from skarxlag.kernels.healthy_limits import (
    HealthyRows,
    calibrate,
    drift_scale,
    flagged_shares,
    log_p_values,
)
from skarxlag.kernels.healthy_rows import Rows, measure_rows

from .literal import generators, literal_motion, many_examples, some_examples


def noise_rows(n_rows, seed=0, n_windows=1):
    signals = np.random.default_rng(seed).normal(size=(n_rows, 600 * n_windows))
    rows = measure_rows(signals, n_windows, with_level=True)
    # Few features, so that the tests are fast where the loops are not compiled.
    cepstra = np.concatenate([rows.cepstra[..., :8], rows.cepstra[..., 48:51]], axis=-1)
    return Rows(
        rows.spectral_shape[:, :9], rows.steadiness[:, :4], cepstra, rows.values
    )


def healthy(rows, known, at, weights=None):
    return HealthyRows(
        rows, known, at, np.ones(len(at)) if weights is None else weights
    )


def shares(logs, at, rate):
    return np.array(
        [np.mean(logs[at == speed] < np.log(rate)) for speed in np.unique(at)]
    )


def test_a_row_at_the_limit_is_not_flagged():
    logs, at = np.log([0.05, 0.04, 0.05, 0.06]), np.array([0, 0, 1, 1])
    weights = np.array([3.0, 1.0, 1.0, 1.0])
    assert_array_equal(flagged_shares(logs, at, np.log(0.05), weights), [0.25, 0])


def literal_score(rows, own, rest, at, weights):
    """Scores of some rows beside others, from the covariances as the documentation states them."""
    cepstra, expected, about = rows.cepstra.mean(axis=1), {}, []
    spectral_shape, steadiness = [], []
    for speed in np.unique(at[rest]):
        same = rest[at[rest] == speed]
        expected[speed] = np.average(cepstra[same], axis=0, weights=weights[same])
        about.append(rows.cepstra[same] - expected[speed])
        spectral_shape.append(
            np.average(rows.spectral_shape[same], axis=0, weights=weights[same])
        )
        steadiness.append(
            np.average(rows.steadiness[same], axis=0, weights=weights[same])
        )
    about, weight = (
        np.concatenate(about),
        np.concatenate([weights[rest[at[rest] == s]] for s in expected]),
    )
    scatter = np.einsum("r,rwa,rwb->ab", weight, about, about) / weight.mean()
    n_windows, n_features = about.shape[0] * about.shape[1], about.shape[2]
    scatter /= n_windows - len(expected)
    few = n_features / (n_features + n_windows)
    scatter = (1 - few) * scatter + few * np.diag(np.diag(scatter))
    drift = drift_covariance(np.array(spectral_shape), np.array(steadiness))
    inverse = np.linalg.inv(scatter / about.shape[1] + 0.04 * drift)
    away = cepstra[own] - np.array([expected[speed] for speed in at[own]])
    return np.log(np.einsum("ra,ab,rb->r", away, inverse, away) / n_features + 1e-3)


def test_rows_that_are_all_alike_leave_the_least_deviations():
    one = noise_rows(1)
    rows = Rows(*(np.repeat(part, 10, axis=0) for part in one))
    limits = calibrate(healthy(rows, np.zeros(1), np.zeros(10, int)))
    assert_allclose(limits.deviations, 0.02)
    assert limits.score_deviation == 0.05
    assert_allclose(limits.score_mean, np.log(1e-3), atol=1e-9)
    assert_allclose(limits.variances, 0, atol=1e-20)


def test_drift_and_slopes_are_those_that_are_stated():
    rows = noise_rows(10)
    limits = calibrate(healthy(rows, np.zeros(1), np.zeros(10, int)))
    # One speed has no information on the slopes: what was assumed beforehand remains.
    assert_allclose(limits.slopes, [[-0.7, 0.7**2], [1.5, 0.75**2]])
    mean = (
        part.mean(axis=0, keepdims=True)
        for part in (rows.spectral_shape, rows.steadiness)
    )
    drift = limits.axes.T @ drift_covariance(*mean) @ limits.axes
    assert_allclose(drift, np.eye(len(drift)), atol=1e-9)


def test_two_rows_have_the_scatter_of_two_rows():
    rows = noise_rows(2)
    limits = calibrate(healthy(rows, np.zeros(1), np.zeros(2, int)))
    back = np.linalg.inv(limits.axes)
    variances = np.diag(back.T @ np.diag(limits.variances) @ back)
    # The unbiased variance of two values is half the square of their difference.
    assert_allclose(variances, np.diff(rows.cepstra[:, 0], axis=0)[0] ** 2 / 2)


def test_p_values_are_between_the_smallest_number_and_one():
    rows = noise_rows(20)
    limits = calibrate(healthy(rows, np.zeros(1), np.zeros(20, int)))
    usual = Rows(*(np.mean(part, axis=0, keepdims=True) for part in rows))
    assert log_p_values(limits, usual, np.zeros(1), 1.0)[0] == 0
    odd = usual._replace(values=usual.values + 1e150)
    least = np.log(np.finfo(float).tiny) + np.log(3)
    assert_allclose(log_p_values(limits, odd, np.zeros(1), 1.0), least)


def test_a_scale_at_which_the_rate_is_just_kept_holds(monkeypatch):
    rows, known, at = noise_rows(60), np.log([800.0, 1000.0]), np.repeat([0, 1], 30)
    # One row is flagged at any scale.
    rows.values[5, 1] += 1000
    limits = calibrate(healthy(rows, known, at))
    for rate, at_end in ((1 / 30, 0), (np.nextafter(1 / 30, 0), -1)):
        monkeypatch.setattr(healthy_limits, "HELD_RATES", (rate,))
        scale, logs = drift_scale(healthy(rows, known, at), limits)
        assert scale == 2 * healthy_limits.SCALES[at_end]
        assert shares(logs, at, rate).tolist() == [1 / 30, 0]


@many_examples
@given(
    st.lists(st.integers(1, 400), min_size=1, max_size=4),
    st.randoms(use_true_random=False),
)
def test_blocks_of_time(numbers, random):
    at = [speed for speed, number in enumerate(numbers) for _ in range(number)]
    random.shuffle(at)
    found = healthy_limits.time_blocks(np.array(at))
    for speed, n_rows in enumerate(numbers):
        n_blocks = 5 if n_rows < 180 else n_rows // 30 if n_rows < 300 else 10
        own = [block for block, row in zip(found, at, strict=True) if row == speed]
        n_blocks = min(n_blocks, n_rows)
        assert own == [i * n_blocks // n_rows for i in range(n_rows)]


@many_examples
@given(st.lists(st.integers(1, 9), min_size=1, max_size=4), st.integers(1, 20))
def test_parts_of_rows(numbers, n_windows):
    at = np.repeat(np.arange(len(numbers)), numbers)
    enough = (n for n in range(1, n_windows + 1) if n * min(numbers) >= 5)
    assert healthy_limits.parts_of_rows(at, n_windows) == next(enough, n_windows)


@some_examples
@given(
    generators, st.integers(1, 3), st.floats(0.1, 9), st.booleans(), st.integers(2, 40)
)
def test_log_p_values(rng, n_speeds, scale, two_sided, n_blocks):
    n_features, n_rows = 4, 5
    known = np.sort(rng.uniform(0, 1, n_speeds))
    limits = healthy_limits.Limits(
        known,
        rng.normal(size=(n_features, n_features)),
        rng.uniform(0, 2, n_features),
        rng.normal(size=(n_speeds, n_features)),
        rng.normal(size=(n_speeds, 2)),
        np.column_stack([rng.normal(size=2), rng.uniform(0.1, 1, 2)]),
        rng.uniform(0.1, 1, 2),
        float(rng.normal()),
        float(rng.uniform(0.1, 1)),
        n_blocks,
    )
    cepstra, values = (
        rng.normal(size=(n_rows, 3, n_features)),
        rng.normal(size=(n_rows, 2)),
    )
    log_speed = rng.uniform(-0.5, 1.5, n_rows)
    rows = healthy_rows.Rows(
        np.zeros((n_rows, 1)), np.zeros((n_rows, 1)), cepstra, values
    )
    found = healthy_limits.log_p_values(
        limits, rows, log_speed, scale, two_sided=two_sided
    )
    more, freedom = 1 + 1 / n_blocks, min(n_blocks, 10) - 1
    for row, x in enumerate(log_speed):
        _, variance, beyond = literal_motion(x, known)
        moved = scale * math.sqrt(variance) + 0.09
        total = 0.0
        for k in range(n_features):
            place = cepstra[row].mean(axis=0) @ limits.axes[:, k]
            away = place - np.interp(x, known, limits.references[:, k])
            total += away**2 / (limits.variances[k] + moved)
        score = math.log(total / n_features + 1e-3) - limits.score_mean
        tails = [stats.t.sf(score / limits.score_deviation / math.sqrt(more), freedom)]
        for j, per_distance in enumerate((0.4, 0.3)):
            slope, slope_variance = limits.slopes[j]
            expected = np.interp(x, known, limits.means[:, j]) + slope * beyond
            spread = limits.deviations[j] ** 2 * more + moved * per_distance**2
            spread += scale * slope_variance * beyond**2
            z = (values[row, j] - expected) / math.sqrt(spread)
            both = two_sided or j == 1
            tails.append(
                2 * stats.t.sf(abs(z), freedom) if both else stats.t.sf(z, freedom)
            )
        assert found[row] == pytest.approx(min(math.log(3 * min(tails)), 0), abs=1e-7)


@st.composite
def healthy_recordings(draw, fewest):
    """Rows of noise at some speeds, in any order of speeds, with weights."""
    numbers = draw(st.lists(st.integers(3, 8), min_size=fewest, max_size=3))
    at = np.array(
        draw(st.permutations(np.repeat(np.arange(len(numbers)), numbers).tolist()))
    )
    rng = draw(generators)
    rows = noise_rows(
        len(at), seed=int(rng.integers(1000)), n_windows=draw(st.integers(1, 2))
    )
    rows.values[:] += rng.normal(size=(len(numbers), 1))[at]
    known = np.log(1000.0) + np.cumsum(rng.uniform(0.05, 0.5, len(numbers)))
    return healthy_limits.HealthyRows(rows, known, at, rng.uniform(0.5, 3, len(at)))


@some_examples
@given(healthy_recordings(1))
def test_calibration_on_blocks_of_time(healthy):
    rows, _, at, weights = healthy
    block = np.zeros(len(at), dtype=int)
    for speed in range(at.max() + 1):
        own = np.flatnonzero(at == speed)
        block[own] = [i * min(5, len(own)) // len(own) for i in range(len(own))]
    scores, squares = [], []
    for number in range(block.max() + 1):
        speeds = set(at[block == number])
        rest = np.array(
            [i for i in range(len(at)) if block[i] != number and at[i] in speeds]
        )
        for speed in speeds:
            here = np.flatnonzero((block == number) & (at == speed))
            others = rest[at[rest] == speed]
            scores.append((literal_score(rows, here, rest, at, weights), weights[here]))
            mean = np.average(rows.values[others], axis=0, weights=weights[others])
            square = (rows.values[here] - mean) ** 2
            squares.append(np.average(square, axis=0, weights=weights[here]))
    limits = healthy_limits.calibrate(healthy)
    n, mean = len(scores), np.mean([np.average(s, weights=w) for s, w in scores])
    spread = sum(np.average((score - mean) ** 2, weights=w) for score, w in scores) / (
        n - 1
    )
    assert limits.n_blocks == n
    assert limits.score_mean == pytest.approx(mean, abs=1e-6)
    assert limits.score_deviation == pytest.approx(
        max(math.sqrt(spread), 0.05), rel=1e-6
    )
    expected = np.maximum(np.sqrt(np.sum(squares, axis=0) / (n - 1)), 0.02)
    assert_allclose(limits.deviations, expected)


@pytest.mark.slow
@some_examples
@given(healthy_recordings(2))
def test_scale_of_the_drift(healthy):
    rows, known, at, weights = healthy
    limits = healthy_limits.calibrate(healthy)
    measured = ("deviations", "score_mean", "score_deviation", "n_blocks")

    def logs_of(scale):
        logs = np.empty(len(at))
        for speed in range(len(known)):
            own, rest = np.flatnonzero(at == speed), np.flatnonzero(at != speed)
            others = healthy_limits.calibrate(healthy.take(rest))
            others = others._replace(
                **{name: getattr(limits, name) for name in measured}
            )
            logs[own] = healthy_limits.log_p_values(
                others, rows.take(own), known[at[own]], scale
            )
        return logs

    expected = 64.0
    for half_steps in range(19):
        logs, holds = logs_of(2.0 ** (half_steps / 2 - 3)), True
        for speed in range(len(known)):
            for rate in (0.01, 0.05):
                own = at == speed
                flagged = math.fsum(weights[own & (logs < math.log(rate))])
                holds &= flagged <= rate * math.fsum(weights[own])
        if holds:
            expected = 2.0 ** (half_steps / 2 - 3)
            break
    scale, found = healthy_limits.drift_scale(healthy, limits)
    assert scale == pytest.approx(2 * expected)
    assert_allclose(found, logs_of(2 * expected), atol=1e-9)
