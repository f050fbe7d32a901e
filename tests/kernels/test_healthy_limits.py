import numpy as np
import pytest
from scipy import stats

from skarxlag.kernels import healthy_limits
from skarxlag.kernels.drift import drift_covariance
from skarxlag.kernels.healthy_limits import (
    HealthyRows,
    Limits,
    calibrate,
    drift_scale,
    flagged_shares,
    log_p_values,
    parts_of_rows,
    time_blocks,
)
from skarxlag.kernels.healthy_rows import Rows, measure_rows
from skarxlag.kernels.speed_references import UNIT_DISTANCE


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


def test_blocks_of_time_are_equal_and_in_order():
    at = np.repeat([0, 1, 2], [23, 3, 400])
    block = time_blocks(at)
    np.testing.assert_array_equal(np.bincount(block[:23]), [5, 5, 4, 5, 4])
    np.testing.assert_array_equal(block[23:26], [0, 1, 2])
    np.testing.assert_array_equal(np.bincount(block[26:]), [40] * 10)
    assert np.all(np.diff(block[:23]) >= 0)


def test_there_are_more_blocks_from_30_rows_a_block_on():
    n_blocks = [time_blocks(np.zeros(n, int)).max() + 1 for n in (179, 180, 299, 300)]
    assert n_blocks == [5, 6, 9, 10]


def test_few_rows_of_many_windows_are_cut():
    assert parts_of_rows(np.zeros(2, int), 52) == 3
    assert parts_of_rows(np.zeros(1, int), 4) == 4
    assert parts_of_rows(np.zeros(5, int), 52) == 1
    # The speed that has fewest rows decides.
    assert parts_of_rows(np.repeat([0, 1], [50, 2]), 10) == 3


def test_p_values_are_those_of_the_equations():
    rows = noise_rows(40)
    known, at = np.log([1000.0, 1200.0]), np.repeat([0, 1], 20)
    limits = calibrate(healthy(rows, known, at))
    speed, scale = np.log(1500.0), 0.7
    fresh = noise_rows(5, seed=1)
    # One row each that is odd in its colour, too unsteady, too quiet, and too loud.
    fresh.cepstra[1] += 1.0
    fresh.values[2, 0] += 3.0
    fresh.values[3:, 1] += [-3.0, 4.0]
    found = log_p_values(limits, fresh, np.full(5, speed), scale)
    # The equations, row by row, from the covariances themselves.
    beyond = speed - known[1]
    variance = scale * np.sqrt(beyond / UNIT_DISTANCE) + 0.05
    back = np.linalg.inv(limits.axes)
    covariance = back.T @ np.diag(limits.variances + variance + 0.04) @ back
    freedom, more = min(limits.n_blocks, 10) - 1, 1 + 1 / limits.n_blocks
    least = []
    for row in range(5):
        away = fresh.cepstra[row].mean(axis=0) - limits.references[1] @ back
        score = np.log(away @ np.linalg.solve(covariance, away) / len(away) + 1e-3)
        score = (score - limits.score_mean) / limits.score_deviation
        tails = [stats.t.sf(score / np.sqrt(more), freedom)]
        for j, sigma in enumerate((0.4, 0.3)):
            slope, slope_variance = limits.slopes[j]
            expected = limits.means[1, j] + slope * beyond
            spread = (
                limits.deviations[j] ** 2 * more
                + (variance + 0.04) * sigma**2
                + scale * slope_variance * beyond**2
            )
            z = (fresh.values[row, j] - expected) / np.sqrt(spread)
            tails.append(
                stats.t.sf(z, freedom) if j == 0 else 2 * stats.t.sf(abs(z), freedom)
            )
        np.testing.assert_allclose(
            np.exp(found[row]), min(3 * min(tails), 1), rtol=1e-6
        )
        least.append(int(np.argmin(tails)))
        tails[1] = 2 * min(tails[1], 1 - tails[1])
        both = log_p_values(limits, fresh, np.full(5, speed), scale, two_sided=True)
        np.testing.assert_allclose(np.exp(both[row]), min(3 * min(tails), 1), rtol=1e-6)
    assert least[1:] == [0, 1, 2, 2] and np.all(found[1:] < -1)


def test_blocks_are_compared_with_the_others_only():
    # One block is unlike the others: what it is compared with must not hold it.
    rng = np.random.default_rng(0)
    signals = rng.normal(size=(50, 600))
    rows = measure_rows(signals, 1, with_level=False)
    usual = calibrate(healthy(rows, np.zeros(1), np.zeros(50, int)))
    signals[40:] = np.cumsum(signals[40:], axis=1)
    odd = calibrate(
        healthy(
            measure_rows(signals, 1, with_level=False), np.zeros(1), np.zeros(50, int)
        )
    )
    assert odd.n_blocks == usual.n_blocks == 5
    assert odd.score_deviation > 4 * usual.score_deviation


def test_blocks_of_many_speeds_are_distinguished():
    at = np.repeat(np.arange(12), 2)
    limits = calibrate(healthy(noise_rows(24), np.log(500.0 + 50 * np.arange(12)), at))
    assert limits.n_blocks == 24


