import numpy as np
import pandas as pd
import pytest
from scipy.special import softmax

from skarxlag import ThresholdLadder
from skarxlag.core.capabilities import capabilities
from skarxlag.core.state import check_state

LEVELS = np.array([0.4, 0.5, 1.0, 1.2, 3.0, 3.2])
NAMES = np.array(["normal", "normal", "ball", "ball", "inner", "inner"])


def test_six_windows_by_hand():
    ladder = ThresholdLadder(false_alarm_rate=0.1).fit(LEVELS[:, np.newaxis], NAMES)
    np.testing.assert_array_equal(ladder.rungs_, ["normal", "ball", "inner"])
    np.testing.assert_array_equal(ladder.classes_, ["ball", "inner", "normal"])
    assert ladder.healthy_index_ == 2
    # Two healthy levels: the larger. Medians 1.1 and 3.1.
    assert ladder.detection_threshold_ == 0.5
    np.testing.assert_allclose(ladder.isolation_thresholds_, [0.5, np.sqrt(1.1 * 3.1)])
    cut = ladder.isolation_thresholds_[1]
    asked = [[0.0], [0.5], [0.500001], [cut], [cut * 1.000001], [1e9]]
    expected = ["normal", "normal", "ball", "ball", "inner", "inner"]
    np.testing.assert_array_equal(ladder.predict(asked), expected)
    np.testing.assert_array_equal(
        ladder.detect(asked), [False, False, True, True, True, True]
    )


def test_four_windows_by_hand_where_the_healthy_condition_is_not_the_lowest():
    X, y = [[2.0], [8.0], [1.0], [1.0]], ["good", "good", "seized", "seized"]
    ladder = ThresholdLadder(healthy="good").fit(X, y)
    np.testing.assert_array_equal(ladder.rungs_, ["seized", "good"])
    # Gamma is then no cut: the geometric mean of the medians 1 and 5 is.
    assert ladder.detection_threshold_ == 8.0
    np.testing.assert_allclose(ladder.isolation_thresholds_, [np.sqrt(5)])
    np.testing.assert_array_equal(
        ladder.predict([[2.2], [2.3], [9.0]]), ["seized", "good", "good"]
    )
    np.testing.assert_array_equal(
        ladder.detect([[2.2], [2.3], [9.0]]), [False, False, True]
    )


@pytest.mark.parametrize(
    ("names", "stated", "healthy"),
    [
        (["worn", "bent"], None, None),
        (["worn", "bent"], "bent", "bent"),
        (["normal", "bent"], None, "normal"),
    ],
)
def test_the_lowest_condition_need_not_be_healthy(names, stated, healthy):
    X = np.array([[1.0], [1.1], [3.0], [3.1]])
    described = capabilities(
        ThresholdLadder(healthy=stated).fit(X, np.repeat(names, 2))
    )
    assert (described.alarm, described.healthy) == (healthy is not None, healthy)


def test_rungs_of_equation_32_in_any_order_of_labels():
    # Medians whose geometric means are the paper's cuts.
    cuts, medians = [0.5, 1, 2, 3, 4, 6, 8], [0.36]
    for cut in cuts:
        medians.append(cut**2 / medians[-1])
    for seed in range(3):
        names = np.random.default_rng(seed).permutation(list("abcdefgh"))
        ladder = ThresholdLadder().fit(
            np.repeat(medians, 3)[:, np.newaxis], np.repeat(names, 3)
        )
        np.testing.assert_array_equal(ladder.rungs_, names)
        assert ladder.detection_threshold_ == pytest.approx(0.36)
        np.testing.assert_allclose(ladder.isolation_thresholds_[1:], cuts[1:])
        middles = np.array([[0.1], [0.7], [1.5], [2.5], [3.5], [5], [7], [20]])
        np.testing.assert_array_equal(ladder.predict(middles), names)


