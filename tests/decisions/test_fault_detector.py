import warnings

import numpy as np
import pytest
import sklearn
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from scipy.signal import lfilter
from sklearn.base import clone
from sklearn.pipeline import Pipeline

from skarxlag import (
    ARXLaguerre,
    FaultDetector,
    load_diagnoser,
    make_detector,
    save_diagnoser,
)
from skarxlag.core.capabilities import Capabilities, capabilities
from skarxlag.core.state import check_state
from skarxlag.decisions.row_outliers import features_of_rows

LENGTH = 1200
RATE = 0.05


def healthy(n, rpm, seed, strikes=0.0):
    """Noise whose colour and level change with speed; a bearing with strikes, on request."""
    rng = np.random.default_rng([seed, int(rpm)])
    noise = rng.normal(size=(n, LENGTH))
    noise[:, rng.integers(150) :: 150] += strikes
    return rpm * lfilter([1], [1, -0.3 - rpm / 4000, 0.3], noise)


def rig(speeds, n, seed, **options):
    X = np.concatenate([healthy(n, rpm, seed, **options) for rpm in speeds])
    return X, np.repeat(np.asarray(speeds, float), n)


@pytest.fixture(scope="module")
def fitted():
    X, rpm = rig((800, 1200), 40, seed=0)
    return FaultDetector(false_alarm_rate=RATE).fit(X, rpm=rpm)


def test_rate_holds_at_a_speed_that_was_left_out():
    n_seeds, n_rows, alarms = 12, 25, 0
    for seed in range(n_seeds):
        X, rpm = rig((800, 1200), 25, seed)
        detector = FaultDetector(false_alarm_rate=RATE).fit(X, rpm=rpm)
        fresh = healthy(n_rows, 1000, 100 + seed)
        alarms += np.sum(detector.predict(fresh, rpm=1000) == -1)
    assert alarms <= stats.binom.isf(1e-3, n_seeds * n_rows, RATE)


def test_rate_of_one_speed_holds_at_another():
    n_seeds, n_rows, alarms = 12, 25, 0
    for seed in range(n_seeds):
        with pytest.warns(UserWarning, match="one speed, 1000 rpm"):
            detector = FaultDetector(false_alarm_rate=RATE).fit(
                healthy(50, 1000, seed), rpm=1000
            )
        alarms += np.sum(
            detector.predict(healthy(n_rows, 1200, 100 + seed), rpm=1200) == -1
        )
    assert alarms <= stats.binom.isf(1e-3, n_seeds * n_rows, RATE)


def test_rate_holds_at_the_speeds_of_fit():
    n_seeds, n_rows, alarms = 12, 25, 0
    for seed in range(n_seeds):
        X, rpm = rig((800, 1200), 25, seed)
        detector = FaultDetector(false_alarm_rate=RATE).fit(X, rpm=rpm)
        alarms += np.sum(
            detector.predict(healthy(n_rows, 800, 100 + seed), rpm=800) == -1
        )
    assert alarms <= stats.binom.isf(1e-3, n_seeds * n_rows, RATE)


def test_strikes_are_found_at_a_speed_that_was_left_out(fitted):
    faulty = healthy(40, 1000, 5, strikes=30.0)
    assert (fitted.predict(faulty, rpm=1000) == -1).mean() > 0.9