def test_rows_of_many_windows_scatter_less():
    one, four = (noise_rows(20, n_windows=m) for m in (1, 4))
    limits = [
        calibrate(healthy(rows, np.zeros(1), np.zeros(20, int))) for rows in (one, four)
    ]
    ratio = limits[1].variances.sum() / limits[0].variances.sum()
    assert 0.75 / 4 < ratio < 1.25 / 4


def shares(logs, at, rate):
    return np.array(
        [np.mean(logs[at == speed] < np.log(rate)) for speed in np.unique(at)]
    )


def test_scale_is_twice_the_least_that_holds():
    rows = noise_rows(60)
    known, at = np.log([800.0, 1000.0, 1250.0]), np.repeat([0, 1, 2], 20)
    limits = calibrate(healthy(rows, known, at))
    scale, logs = drift_scale(healthy(rows, known, at), limits)
    assert scale == 2 * healthy_limits.SCALES[0]
    for rate in healthy_limits.HELD_RATES:
        assert shares(logs, at, rate).max() <= rate
    # A level that jumps at the middle speed needs more.
    values = rows.values.copy()
    values[20:40, 1] += 1.5
    moved = rows._replace(values=values)
    scale, logs = drift_scale(
        healthy(moved, known, at), calibrate(healthy(moved, known, at))
    )
    assert scale > 2 * healthy_limits.SCALES[0]
    for rate in healthy_limits.HELD_RATES:
        assert shares(logs, at, rate).max() <= rate
    values[20:40, 1] += 100
    scale, logs = drift_scale(
        healthy(moved, known, at), calibrate(healthy(moved, known, at))
    )
    assert scale == 2 * healthy_limits.SCALES[-1]
    assert shares(logs, at, 0.05).max() > 0.05


@pytest.mark.parametrize(("rate", "n_rows"), [(0.01, 95), (0.05, 19)])
def test_scale_holds_the_stated_rates_to_the_row(monkeypatch, rate, n_rows):
    # One flagged row of so many is a little more than the rate; it is flagged at scales
    # below 1.
    def one_row(limits, rows, log_speed, scale):
        return np.where(
            np.arange(len(log_speed)) == 0, np.log(0.9 * rate) * (scale < 1), -0.1
        )

    rows, at = noise_rows(5).take(np.arange(2 * n_rows) % 5), np.repeat([0, 1], n_rows)
    learned = healthy(rows, np.log([800.0, 1000.0]), at)
    limits = calibrate(learned)
    monkeypatch.setattr(healthy_limits, "log_p_values", one_row)
    assert rate < 1 / n_rows < 1.1 * rate
    assert drift_scale(learned, limits)[0] == 2.0


def test_a_row_at_the_limit_is_not_flagged():
    logs, at = np.log([0.05, 0.04, 0.05, 0.06]), np.array([0, 0, 1, 1])
    weights = np.array([3.0, 1.0, 1.0, 1.0])
    np.testing.assert_array_equal(
        flagged_shares(logs, at, np.log(0.05), weights), [0.25, 0]
    )


def test_many_blocks_have_the_freedom_of_ten():
    rows, at = noise_rows(24), np.zeros(24, int)
    limits = calibrate(healthy(rows, np.zeros(1), at))
    # A level far from its mean decides the p-value alone.
    rows.values[:, 1] = limits.means[0, 1] + 5.0
    for n_blocks, freedom in ((4, 3), (10, 9), (24, 9)):
        found = log_p_values(
            limits._replace(n_blocks=n_blocks), rows, np.zeros(24), 1.0
        )
        spread = limits.deviations[1] ** 2 * (1 + 1 / n_blocks) + 0.09 * 0.3**2
        tail = 2 * stats.t.sf(5.0 / np.sqrt(spread), freedom)
        np.testing.assert_allclose(np.exp(found), 3 * tail, rtol=1e-6)


def test_a_weight_counts_in_the_covariance_and_in_the_scatter_of_blocks():
    rows, at = noise_rows(40), np.zeros(40, int)
    weights = np.random.default_rng(1).uniform(0.5, 4, 40)
    limits = calibrate(healthy(rows, np.zeros(1), at, weights))
    back = np.linalg.inv(limits.axes)
    cepstra = rows.cepstra[:, 0]
    own = np.cov(cepstra.T, aweights=weights, bias=True) * 40 / 39
    few = cepstra.shape[1] / (cepstra.shape[1] + 40)
    expected = (1 - few) * own + few * np.diag(np.diag(own))
    np.testing.assert_allclose(
        back.T @ np.diag(limits.variances) @ back, expected, atol=1e-12
    )
    # Each block of 8 rows next to the mean of the others.
    squares = []
    for block in np.arange(40).reshape(5, 8):
        rest = np.setdiff1d(np.arange(40), block)
        mean = np.average(rows.values[rest], axis=0, weights=weights[rest])
        square = (rows.values[block] - mean) ** 2
        squares.append(np.average(square, axis=0, weights=weights[block]))
    expected = np.sqrt(np.sum(squares, axis=0) / 4)
    np.testing.assert_allclose(limits.deviations, expected)


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


