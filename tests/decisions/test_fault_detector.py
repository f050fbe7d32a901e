import contextlib
import warnings

import numpy as np
import pytest
from scipy import stats
from scipy.signal import lfilter

from skarxlag import FaultDetector, make_detector
from skarxlag.core.capabilities import capabilities
from skarxlag.core.state import check_state

from . import outliers
from .outliers import LENGTH, RATE, changed


def healthy(n, rpm, seed, impacts=0.0):
    """Noise whose spectral shape and level change with speed, and impacts on request."""
    rng = np.random.default_rng([seed, int(rpm)])
    noise = rng.normal(size=(n, LENGTH))
    noise[:, rng.integers(150) :: 150] += impacts
    return rpm * lfilter([1], [1, -0.3 - rpm / 4000, 0.3], noise)


def rig(speeds, n, seed=0):
    X = np.concatenate([healthy(n, rpm, seed) for rpm in speeds])
    return X, np.repeat(np.asarray(speeds, float), n)


def long_rows(n, rpm, seed, **options):
    """Rows of ten windows."""
    return healthy(10 * n, rpm, seed, **options).reshape(n, -1)


def fit(X, rpm=None, **options):
    detector = FaultDetector(**({"false_alarm_rate": RATE} | options))
    return outliers.fit(detector, X, rpm=rpm)