def test_limits_widen_with_the_distance_in_speed(fitted):
    faulty = healthy(10, 1200, 5, strikes=30.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        p_values = [
            np.median(fitted.p_values(faulty, rpm=rpm))
            for rpm in (1200, 1300, 1600, 2400, 5000)
        ]
    assert np.all(np.diff(p_values) > 0)


def test_outputs_agree(fitted):
    X = np.concatenate([healthy(10, 1000, 1), healthy(10, 1000, 1, strikes=30.0)])
    p_values, scores = fitted.p_values(X, rpm=1000), fitted.score_samples(X, rpm=1000)
    assert np.all((p_values > 0) & (p_values <= 1))
    np.testing.assert_allclose(np.log(p_values), scores)
    decision = fitted.decision_function(X, rpm=np.full(20, 1000.0))
    np.testing.assert_allclose(decision, scores - np.log(RATE))
    np.testing.assert_array_equal(
        fitted.predict(X, rpm=1000), np.where(p_values < RATE, -1, 1)
    )
    X, rpm = rig((800, 1200), 40, seed=0)
    again = clone(fitted).fit_predict(X, rpm=rpm)
    np.testing.assert_array_equal(again, fitted.predict(X, rpm=rpm))


def test_gain_and_offset_do_not_matter_unless_the_gain_is_fixed(fitted):
    X = healthy(20, 1000, 3)
    gains = np.logspace(-9, 9, 20)[:, np.newaxis]
    scores = fitted.score_samples(X, rpm=1000)
    found = fitted.score_samples(gains * X, rpm=1000)
    np.testing.assert_allclose(found, scores, rtol=1e-6, atol=1e-9)
    found = fitted.score_samples(X + 1e3, rpm=1000)
    np.testing.assert_allclose(found, scores, rtol=1e-5, atol=1e-7)
    X, rpm = rig((800, 1200), 40, seed=0)
    fixed = FaultDetector(false_alarm_rate=RATE, fixed_gain=True).fit(X, rpm=rpm)
    quiet = healthy(20, 1000, 3)
    assert (fixed.predict(quiet, rpm=1000) == -1).mean() <= 0.1
    assert np.all(fixed.predict(20 * quiet, rpm=1000) == -1)
    assert np.all(fixed.predict(quiet / 20, rpm=1000) == -1)
    # Another unit of the sensor, in `fit` and after, changes nothing.
    other = clone(fixed).fit(1e-6 * X, rpm=rpm)
    np.testing.assert_allclose(
        other.score_samples(2e-6 * quiet, rpm=1000),
        fixed.score_samples(2 * quiet, rpm=1000),
        rtol=1e-6,
        atol=1e-9,
    )


def test_unit_of_speed_does_not_matter(fitted):
    X, rpm = rig((800, 1200), 40, seed=0)
    in_hertz = clone(fitted).fit(X, rpm=rpm / 60)
    fresh = healthy(10, 1000, 2)
    np.testing.assert_allclose(
        in_hertz.score_samples(fresh, rpm=1000 / 60),
        fitted.score_samples(fresh, rpm=1000),
    )


def test_what_calibration_found_is_kept(fitted):
    np.testing.assert_allclose(fitted.speeds_, [800, 1200])
    assert fitted.left_out_rates_.shape == (2,)
    assert fitted.left_out_rates_.max() <= RATE
    assert fitted.drift_scale_ >= 0.25
    assert (fitted.n_rows_, fitted.n_windows_, fitted.n_blocks_) == (80, 1, 10)
    assert fitted.axes_.dtype == np.float32


def test_long_rows_are_cut_into_windows():
    X, rpm = rig((800, 1200), 30, seed=0)
    fitted = FaultDetector(false_alarm_rate=RATE, window_length=300).fit(X, rpm=rpm)
    assert fitted.n_windows_ == 4
    expected = fitted.score_samples(X, rpm=rpm)
    fitted.set_params(window_length=100)
    np.testing.assert_array_equal(fitted.score_samples(X, rpm=rpm), expected)


def long_rows(n, rpm, seed, **options):
    """Rows of ten windows."""
    return healthy(10 * n, rpm, seed, **options).reshape(n, -1)


def few_long(X, **options):
    with warnings.catch_warnings():
        # Two rows of one speed: that is what these tests are about.
        warnings.simplefilter("ignore", UserWarning)
        return FaultDetector(window_length=LENGTH, **options).fit(X, rpm=1000)


def test_two_long_rows_find_faults_at_a_small_rate():
    fitted = few_long(long_rows(2, 1000, 0), false_alarm_rate=0.01)
    assert (fitted.n_rows_, fitted.n_windows_, fitted.n_blocks_) == (2, 10, 5)
    assert np.all(fitted.predict(long_rows(10, 1000, 1, strikes=30.0), rpm=1000) == -1)


def test_rate_of_two_long_rows_holds_over_seeds():
    n_seeds, n_rows, alarms = 20, 10, 0
    for seed in range(n_seeds):
        fitted = few_long(long_rows(2, 1000, seed), false_alarm_rate=RATE)
        alarms += np.sum(
            fitted.predict(long_rows(n_rows, 1000, 100 + seed), rpm=1000) == -1
        )
    assert alarms <= stats.binom.isf(1e-3, n_seeds * n_rows, RATE)


def test_limits_of_few_long_rows_are_for_whole_rows():
    # Calibrated on thirds of rows of three windows, or on rows of one window: the
    # scatter differs by the number of windows in the row that is asked about.
    windows = healthy(6, 1000, 0)
    rows = few_long(windows.reshape(2, -1))
    single = few_long(windows)
    np.testing.assert_allclose(3 * rows.variances_, single.variances_, rtol=0.02)
    np.testing.assert_allclose(
        rows.references_, single.references_, rtol=1e-3, atol=1e-3
    )


def test_without_speeds_limits_are_those_of_another_speed():
    X = healthy(60, 1000, 0)
    with pytest.warns(UserWarning, match="rpm is not given, so the limits are those"):
        unknown = FaultDetector(false_alarm_rate=RATE).fit(X)
    assert unknown.speeds_.shape == (0,)
    with pytest.warns(UserWarning, match="one speed, 1000 rpm"):
        known = FaultDetector(false_alarm_rate=RATE).fit(X, rpm=1000)
    faulty = healthy(10, 1000, 5, strikes=15.0)
    scores = unknown.score_samples(faulty)
    np.testing.assert_allclose(scores, known.score_samples(faulty, rpm=1300))
    assert np.all(scores > known.score_samples(faulty, rpm=1000))
    np.testing.assert_array_equal(unknown.score_samples(faulty, rpm=1000), scores)


def test_speeds_are_needed_where_fit_had_them(fitted):
    with pytest.raises(
        ValueError, match=r"rpm == None, expected the speed .* had .800.0, 1200.0. rpm"
    ):
        fitted.predict(healthy(2, 1000, 0))
    others = clone(fitted)
    vars(others).update(vars(fitted) | {"speeds_": np.array([800.12345, 1200.0])})
    with pytest.raises(ValueError, match=r"had \[800.123, 1200.0\] rpm"):
        others.predict(healthy(2, 1000, 0))


@pytest.mark.parametrize(
    ("rpm", "message"),
    [
        (0.0, "rpm of row 0 == 0"),
        ([1000, -5.0, 1000], "rpm of row 1 == -5"),
        ([1000, 1000, np.nan], "rpm of row 2 == nan"),
        (np.inf, "rpm of row 0 == inf"),
        ([1000, 1000], r"rpm.shape == \(2,\), expected one speed for each of 3 rows"),
        ("fast", "rpm must hold numbers, got 'fast'"),
    ],
)
def test_bad_speeds_are_named(fitted, rpm, message):
    X = healthy(3, 1000, 0)
    with pytest.raises(ValueError, match=message):
        FaultDetector().fit(X, rpm=rpm)
    if "rpm of row" not in message:
        with pytest.raises(ValueError, match=r"(rpm must hold|rpm.shape ==)"):
            fitted.predict(X, rpm=rpm)


@pytest.mark.parametrize("rpm", [0.0, -1000.0, np.nan, np.inf, 1000 / 60, 1e9])
def test_rows_at_an_implausible_speed_are_flagged_with_one_warning(fitted, rpm):
    X, speeds = healthy(3, 1000, 0), np.array([1000.0, rpm, 1000.0])
    expected = fitted.p_values(X, rpm=1000)
    with pytest.warns(
        UserWarning, match="1 of 3 rows are treated as rows without a"
    ) as caught:
        p_values = fitted.p_values(X, rpm=speeds)
    assert len(caught) == 1
    np.testing.assert_array_equal(p_values[[0, 2]], expected[[0, 2]])
    assert 0 < p_values[1] < 1e-30
    with pytest.warns(UserWarning, match="rows without a signal"):
        assert fitted.predict(X, rpm=speeds)[1] == -1


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("false_alarm_rate", 0.0),
        ("false_alarm_rate", 1.0),
        ("false_alarm_rate", np.nan),
        ("window_length", 0),
    ],
)
def test_bad_parameters_are_named(name, value):
    with pytest.raises(ValueError, match=name):
        FaultDetector(**{name: value}).fit(healthy(4, 1000, 0))
    with pytest.raises(TypeError, match="fixed_gain"):
        FaultDetector(fixed_gain="yes").fit(healthy(4, 1000, 0))