def test_scores_of_left_out_blocks_are_those_of_the_equations():
    # The second speed has fewer rows than there are blocks, so it has no rows in the
    # last two.
    at, rows = np.repeat([0, 1], [10, 3]), noise_rows(13, n_windows=2)
    weights = np.random.default_rng(1).uniform(0.5, 4, 13)
    limits = calibrate(healthy(rows, np.log([900.0, 1000.0]), at, weights))
    means, squares = [], []
    block = np.r_[np.repeat(np.arange(5), 2), 0, 1, 2]
    for speed, number in [(0, number) for number in range(5)] + [
        (1, 0),
        (1, 1),
        (1, 2),
    ]:
        here = np.flatnonzero((block == number) & (at == speed))
        rest = np.flatnonzero((block != number) & (at <= (number < 3)))
        score = literal_score(rows, here, rest, at, weights)
        means.append(np.average(score, weights=weights[here]))
        squares.append(
            np.average((score - limits.score_mean) ** 2, weights=weights[here])
        )
    np.testing.assert_allclose(limits.score_mean, np.mean(means))
    np.testing.assert_allclose(
        limits.score_deviation, np.sqrt(np.mean(squares) * 8 / 7)
    )


def test_left_out_rates_count_weights():
    rows, known, at = noise_rows(60), np.log([800.0, 1000.0]), np.repeat([0, 1], 30)
    rows.values[5, 1] += 1000
    weights = np.where(np.arange(60) == 5, 30.0, 1.0)
    # The limits are those without weights, so that they flag the same row.
    limits = calibrate(healthy(rows, known, at))
    for weight, rate in ((np.ones(60), 1 / 30), (weights, 30 / 59)):
        _, logs = drift_scale(healthy(rows, known, at, weight), limits)
        assert flagged_shares(logs, at, np.log(0.01), weight)[0] == pytest.approx(rate)


def test_limits_are_named_arrays():
    limits = calibrate(healthy(noise_rows(10), np.zeros(1), np.zeros(10, int)))
    assert isinstance(limits, Limits)
    assert all(np.all(np.isfinite(part)) for part in limits)


def test_rows_that_are_all_alike_leave_the_least_deviations():
    one = noise_rows(1)
    rows = Rows(*(np.repeat(part, 10, axis=0) for part in one))
    limits = calibrate(healthy(rows, np.zeros(1), np.zeros(10, int)))
    np.testing.assert_allclose(limits.deviations, 0.02)
    assert limits.score_deviation == 0.05
    np.testing.assert_allclose(limits.score_mean, np.log(1e-3), atol=1e-9)
    np.testing.assert_allclose(limits.variances, 0, atol=1e-20)


def test_drift_and_slopes_are_those_that_are_stated():
    rows = noise_rows(10)
    limits = calibrate(healthy(rows, np.zeros(1), np.zeros(10, int)))
    # One speed has no information on the slopes: what was assumed beforehand remains.
    np.testing.assert_allclose(limits.slopes, [[-0.7, 0.7**2], [1.5, 0.75**2]])
    mean = (
        part.mean(axis=0, keepdims=True)
        for part in (rows.spectral_shape, rows.steadiness)
    )
    drift = limits.axes.T @ drift_covariance(*mean) @ limits.axes
    np.testing.assert_allclose(drift, np.eye(len(drift)), atol=1e-9)


def test_two_rows_have_the_scatter_of_two_rows():
    rows = noise_rows(2)
    limits = calibrate(healthy(rows, np.zeros(1), np.zeros(2, int)))
    back = np.linalg.inv(limits.axes)
    variances = np.diag(back.T @ np.diag(limits.variances) @ back)
    # The unbiased variance of two values is half the square of their difference.
    np.testing.assert_allclose(
        variances, np.diff(rows.cepstra[:, 0], axis=0)[0] ** 2 / 2
    )


def test_only_ratios_of_weights_count():
    rows, at = noise_rows(20), np.zeros(20, int)
    weights = np.linspace(1, 2, 20)
    plain, large = (
        calibrate(healthy(rows, np.zeros(1), at, w)) for w in (weights, 1e200 * weights)
    )
    np.testing.assert_allclose(large.variances, plain.variances, atol=1e-12)
    np.testing.assert_allclose(large.deviations, plain.deviations)


def test_p_values_are_between_the_smallest_number_and_one():
    rows = noise_rows(20)
    limits = calibrate(healthy(rows, np.zeros(1), np.zeros(20, int)))
    usual = Rows(*(np.mean(part, axis=0, keepdims=True) for part in rows))
    assert log_p_values(limits, usual, np.zeros(1), 1.0)[0] == 0
    odd = usual._replace(values=usual.values + 1e150)
    least = np.log(np.finfo(float).tiny) + np.log(3)
    np.testing.assert_allclose(log_p_values(limits, odd, np.zeros(1), 1.0), least)


def test_scales_go_from_an_eighth_to_64():
    scales = healthy_limits.SCALES
    np.testing.assert_allclose(scales[[0, -1]], [1 / 8, 64])
    np.testing.assert_allclose(scales[1:] / scales[:-1], np.sqrt(2))


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