@contextlib.contextmanager
def warned(texts):
    """Expect these warnings, and no other one, for a line of this file."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        yield
    assert len(caught) == len(texts)
    for warning, text in zip(caught, texts, strict=True):
        assert text in str(warning.message)
        assert warning.filename == __file__


@pytest.fixture(scope="module")
def rows():
    return rig((800, 1200), 40)


@pytest.fixture(scope="module")
def fitted(rows):
    X, rpm = rows
    return fit(X, rpm)


@pytest.mark.parametrize(
    ("speeds", "n", "tested", "draw"),
    [
        ((800, 1200), 25, 1000, healthy),
        ((800, 1200), 25, 800, healthy),
        ((1000,), 50, 1200, healthy),
        ((1000,), 2, 1000, long_rows),
    ],
    ids=["left-out speed", "speed of fit", "one speed", "two long rows"],
)
def test_stated_rate_holds_over_seeds(speeds, n, tested, draw):
    n_seeds, n_rows, alarms = 16, 20, 0
    for seed in range(n_seeds):
        X = np.concatenate([draw(n, rpm, seed) for rpm in speeds])
        detector = fit(X, np.repeat(speeds, n), window_length=LENGTH)
        new = draw(n_rows, tested, 100 + seed)
        with warnings.catch_warnings(action="ignore"):
            alarms += np.sum(detector.predict(new, rpm=tested) == -1)
    assert alarms <= stats.binom.isf(1e-3, n_seeds * n_rows, RATE)


def test_impacts_are_found_at_a_speed_that_was_left_out(fitted):
    faulty = healthy(40, 1000, 5, impacts=30.0)
    assert (fitted.predict(faulty, rpm=1000) == -1).mean() > 0.9


def test_two_long_rows_find_faults_at_a_small_rate():
    detector = fit(
        long_rows(2, 1000, 0), 1000, window_length=LENGTH, false_alarm_rate=0.01
    )
    assert (detector.n_rows_, detector.n_windows_, detector.n_blocks_) == (2, 10, 5)
    faulty = long_rows(10, 1000, 1, impacts=30.0)
    assert np.all(detector.predict(faulty, rpm=1000) == -1)


def test_limits_widen_with_the_distance_in_speed(fitted):
    faulty = healthy(10, 1200, 5, impacts=30.0)
    with warnings.catch_warnings(action="ignore"):
        p_values = [
            np.median(fitted.p_values(faulty, rpm=rpm))
            for rpm in (1200, 1300, 1600, 2400, 5000)
        ]
    assert np.all(np.diff(p_values) > 0)


def test_a_fixed_gain_counts_on_both_sides(rows):
    X, rpm = rows
    fixed = fit(X, rpm, fixed_gain=True)
    new = healthy(20, 1000, 3)
    assert (fixed.predict(new, rpm=1000) == -1).mean() <= 0.1
    for gain in (20, 1 / 20):
        assert np.all(fixed.predict(gain * new, rpm=1000) == -1)


def test_attributes_describe_the_calibration(fitted):
    np.testing.assert_allclose(fitted.speeds_, [800, 1200])
    assert fitted.left_out_rates_.shape == (2,)
    assert fitted.left_out_rates_.max() <= RATE
    assert fitted.drift_scale_ >= 2**-2.5
    assert (fitted.n_rows_, fitted.n_windows_, fitted.n_blocks_) == (80, 1, 10)


def test_without_speeds_limits_are_those_of_another_speed():
    X = healthy(60, 1000, 0)
    unknown = fit(X)
    known = fit(X, 1000)
    assert unknown.speeds_.shape == (0,)
    faulty = healthy(10, 1000, 5, impacts=15.0)
    scores = unknown.score_samples(faulty)
    np.testing.assert_allclose(scores, known.score_samples(faulty, rpm=1300))
    assert np.all(scores > known.score_samples(faulty, rpm=1000))
    with warnings.catch_warnings(action="error"):
        ignored = unknown.score_samples(faulty, rpm=123)
    np.testing.assert_array_equal(ignored, scores)


def test_speeds_are_needed_if_fit_had_them(fitted):
    message = r"rpm is missing, .* as in fit, which had \[800.0, 1200.0\] rpm"
    with pytest.raises(ValueError, match=message):
        fitted.predict(healthy(2, 1000, 0))


FEW = "are too few to hold the rate"


@pytest.mark.parametrize(
    ("n", "rpm", "rate", "texts"),
    [
        (20, [800, 1200], 0.01, [f"40 healthy rows {FEW} 0.01 without"]),
        (20, [800, 1200], 0.01, ["They hold 1/41 = 0.024. Use at least 99 rows."]),
        (20, [800, 1200], 1 / 41, []),
        (2, None, RATE, [f"2 healthy rows {FEW}", "rpm is not given, so the limits"]),
        (99, [1000], 0.01, ["one speed, 1000 rpm"]),
    ],
)
def test_weak_calibrations_are_warned_of(n, rpm, rate, texts):
    X, speeds = rig(rpm or [1000], n)
    with warned(texts):
        FaultDetector(false_alarm_rate=rate).fit(X, rpm=None if rpm is None else speeds)


def test_drift_that_no_scale_covers_is_warned_of():
    X, rpm = rig((800, 1000, 1200), 20)
    X[20:40] *= 1e60
    with pytest.warns(
        UserWarning, match=r"No drift scale up to 90.5097 .* 1 at 1000 rpm"
    ):
        FaultDetector(false_alarm_rate=RATE, fixed_gain=True).fit(X, rpm=rpm)


def test_left_out_speeds_that_just_hold_the_rate_are_not_warned_of(rows):
    X, rpm = rows
    X = X.copy()
    X[0, ::300] += 1e9
    # One row of the 40 at 800 rpm is flagged.
    detector = fit(X, rpm, false_alarm_rate=1 / 40)
    assert detector.left_out_rates_.max() == 1 / 40
    with warned([]):
        FaultDetector(false_alarm_rate=1 / 40).fit(X, rpm=rpm)


def test_two_rows_of_one_speed_are_the_least():
    detector = fit(healthy(2, 1000, 0))
    assert np.all(detector.predict(healthy(50, 1000, 1)) == 1)
    detector = fit(healthy(3, 1000, 0), [800, 800, 1200])
    np.testing.assert_allclose(detector.speeds_, [800, 1200])
    message = "largest number of rows of one speed: 1, expected at least 2"
    for n, rpm in ((1, None), (2, [800, 1200])):
        with pytest.raises(ValueError, match=message):
            FaultDetector().fit(healthy(n, 1000, 0), rpm=rpm)


@pytest.mark.parametrize(
    ("rpm", "texts"),
    [
        (
            [400, 1000, 2000],
            [
                "2 of 3 rows at 400 to 2000 rpm lie more than the factor 1.3 outside the "
                "speeds of fit, 700 to 1200 rpm: limits are wide"
            ],
        ),
        ([1000, 1000, 2000], ["1 of 3 rows at 2000 to 2000 rpm"]),
        ([700 / 1.3, 1000, 1200 * 1.3], []),
    ],
)
def test_rows_far_outside_the_speeds_of_fit_are_warned_of(rpm, texts):
    detector = fit(*rig((700, 800, 1200), 2))
    with warned(texts):
        detector.score_samples(healthy(3, 1000, 0), rpm=rpm)


def test_mean_of_the_speeds_of_the_samples_counts():
    X, rpm = rig((800, 1200), 4)
    ramps = rpm[:, np.newaxis] + np.linspace(-50, 50, LENGTH)
    detector = fit(X, ramps)
    np.testing.assert_allclose(detector.speeds_, [800, 1200])
    scores = detector.score_samples(X, rpm=ramps)
    np.testing.assert_allclose(scores, detector.score_samples(X, rpm=rpm))


@pytest.mark.parametrize(("n_samples", "n_values"), [(7, 2), (8, 1)])
def test_the_level_of_rows_without_a_spectrum_counts(n_samples, n_values):
    noise = np.random.default_rng(0).normal(size=(4, n_samples))
    detector = fit(noise, 1000, window_length=1)
    assert detector.n_windows_ == n_samples
    assert detector.means_.shape == (1, n_values)


def test_a_row_at_the_limit_is_not_flagged(fitted):
    row = healthy(1, 1000, 2, impacts=30.0)
    score = float(fitted.score_samples(row, rpm=1000)[0])
    assert score < np.log(RATE)
    assert changed(fitted, offset_=score).predict(row, rpm=1000).tolist() == [1]


@pytest.mark.parametrize(
    ("rpm", "expected"),
    [
        (None, (False, False, ())),
        (1000, (True, True, (1000.0,))),
        ([800, 800, 1200, 1200], (True, True, (800.0, 1200.0))),
    ],
)
def test_capabilities_depend_on_the_speeds_of_fit(rpm, expected):
    detector = fit(healthy(4, 1000, 0), rpm, window_length=LENGTH // 2)
    found = capabilities(detector)
    assert found.limits.startswith("4 healthy rows") and found.stated_rate == RATE
    assert found.healthy_p_value and found.n_healthy == 4 and found.is_stretch
    assert (found.takes_rpm, found.needs_rpm, found.speeds) == expected


def test_measured_inputs_are_explained_first():
    rng = np.random.default_rng(0)
    torque = np.cumsum(rng.normal(size=(60, LENGTH)), axis=1)
    output = rng.normal(size=torque.shape) + 5 * np.roll(torque, 1, axis=1)
    X = np.stack([output, torque], axis=1)
    with pytest.warns(UserWarning, match="one speed"):
        detector = make_detector(false_alarm_rate=RATE).fit(X, rpm=1000)
    assert (detector.predict(X, rpm=1000) == -1).mean() <= 2 * RATE


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("references_", np.zeros(3)),
        ("speeds_", np.array([1200.0, 800.0])),
        ("variances_", np.full(125, -1.0)),
        ("deviations_", np.array([0.0])),
        ("left_out_rates_", np.zeros(5)),
        ("drift_scale_", -1.0),
        ("score_deviation_", 0.0),
        ("n_windows_", 0),
    ],
)
def test_inconsistent_states_are_refused(fitted, name, value):
    with pytest.raises(ValueError, match=name):
        check_state(changed(fitted, **{name: value}))


@pytest.mark.parametrize("speeds", [(900,), (600, 1300), (800, 1000, 1700)])
def test_a_row_flagged_at_a_rate_is_flagged_at_every_higher_rate(speeds):
    X, rpm = rig(speeds, 6)
    new = healthy(60, 900, 1) * np.logspace(-1, 1, 60)[:, np.newaxis]
    with warnings.catch_warnings(action="ignore"):
        low, high = (
            fit(X, rpm, false_alarm_rate=rate, fixed_gain=True).diagnose(new, rpm=900)
            for rate in (0.001, 0.3)
        )
    np.testing.assert_array_equal(low.p_values, high.p_values)
    assert np.all(low.alarm <= high.alarm) and low.alarm.sum() < high.alarm.sum()


def test_fixed_gain_is_a_flag():
    with pytest.raises(TypeError, match="fixed_gain"):
        FaultDetector(fixed_gain="yes").fit(healthy(4, 1000, 0))


def test_a_speed_that_no_shaft_has_is_flagged_without_speeds_in_fit():
    X = healthy(4, 1000, 0)
    detector = fit(X)
    expected = detector.score_samples(X)
    with warned(["1 of 4 rows are treated as rows without a signal"]):
        scores = detector.score_samples(X, rpm=[123, 0, 123, 123])
    np.testing.assert_array_equal(scores[[0, 2, 3]], expected[[0, 2, 3]])
    assert scores[1] < -50