def test_few_rows_are_said():
    X, rpm = rig((800, 1200), 20, seed=0)
    with pytest.warns(
        UserWarning, match=r"40 healthy rows .*too few.* 1/41 = 0\.024\. .* 99 rows"
    ):
        FaultDetector(false_alarm_rate=0.01).fit(X, rpm=rpm)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        FaultDetector(false_alarm_rate=1 / 41).fit(X, rpm=rpm)


def test_two_rows_are_the_least():
    X = healthy(2, 1000, 0)
    with pytest.warns(UserWarning) as said:
        fitted = FaultDetector(false_alarm_rate=RATE).fit(X)
    assert "2 healthy rows are too few" in str(said[0].message) and len(said) == 2
    assert np.all(fitted.predict(healthy(50, 1000, 1)) == 1)
    with pytest.raises(ValueError, match="largest number of rows of one speed == 1"):
        FaultDetector().fit(X[:1])
    with pytest.raises(
        ValueError,
        match="largest number of rows of one speed == 1, expected at least 2",
    ):
        FaultDetector().fit(X, rpm=[800, 1200])


def few_at_three_speeds():
    X, rpm = rig((700, 800, 1200), 2, seed=0)
    with warnings.catch_warnings():
        # Two rows at each speed: what they are is not of interest here.
        warnings.simplefilter("ignore", UserWarning)
        return FaultDetector().fit(X, rpm=rpm)