def test_a_threshold_above_the_next_cut_leaves_no_band_between():
    X = [[1.0], [50.0], [2.0], [2.0], [4.0], [4.0], [900.0], [900.0]]
    ladder = ThresholdLadder(healthy=0).fit(
        X[:1] * 2 + X[1:], [0, 0, 0, 1, 1, 2, 2, 3, 3]
    )
    assert np.all(np.diff(ladder.isolation_thresholds_) >= 0)
    np.testing.assert_array_equal(ladder.predict([[49.0], [55.0], [60.1]]), [0, 2, 3])


def test_bank_takes_the_smallest_residual():
    X = np.array([[1.0, 3.0, 4.0], [2.0, 1.0, 5.0], [9.0, 8.0, 7.0], [9.0, 7.0, 6.0]])
    ladder = ThresholdLadder().fit(X, ["a", "b", "c", "c"])
    np.testing.assert_array_equal(ladder.predict(X), ["a", "b", "c", "c"])
    # Its Delta: own residual over the geometric mean of all, the largest of its
    # windows.
    means = np.exp(np.log(X).mean(axis=1))
    expected = [1 / means[0], 1 / means[1], max(7 / means[2], 6 / means[3])]
    np.testing.assert_allclose(ladder.isolation_thresholds_, expected)
    # Gamma is on the healthy model's own residual.
    assert ladder.healthy_index_ == 0
    assert ladder.detection_threshold_ == 1.0
    np.testing.assert_array_equal(
        ladder.detect([[1.0, 0.1, 0.1], [1.1, 9, 9]]), [False, True]
    )
    of_last = ThresholdLadder(healthy="c").fit(X, list("abcc"))
    assert of_last.detection_threshold_ == 7.0


def test_what_is_common_to_all_residuals_of_a_bank_cancels():
    rng = np.random.default_rng(0)
    X, y = rng.lognormal(size=(40, 4)), np.arange(40) % 4
    X[np.arange(40), y] /= 3
    ladder = ThresholdLadder().fit(X, y)
    factor = rng.lognormal(sigma=3, size=(40, 1))
    np.testing.assert_array_equal(ladder.predict(X * factor), ladder.predict(X))
    np.testing.assert_allclose(
        ladder.predict_proba(X * factor), ladder.predict_proba(X), rtol=1e-9
    )


@pytest.mark.parametrize("n_residuals", [1, 2, 3, 4])
@pytest.mark.parametrize("n_classes", [2, 3])
def test_verdict_is_the_highest_score_and_probabilities_sum_to_one(
    n_residuals, n_classes
):
    rng = np.random.default_rng(n_residuals)
    y = np.arange(60) % n_classes
    X = rng.lognormal(size=(60, n_residuals)) * (1 + y[:, np.newaxis])
    ladder = ThresholdLadder().fit(X, y)
    probability = ladder.predict_proba(X)
    score = ladder.decision_function(X)
    if n_classes == 2:
        assert score.shape == (60,)
        verdict = (score > 0).astype(int)
    else:
        verdict = np.argmax(score, axis=1)
        np.testing.assert_allclose(
            probability, softmax(ladder.confidence_scale_ * score, axis=1), rtol=1e-6
        )
    np.testing.assert_array_equal(ladder.predict(X), verdict)
    np.testing.assert_array_equal(np.argmax(probability, axis=1), verdict)
    np.testing.assert_allclose(probability.sum(axis=1), 1)


def test_other_numbers_of_residuals_are_combined_to_their_rms():
    rng = np.random.default_rng(0)
    y = np.arange(30) % 3
    X = rng.lognormal(sigma=0.2, size=(30, 5)) * 3.0 ** y[:, np.newaxis]
    combined = np.sqrt(np.mean(X**2, axis=1))[:, np.newaxis]
    one, other = ThresholdLadder().fit(X, y), ThresholdLadder().fit(combined, y)
    np.testing.assert_allclose(one.isolation_thresholds_, other.isolation_thresholds_)
    assert one.detection_threshold_ == pytest.approx(other.detection_threshold_)
    np.testing.assert_allclose(
        one.decision_function(X), other.decision_function(combined)
    )
    np.testing.assert_array_equal(one.detect(X), other.detect(combined))


