import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy import stats

from skarxlag.kernels import healthy_limits, spectra
from skarxlag.kernels.healthy_limits import (
    Expected,
    HealthyRows,
    Rows,
    calibrate,
    drift_scale,
    flagged_shares,
    log_p_values,
    measure_windows,
    number_of_cepstra,
)

from .literal import (
    generators,
    literal_cepstrum,
    literal_motion,
    many_examples,
    some_examples,
)


def noise_rows(n_rows, seed=0, n_windows=1):
    """Features of noise, few so that the tests are fast where loops are not compiled."""
    signals = np.random.default_rng(seed).normal(size=(n_rows * n_windows, 600))
    cepstra, means = measure_windows(signals, with_level=True)
    shape = n_rows, n_windows
    return Rows(cepstra[:, :8].reshape(*shape, 8), means.reshape(*shape, 2))


def healthy(rows, known, at, weights=None):
    return HealthyRows(
        rows, known, at, np.ones(len(at)) if weights is None else weights
    )


@some_examples
@given(
    generators, st.integers(4, 160), st.booleans(), st.sampled_from([1e-300, 1, 1e300])
)
def test_features_of_windows(rng, length, with_level, gain):
    signals = 3 + rng.normal(size=(2, length))
    cepstra, means = measure_windows(gain * signals, with_level=with_level)
    assert cepstra.shape == (2, number_of_cepstra(length))
    for row, signal in enumerate(signals - signals.mean(axis=1, keepdims=True)):
        shape, steadiness = spectra.own_spectra(signal[np.newaxis], 128)[0]
        assert_allclose(cepstra[row], literal_cepstrum(shape), atol=1e-4)
        expected = [math.fsum(steadiness) / len(steadiness)]
        if with_level:
            expected += [math.log(gain) + math.log(math.sqrt(np.mean(signal**2)))]
        assert_allclose(means[row], expected, atol=1e-3)


def test_silence_has_finite_features():
    for features in measure_windows(np.ones((2, 200)), with_level=True):
        assert np.isfinite(features).all()


def test_rows_are_cut_into_whole_parts():
    windows = np.arange(2 * 7).reshape(2, 7, 1)
    parts = Rows(windows, -windows).cut(3)
    expected = [[0, 1], [2, 3], [4, 5], [7, 8], [9, 10], [11, 12]]
    assert_array_equal(parts.cepstra[..., 0], expected)
    assert_array_equal(parts.means, -parts.cepstra)


def test_a_row_at_the_limit_is_not_flagged():
    logs, at = np.log([0.05, 0.04, 0.05, 0.06]), np.array([0, 0, 1, 1])
    weights = np.array([3.0, 1.0, 1.0, 1.0])
    assert_array_equal(flagged_shares(logs, at, np.log(0.05), weights), [0.25, 0])


def test_rows_that_are_all_alike_leave_the_least_deviations():
    rows = Rows(*(np.repeat(part, 10, axis=0) for part in noise_rows(1)))
    limits = calibrate(healthy(rows, np.zeros(1), np.zeros(10, int)))
    assert_allclose(limits.deviations, 0.005)
    assert limits.score_deviation == 0.05
    assert_allclose(limits.score_mean, np.log(1e-3), atol=1e-9)
    assert_allclose(limits.expected.variances, 0, atol=1e-20)


def test_two_rows_have_the_scatter_of_two_rows():
    rows = noise_rows(2)
    limits = calibrate(healthy(rows, np.zeros(1), np.zeros(2, int)))
    # The unbiased variance of two values is half the square of their difference.
    expected = np.diff(rows.cepstra[:, 0], axis=0)[0] ** 2 / 2
    assert_allclose(limits.expected.variances, expected)


def test_p_values_are_between_the_smallest_number_and_one():
    rows = noise_rows(20)
    limits = calibrate(healthy(rows, np.zeros(1), np.zeros(20, int)))
    usual = Rows(*(np.mean(part, axis=0, keepdims=True) for part in rows))
    assert log_p_values(limits, usual, np.zeros(1), 1.0)[0] == 0
    odd = usual._replace(means=usual.means + 1e150)
    least = np.log(np.finfo(float).tiny) + np.log(3)
    assert_allclose(log_p_values(limits, odd, np.zeros(1), 1.0), least)


def test_a_scale_at_which_the_rate_is_just_kept_holds(monkeypatch):
    rows, known, at = noise_rows(60), np.log([800.0, 1000.0]), np.repeat([0, 1], 30)
    # One row is flagged at any scale.
    rows.means[5] += 1e6
    data = healthy(rows, known, at)
    limits = calibrate(data)
    for rate, at_end in ((1 / 30, 0), (np.nextafter(1 / 30, 0), -1)):
        monkeypatch.setattr(healthy_limits, "HELD_RATE", rate)
        scale, logs = drift_scale(data, limits)
        assert scale == pytest.approx(math.sqrt(2) * healthy_limits.SCALES[at_end])
        shares = flagged_shares(logs, at, np.log(rate), data.weights)
        assert_allclose(shares, [1 / 30, 0])


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


def literal_score(cepstra, expected, variances, drift):
    """Log mean square distance of one row of several windows, coefficient by coefficient."""
    total = 0.0
    for n, place in enumerate(cepstra.mean(axis=0)):
        change = 0.3 / (n + 1) ** 2 + 0.01
        spread = variances[n] / len(cepstra) + drift * change
        total += (place - expected[n]) ** 2 / spread
    return math.log(total / cepstra.shape[1] + 1e-3)