def test_far_speeds_are_said():
    X, fitted = healthy(3, 1000, 0), few_at_three_speeds()
    message = "2 of 3 rows at 400 to 2000 rpm .* outside the speeds of fit, 700 to 1200 rpm: limits"
    with pytest.warns(UserWarning, match=message) as said:
        fitted.score_samples(X, rpm=[400, 1000, 2000])
    assert said[0].filename == __file__
    with pytest.warns(UserWarning, match="1 of 3 rows at 2000 to 2000 rpm"):
        fitted.predict(X, rpm=[1000, 1000, 2000])
    with warnings.catch_warnings(action="error"):
        fitted.predict(X, rpm=[700 / 1.3, 1000, 1200 * 1.3])


def test_mean_of_the_speeds_of_the_samples_counts():
    X, rpm = rig((800, 1200), 4, seed=0)
    ramps = rpm[:, np.newaxis] + np.linspace(-50, 50, LENGTH)
    with warnings.catch_warnings(action="ignore"):
        detector = FaultDetector().fit(X, rpm=ramps)
    np.testing.assert_allclose(detector.speeds_, [800, 1200])
    found = detector.score_samples(X, rpm=ramps)
    np.testing.assert_allclose(found, detector.score_samples(X, rpm=rpm))


def test_defaults_and_ranges_are_as_stated():
    noise = np.random.default_rng(0).normal(size=(4, 9600))
    with warnings.catch_warnings(action="ignore"):
        detector = FaultDetector().fit(noise, rpm=1000)
        single = FaultDetector(window_length=1).fit(noise[:, :7], rpm=1000)
        # A row of fewer than 8 samples has no spectrum, so its level counts.
        n_values = [FaultDetector().fit(noise[:, :n]).means_.shape[1] for n in (7, 8)]
    assert detector.offset_ == np.log(0.01)
    assert (detector.n_windows_, detector.drift_scale_, single.n_windows_) == (
        2,
        1.0,
        7,
    )
    assert n_values == [2, 1]


def test_two_rows_of_one_of_the_speeds_are_enough():
    with warnings.catch_warnings(action="ignore"):
        detector = FaultDetector().fit(healthy(3, 1000, 0), rpm=[800, 800, 1200])
    np.testing.assert_allclose(detector.speeds_, [800, 1200])


def test_a_row_at_the_limit_is_not_flagged(fitted):
    at_limit = clone(fitted)
    vars(at_limit).update(vars(fitted))
    row = healthy(1, 1000, 2, strikes=30.0)
    at_limit.offset_ = float(fitted.score_samples(row, rpm=1000)[0])
    assert at_limit.offset_ < np.log(RATE)
    assert at_limit.predict(row, rpm=1000).tolist() == [1]


