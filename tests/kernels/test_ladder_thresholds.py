import numpy as np
import pytest
from scipy.special import softmax

from skarxlag.kernels.ladder import (
    confidence_scale,
    false_alarm_threshold,
    log_level,
    relative_scores,
    rows_that_hold,
    rung_scores,
)


@pytest.mark.parametrize("n", [1, 9, 19, 99, 100, 199])
@pytest.mark.parametrize("percent", [1, 5, 10, 29, 42, 58, 90])
def test_threshold_is_the_conformal_order_statistic(n, percent):
    # ceil((n + 1)(1 - rate)) in whole numbers.
    rank = min(-(-(n + 1) * (100 - percent) // 100), n)
    levels = np.random.default_rng(0).permutation(np.arange(1.0, n + 1))
    assert false_alarm_threshold(levels, np.ones(len(levels)), percent / 100) == rank


@pytest.mark.parametrize(
    ("rate", "n"), [(0.03, 33), (0.01, 99), (1 / 3, 2), (0.5, 1), (0.7, 1)]
)
def test_rows_that_hold_a_rate_are_the_fewest(rate, n):
    assert rows_that_hold(rate) == n


def test_rate_holds_on_fresh_exchangeable_windows():
    rng = np.random.default_rng(0)
    rate, alarms, n_trials = 0.1, 0, 4000
    for _ in range(n_trials):
        *healthy, fresh = rng.lognormal(size=30)
        alarms += fresh > false_alarm_threshold(
            np.array(healthy), np.ones(len(healthy)), rate
        )
    # (31 - 28) / 31 exactly; five standard deviations either way.
    expected = 3 / 31
    slack = 5 * np.sqrt(expected * (1 - expected) / n_trials)
    assert expected <= rate
    assert abs(alarms / n_trials - expected) < slack


def test_log_level_is_finite_at_zero():
    assert np.isfinite(log_level([0.0, 5e-324, 1e308])).all()
    assert np.all(np.diff(log_level([0.0, 5e-324, 1.0])) > 0)


def test_rungs_of_equation_32():
    cuts = np.array([0.5, 1, 2, 3, 4, 6, 8])
    inside = np.array([0.0, 0.3, 0.7, 1.5, 2.5, 3.5, 5.0, 7.0, 9.0, 1e300])
    rung = np.argmax(rung_scores(inside, cuts), axis=1)
    np.testing.assert_array_equal(rung, [0, 0, 1, 2, 3, 4, 5, 6, 7, 7])


def test_bands_are_half_open():
    cuts = np.array([0.5, 1, 2])
    np.testing.assert_array_equal(np.argmax(rung_scores(cuts, cuts), axis=1), [0, 1, 2])
    above = np.argmax(rung_scores(cuts * (1 + 1e-8), cuts), axis=1)
    np.testing.assert_array_equal(above, [1, 2, 3])


def test_equal_cuts_leave_an_empty_rung():
    scores = rung_scores(np.array([0.9, 1.0, 1.1]), np.array([1.0, 1.0]))
    np.testing.assert_array_equal(np.argmax(scores, axis=1), [0, 0, 2])


def test_relative_scores_are_distances_to_the_geometric_mean():
    levels = np.array([[1.0, 10.0, 100.0]])
    np.testing.assert_allclose(
        relative_scores(levels), [[np.log(10), 0, -np.log(10)]], atol=1e-12
    )
    np.testing.assert_allclose(
        relative_scores(7e200 * levels), relative_scores(levels), atol=1e-9
    )


@pytest.mark.parametrize("scale", [0.5, 2.0, 8.0])
@pytest.mark.parametrize("n_classes", [2, 4])
def test_confidence_scale_recovers_a_softmax_model(scale, n_classes):
    rng = np.random.default_rng(0)
    scores = rng.normal(size=(20_000, n_classes))
    chances = softmax(scale * scores, axis=1)
    target = (rng.random((len(scores), 1)) > chances.cumsum(axis=1)).sum(axis=1)
    assert confidence_scale(scores, target, np.ones(len(target))) == pytest.approx(
        scale, rel=0.06
    )


def test_confidence_scale_is_finite_where_nothing_errs_and_one_for_one_class():
    scores = np.array([[1.0, 0.0], [0.0, 1.0]] * 5)
    scale = confidence_scale(scores, np.array([0, 1] * 5), np.ones(10))
    # Platt: five windows of a class count as 6/7 certain, so exp(scale) = 6.
    assert scale == pytest.approx(np.log(6), rel=1e-3)
    assert confidence_scale(np.zeros((3, 1)), np.zeros(3, dtype=int), np.ones(3)) == 1.0


@pytest.mark.parametrize(("sign", "bound"), [(1, 10), (-1, -10)])
def test_confidence_scale_of_scores_that_hardly_differ_or_always_err_is_bounded(
    sign, bound
):
    scores = np.array([[1.0, 0.0], [0.0, 1.0]] * 5) * sign * (1e-9 if sign > 0 else 1.0)
    scale = confidence_scale(scores, np.array([0, 1] * 5), np.ones(10))
    assert np.log(scale) == pytest.approx(bound, abs=0.01)