@some_examples
@given(generators, st.integers(1, 3), st.floats(0.1, 9), st.integers(2, 40))
def test_log_p_values(rng, n_speeds, scale, n_blocks):
    n_features, n_rows = 4, 5
    known = np.sort(rng.uniform(0, 1, n_speeds))
    expected = Expected(
        known,
        rng.normal(size=(n_speeds, n_features)),
        rng.uniform(0, 2, n_features),
        rng.normal(size=(n_speeds, 2)),
    )
    limits = healthy_limits.Limits(
        expected,
        rng.uniform(0.1, 1, 2),
        float(rng.normal()),
        float(rng.uniform(0.1, 1)),
        n_blocks,
    )
    rows = Rows(rng.normal(size=(n_rows, 3, n_features)), rng.normal(size=(5, 3, 2)))
    log_speed = rng.uniform(-0.5, 1.5, n_rows)
    found = log_p_values(limits, rows, log_speed, scale)
    more = 1 + 1 / n_blocks
    for row, x in enumerate(log_speed):
        moved = scale * math.sqrt(literal_motion(x, known)[1]) + 0.03
        at_x = [np.interp(x, known, column) for column in expected.references.T]
        score = literal_score(rows.cepstra[row], at_x, expected.variances, moved)
        score = (score - limits.score_mean) / limits.score_deviation
        tails = [stats.t.sf(score / math.sqrt(more), n_blocks - 1)]
        for j, per_distance in enumerate((0.1, 0.3)):
            spread = limits.deviations[j] ** 2 * more + moved * per_distance**2
            change = rows.means[row, :, j].mean()
            change -= np.interp(x, known, expected.means[:, j])
            tails.append(2 * stats.t.sf(abs(change) / math.sqrt(spread), n_blocks - 1))
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
    rows.means[:] += rng.normal(size=(len(numbers), 1, 1))[at]
    known = np.log(1000.0) + np.cumsum(rng.uniform(0.05, 0.5, len(numbers)))
    return HealthyRows(rows, known, at, rng.uniform(0.5, 3, len(at)))


@some_examples
@given(healthy_recordings(1))
def test_calibration_on_blocks_of_time(healthy):
    rows, _, at, weights = healthy
    block = np.zeros(len(at), dtype=int)
    for speed in range(at.max() + 1):
        own = np.flatnonzero(at == speed)
        block[own] = [i * min(5, len(own)) // len(own) for i in range(len(own))]
    cepstra, means = rows.cepstra.mean(axis=1), rows.means.mean(axis=1)
    n_windows = rows.cepstra.shape[1]
    scores, squares = [], []
    for number in range(block.max() + 1):
        speeds = sorted(set(at[block == number]))
        rest = np.flatnonzero((block != number) & np.isin(at, speeds))
        mean, total = {}, 0.0
        for speed in speeds:
            of_speed = rest[at[rest] == speed]
            mean[speed] = np.average(
                cepstra[of_speed], axis=0, weights=weights[of_speed]
            )
            for row in of_speed:
                away = rows.cepstra[row] - mean[speed]
                total += weights[row] * (away**2).sum(axis=0)
        variances = total / (len(rest) * n_windows - len(speeds))
        variances /= weights[rest].mean()
        for speed in speeds:
            here = np.flatnonzero((block == number) & (at == speed))
            others = rest[at[rest] == speed]
            score = [
                literal_score(rows.cepstra[row], mean[speed], variances, 0.03)
                for row in here
            ]
            scores.append((np.array(score), weights[here]))
            level = np.average(means[others], axis=0, weights=weights[others])
            square = (means[here] - level) ** 2
            squares.append(np.average(square, axis=0, weights=weights[here]))
    limits = calibrate(healthy)
    n, mean = len(scores), np.mean([np.average(s, weights=w) for s, w in scores])
    spread = sum(np.average((score - mean) ** 2, weights=w) for score, w in scores) / (
        n - 1
    )
    assert limits.n_blocks == n
    assert limits.score_mean == pytest.approx(mean, abs=1e-6)
    assert limits.score_deviation == pytest.approx(
        max(math.sqrt(spread), 0.05), rel=1e-6
    )
    expected = np.maximum(np.sqrt(np.sum(squares, axis=0) / (n - 1)), 0.005)
    assert_allclose(limits.deviations, expected)


@pytest.mark.slow
@some_examples
@given(healthy_recordings(2))
def test_scale_of_the_drift(healthy):
    rows, known, at, weights = healthy
    limits = calibrate(healthy)

    def logs_of(scale):
        logs = np.empty(len(at))
        for speed in range(len(known)):
            own, rest = np.flatnonzero(at == speed), np.flatnonzero(at != speed)
            others = limits._replace(expected=calibrate(healthy.take(rest)).expected)
            logs[own] = log_p_values(others, rows.take(own), known[at[own]], scale)
        return logs

    expected = 64.0
    for half_steps in range(19):
        logs, holds = logs_of(2.0 ** (half_steps / 2 - 3)), True
        for speed in range(len(known)):
            own = at == speed
            flagged = math.fsum(weights[own & (logs < math.log(0.05))])
            holds &= flagged <= 0.05 * math.fsum(weights[own])
        if holds:
            expected = 2.0 ** (half_steps / 2 - 3)
            break
    scale, found = drift_scale(healthy, limits)
    assert scale == pytest.approx(math.sqrt(2) * expected)
    assert_allclose(found, logs_of(math.sqrt(2) * expected), atol=1e-9)