def test_left_out_speeds_that_hold_the_rate_are_not_warned_of(fitted):
    vars_of = vars(fitted) | {"left_out_rates_": np.array([RATE, 0.0])}
    held = clone(fitted)
    vars(held).update(vars_of)
    assert not any("No drift scale" in sentence for sentence in held._weak_points())


ASKED = {
    "alarm": True,
    "healthy_p_value": True,
    "stated_rate": RATE,
    "window_length": LENGTH,
}


def test_what_it_can_answer(fitted):
    speeds = {"takes_rpm": True, "needs_rpm": True, "speeds": (800.0, 1200.0)}
    two = Capabilities(n_healthy=fitted.n_rows_, **speeds, **ASKED)
    assert capabilities(fitted) == two


def test_one_speed_is_needed_too():
    X = healthy(4, 1000, 0)
    with warnings.catch_warnings(action="ignore"):
        one = FaultDetector(false_alarm_rate=RATE, window_length=LENGTH // 2).fit(
            X, rpm=1000
        )
    speed = {"takes_rpm": True, "needs_rpm": True, "speeds": (1000.0,)}
    of_one_speed = Capabilities(n_healthy=4, is_stretch=True, **speed, **ASKED)
    assert capabilities(one) == of_one_speed
    with pytest.raises(ValueError, match="rpm == None, expected the speed of each row"):
        one.predict(X)


def test_a_speed_that_fit_did_not_know_is_not_looked_at():
    X = healthy(4, 1000, 0)
    with warnings.catch_warnings(action="ignore"):
        none = FaultDetector(false_alarm_rate=RATE).fit(X)
    assert capabilities(none) == Capabilities(n_healthy=4, **ASKED)
    expected = none.score_samples(X)
    with warnings.catch_warnings(action="error"):
        np.testing.assert_array_equal(none.score_samples(X, rpm=123), expected)
    # A speed that no shaft has gives no verdict all the same.
    with pytest.warns(
        UserWarning, match="1 of 4 rows are treated as rows without a signal"
    ):
        found = none.score_samples(X, rpm=[123, 0, 123, 123])
    np.testing.assert_array_equal(found[[0, 2, 3]], expected[[0, 2, 3]])
    assert found[1] < -50


def test_drift_that_no_scale_covers_is_said():
    X, rpm = rig((800, 1000, 1200), 20, seed=0)
    X[20:40] *= 1e60
    with pytest.warns(UserWarning, match=r"No drift scale up to 128 .* 1 at 1000 rpm"):
        FaultDetector(false_alarm_rate=RATE, fixed_gain=True).fit(X, rpm=rpm)


@pytest.mark.parametrize("routing", [False, True])
def test_speeds_reach_the_detector_through_a_pipeline(routing):
    X, rpm = rig((800, 1200), 30, seed=0)
    with sklearn.config_context(enable_metadata_routing=routing):
        detector = make_detector(false_alarm_rate=RATE).fit(X, rpm=rpm)
        found = detector.diagnose(X, rpm=rpm)
        np.testing.assert_array_equal(found.verdict, detector.predict(X, rpm=rpm))
        p_values = detector.p_values(X, rpm=rpm)
    identified = detector["identify"].transform(X)
    np.testing.assert_array_equal(
        p_values, detector["decide"].p_values(identified, rpm=rpm)
    )
    np.testing.assert_allclose(found.score, np.log(p_values / RATE))
    np.testing.assert_allclose(detector.score_samples(X, rpm=rpm), np.log(p_values))


def test_speeds_are_routed_in_a_plain_pipeline():
    X, rpm = rig((800, 1200), 30, seed=0)
    expected = make_detector(false_alarm_rate=RATE).fit(X, rpm=rpm).predict(X, rpm=rpm)
    plain = Pipeline(make_detector(false_alarm_rate=RATE).steps)
    with sklearn.config_context(enable_metadata_routing=True):
        np.testing.assert_array_equal(
            plain.fit(X, rpm=rpm).predict(X, rpm=rpm), expected
        )


def test_saved_and_loaded(tmp_path):
    X, rpm = rig((800, 1200), 30, seed=0)
    detector = make_detector(false_alarm_rate=RATE).fit(X, rpm=rpm)
    save_diagnoser(detector, tmp_path / "detector.skops")
    loaded, _ = load_diagnoser(tmp_path / "detector.skops")
    np.testing.assert_array_equal(
        loaded.p_values(X, rpm=rpm), detector.p_values(X, rpm=rpm)
    )
    check_state(loaded["decide"])