def test_signed_residuals_count_by_their_size():
    signs = np.array([1, -1, -1, 1, 1, -1])
    plain = ThresholdLadder().fit(LEVELS[:, np.newaxis], NAMES)
    signed = ThresholdLadder().fit((signs * LEVELS)[:, np.newaxis], NAMES)
    np.testing.assert_array_equal(
        signed.isolation_thresholds_, plain.isolation_thresholds_
    )
    np.testing.assert_array_equal(signed.detect([[-1.1], [-0.1]]), [True, False])


@pytest.mark.parametrize(
    "names",
    [
        [0, 1, 2],
        np.array(["n", "b", "i"], dtype=object),
        pd.array(["n", "b", "i"], dtype="string"),
    ],
    ids=["int", "object", "pandas"],
)
def test_labels_of_any_dtype(names):
    y = pd.Series(names).repeat(2) if hasattr(names, "isna") else np.repeat(names, 2)
    ladder = ThresholdLadder(healthy=names[0]).fit(LEVELS[:, np.newaxis], y)
    np.testing.assert_array_equal(ladder.rungs_, np.asarray(names))
    np.testing.assert_array_equal(ladder.predict(LEVELS[:, np.newaxis]), np.asarray(y))


@pytest.mark.parametrize("factor", [1e-300, 1e-30, 1e300])
def test_ladder_is_equivariant_to_scale(factor):
    X = LEVELS[:, np.newaxis]
    plain, scaled = (
        ThresholdLadder().fit(X, NAMES),
        ThresholdLadder().fit(X * factor, NAMES),
    )
    np.testing.assert_allclose(
        scaled.isolation_thresholds_, plain.isolation_thresholds_ * factor, rtol=1e-12
    )
    np.testing.assert_array_equal(scaled.predict(X * factor), plain.predict(X))


def test_silent_windows_are_on_the_lowest_rung():
    ladder = ThresholdLadder().fit([[0.0], [0.0], [1.0], [1.0]], [0, 0, 1, 1])
    np.testing.assert_array_equal(ladder.predict([[0.0], [1.0]]), [0, 1])
    bank = ThresholdLadder().fit([[0.0, 1.0], [0.0, 0.0], [1.0, 0.0]], [0, 0, 1])
    assert np.isfinite(bank.predict_proba([[0.0, 0.0], [0.0, 1.0]])).all()


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("false_alarm_rate", 0.0, "false_alarm_rate"),
        ("false_alarm_rate", 1.0, "false_alarm_rate"),
        ("healthy", 3, "healthy == 3"),
        ("healthy", "absent", r"healthy == 'absent'.*\['ball', 'inner', 'normal'\]"),
    ],
)
def test_bad_parameters_are_named(name, value, message):
    with pytest.raises(ValueError, match=message):
        ThresholdLadder(**{name: value}).fit(LEVELS[:, np.newaxis], NAMES)


BANK = ThresholdLadder().fit(np.eye(3) + 1, list("abc"))
ONE = ThresholdLadder().fit([[1.0], [2.0], [3.0]], list("abc"))


@pytest.mark.parametrize(
    ("fitted", "name", "value", "is_possible"),
    [
        (ONE, "isolation_thresholds_", np.array([0.5, 0.25]), False),
        (ONE, "isolation_thresholds_", np.array([-1.0, 0.25]), False),
        (BANK, "isolation_thresholds_", np.array([0.5, 0.0, 0.25]), True),
        (BANK, "isolation_thresholds_", np.array([0.5, -0.5, 0.25]), False),
        (ONE, "rungs_", np.array(["a", "b", "d"]), False),
    ],
)
def test_states_that_fit_can_make_are_accepted(fitted, name, value, is_possible):
    altered = ThresholdLadder()
    vars(altered).update(vars(fitted) | {name: value})
    if is_possible:
        check_state(altered)
    else:
        with pytest.raises(ValueError, match=name):
            check_state(altered)