def test_measured_inputs_are_explained_first():
    rng = np.random.default_rng(0)
    torque = np.cumsum(rng.normal(size=(60, LENGTH)), axis=1)
    X = np.stack(
        [rng.normal(size=torque.shape) + 5 * np.roll(torque, 1, axis=1), torque], axis=1
    )
    with pytest.warns(UserWarning, match="one speed"):
        detector = make_detector(false_alarm_rate=RATE).fit(X, rpm=1000)
    assert (detector.predict(X, rpm=1000) == -1).mean() <= 2 * RATE
    with pytest.raises(ValueError, match="models in X == 2, expected 1"):
        FaultDetector().fit(ARXLaguerre().fit_transform(X, np.arange(60) % 2))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("axes_", np.zeros((2, 2))),
        ("references_", np.zeros(3)),
        ("references_", None),
        ("speeds_", None),
        ("speeds_", np.array([1200.0, 800.0])),
        ("speeds_", np.array([-1.0, 800.0])),
        ("variances_", np.float64(1.0)),
        ("variances_", np.full(110, -1.0)),
        ("means_", np.full((2, 1), np.nan)),
        ("slopes_", np.array([[1.0, -1.0]])),
        ("deviations_", np.array([0.0])),
        ("left_out_rates_", np.zeros(5)),
        ("drift_scale_", -1.0),
        ("score_deviation_", 0.0),
        ("offset_", np.nan),
        ("n_windows_", 0),
        ("n_blocks_", 1.5),
    ],
)
def test_inconsistent_states_are_refused(fitted, name, value):
    certain = clone(fitted)
    vars(certain).update(vars(fitted) | {"slopes_": fitted.slopes_ * [1.0, 0.0]})
    check_state(certain)
    check_state(fitted)
    broken = clone(fitted)
    vars(broken).update(vars(fitted) | {name: value})
    with pytest.raises(ValueError, match=name):
        check_state(broken)


@settings(max_examples=20, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    shift=st.floats(-2, 2),
    speeds=st.sets(
        st.sampled_from([600, 800, 1000, 1300, 1700]), min_size=1, max_size=3
    ),
    rates=st.tuples(st.floats(0.001, 0.3), st.floats(0.001, 0.3)).map(sorted),
)
def test_a_row_flagged_at_a_rate_is_flagged_at_every_higher_rate(
    seed, shift, speeds, rates
):
    X, rpm = rig(tuple(sorted(speeds)), 6, seed=seed)
    new = healthy(8, 900, seed=seed) * np.exp(shift)
    new[:, ::50] += shift * new.std()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        low, high = (
            FaultDetector(false_alarm_rate=rate, fixed_gain=True).fit(X, rpm=rpm)
            for rate in rates
        )
        np.testing.assert_array_equal(
            low.p_values(new, rpm=900), high.p_values(new, rpm=900)
        )
        flagged = [detector.predict(new, rpm=900) == -1 for detector in (low, high)]
    assert np.all(flagged[0] <= flagged[1])


@pytest.mark.parametrize("rpm", [12.5, 1e9, 0.001])
def test_rows_at_implausible_speeds_are_flagged_with_one_warning(fitted, rpm):
    X, _ = rig((800, 1200), 4, seed=1)
    speeds = np.array([800.0, *[rpm] * 3, *[1200.0] * 4])
    with pytest.warns(
        UserWarning, match="3 of 8 rows are treated as rows without a"
    ) as said:
        p_values = fitted.p_values(X, rpm=speeds)
    assert len(said) == 1
    assert np.all(p_values[1:4] < 1e-30) and np.all(
        np.delete(p_values, [1, 2, 3]) > 1e-6
    )


def test_rows_of_more_windows_than_a_batch_are_measured_one_by_one():
    rows = np.random.default_rng(0).normal(size=(3, 1, 65 * 100))
    together = features_of_rows(rows, 65, with_level=True, n_jobs=None)
    for number in range(3):
        single = features_of_rows(rows[[number]], 65, with_level=True, n_jobs=None)
        for all_rows, row in zip(together, single, strict=True):
            np.testing.assert_array_equal(all_rows[[number]], row)
