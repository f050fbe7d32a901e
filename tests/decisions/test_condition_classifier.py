"""Classifier of conditions: what it learns of locations, noise and specimens."""

import warnings

import numpy as np
import pytest
from scipy.signal import lfilter

from skarxlag import ConditionClassifier, make_diagnoser
from skarxlag.distances.stretches import window_comparison
from skarxlag.kernels import posterior
from skarxlag.kernels.coloured_noises import coloured_noises

pytestmark = pytest.mark.filterwarnings("ignore:rpm is not given:UserWarning")
LENGTH = 2400


def rows(pole, n, seed, spread=0.0):
    """Noise of one colour; with a spread, each row has a pole of its own."""
    rng = np.random.default_rng(seed)
    poles = pole + spread * rng.normal(size=n)
    return np.stack([lfilter([1], [1, -a], rng.normal(size=LENGTH)) for a in poles])


def classifier(**options):
    """Compare windows only, which takes a tenth of the time."""
    return ConditionClassifier(residual=window_comparison(), **options)


@pytest.fixture(scope="module")
def data():
    X = np.concatenate([rows(a, 12, i) for i, a in enumerate((0.0, 0.5, 0.6, -0.6))])
    return X, np.repeat(["Normal", "IR2", "IR5", "OR2"], 12)


@pytest.fixture(scope="module")
def fitted(data):
    return ConditionClassifier().fit(*data)


def test_locations_and_the_healthy_condition_follow_from_the_names(fitted):
    assert fitted.classes_.tolist() == ["IR2", "IR5", "Normal", "OR2"]
    assert fitted.class_locations_.tolist() == [1, 1, 3, 2]
    assert fitted.healthy_index_ == 2
    assert fitted.n_specimens_.tolist() == [1, 1, 1, 1]


@pytest.mark.parametrize(
    ("has_numbers", "options", "locations", "healthy", "warned"),
    [
        (True, {}, [4, 5, 6, 7], -1, []),
        (True, {"locations": {0: "ball"}, "healthy": 2}, [0, 4, 3, 5], 2, [1, 3]),
        # A stated healthy condition is the only one, whatever other names say.
        (False, {"healthy": "OR2"}, [1, 1, 4, 3], 3, ["Normal"]),
    ],
)
def test_locations_can_be_stated(
    data, has_numbers, options, locations, healthy, warned
):
    X, y = data
    labels = np.unique(y, return_inverse=True)[1] if has_numbers else y
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        fitted = classifier(**options).fit(X, labels, rpm=900)
    assert fitted.class_locations_.tolist() == locations
    assert fitted.healthy_index_ == healthy
    named = [f"{warned} state no fault location"] if warned else []
    assert len(caught) == len(named)
    for warning, message in zip(caught, named, strict=True):
        assert message in str(warning.message) and "locations=" in str(warning.message)


def test_conditions_next_to_no_located_fault_need_no_location(data):
    X, y = data
    names = {"Normal": "Normal", "OR2": "loose", "IR2": "worn", "IR5": "worn"}
    fitted = classifier().fit(X, [names[label] for label in y])
    assert fitted.class_locations_.tolist() == [3, 4, 5]


def test_the_location_none_states_a_location_of_its_own(data):
    X, y = data
    fitted = classifier(locations={"IR2": None}).fit(X, y)
    assert fitted.class_locations_.tolist() == [4, 1, 3, 2]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"healthy": "x"}, "healthy == 'x', expected one of the conditions"),
        (
            {"locations": {"IR2": "top"}},
            r"locations\['IR2'\] == 'top', expected one of",
        ),
        ({"recorded_prior": 0.0}, "recorded_prior"),
        ({"recorded_prior": 1.0}, "recorded_prior"),
    ],
)
def test_bad_parameters_are_named(data, options, message):
    with pytest.raises(ValueError, match=message):
        classifier(**options).fit(*data)


def test_without_a_healthy_condition_there_is_no_alarm(data):
    X, y = data
    faulty = y != "Normal"
    without = classifier().fit(X[faulty], y[faulty])
    fitted = classifier().fit(X, y)
    assert "alarm" not in without.diagnose(X) and "alarm" in fitted.diagnose(X)
    assert fitted.diagnose(rows(0.8, 12, 80)).alarm.all()
    strict = classifier(false_alarm_rate=0.3).fit(X, y)
    assert strict.detection_threshold_ < fitted.detection_threshold_


@pytest.mark.parametrize("rpm", [None, 900.0, np.repeat([700.0, 900.0], 10)])
def test_few_healthy_rows_hold_the_stated_rate_for_new_ones(rpm):
    X = np.concatenate([rows(0.0, 20, 60, spread=0.02), rows(0.8, 20, 61)])
    y = np.repeat(["Normal", "IR2"], 20)
    fitted = classifier(false_alarm_rate=0.1)
    fitted.fit(X, y, rpm=np.tile(rpm, 2) if np.ndim(rpm) else rpm)
    new = rows(0.0, 40, 62, spread=0.02)
    stated = None if rpm is None else 900.0
    in_fit = fitted.diagnose(X[:20], stated).levels[:, 1].max()
    assert in_fit < fitted.detection_threshold_
    assert fitted.diagnose(new, stated).alarm.mean() <= 0.2
    assert fitted.diagnose(rows(0.8, 12, 63), stated).alarm.all()


def test_limits_hold_for_new_specimens_if_several_healthy_ones_are_stated():
    X = np.stack([rows(-0.6, 16, 0), rows(0.6, 16, 1)], axis=1).reshape(32, LENGTH)
    y = np.full(32, "Normal")
    alone, two, many = (
        classifier().fit(X, y, rpm=900.0, specimen=specimen)
        for specimen in (None, np.tile(["a", "b"], 16), np.arange(32))
    )
    new = rows(0.9, 20, 5)
    assert (
        alone.diagnose(new, 900.0).alarm.all()
        and not two.diagnose(new, 900.0).alarm.any()
    )
    # More than five specimens are left out in five groups, each with others of both kinds.
    assert many.detection_threshold_ < alone.detection_threshold_


def of_kernel(fitted, logs, **options):
    return posterior.condition_log_probabilities(
        logs, np.array([0, 0, 2, 1]), 2, fitted.noise_gaps_, **options
    )


def test_probabilities_are_those_of_the_kernel(fitted, data):
    X, y = data
    found = fitted.diagnose(X)
    levels = fitted.residual_.transform(X[:, np.newaxis])
    np.testing.assert_array_equal(found.levels, levels)
    expected = of_kernel(fitted, np.log(levels))
    np.testing.assert_allclose(found.log_probability, expected.log_probability)
    np.testing.assert_allclose(found.recorded, expected.recorded)
    most_probable = found.probability.argmax(axis=1)
    np.testing.assert_array_equal(fitted.classes_[most_probable], found.verdict)
    logs = fitted.predict_log_proba(X)
    np.testing.assert_array_equal(logs, np.log(found.probability))
    assert fitted.score(X, y) > 0.9


def test_rows_are_joined_by_their_mean_log_residuals(fitted, data):
    found = fitted.diagnose(data[0][:5])
    one = fitted.join(found.row_evidence[:1])
    for name in ("log_probability", "recorded", "score"):
        np.testing.assert_allclose(one[name][0], found[name][0])
    assert one.verdict[0] == found.verdict[0]
    mean = np.log(found.levels).mean(axis=0, keepdims=True)
    joined = fitted.join(found.row_evidence.mean(axis=0, keepdims=True), 5)
    expected = of_kernel(fitted, mean, n_rows=5)
    np.testing.assert_allclose(joined.log_probability, expected.log_probability)
    with pytest.raises(ValueError, match=r"evidence\.shape == \(1, 1\), expected one"):
        fitted.join(mean[:, :1])


def test_gaps_of_noise_are_those_of_coloured_noises_at_the_middle_speed(data):
    X, y = data
    fitted = classifier().fit(X, y, rpm=np.resize([800.0, 900.0, 1500.0], len(X)))
    noises = coloured_noises((1, LENGTH))
    logs = np.log(fitted.residual_.transform(noises, rpm=np.full(len(noises), 900.0)))
    expected = posterior.noise_gaps(logs, np.array([0, 0, 2, 1]), 2)
    np.testing.assert_allclose(fitted.noise_gaps_, expected)


def test_one_healthy_row_has_a_limit(data):
    X, y = data
    chosen = np.r_[0, 12:48]
    fitted = classifier().fit(X[chosen], y[chosen])
    assert fitted.n_healthy_ == 1 and not fitted.diagnose(X[:1]).alarm[0]


def test_the_prior_moves_rows_between_recorded_and_unknown(data):
    low, high = (
        classifier(recorded_prior=prior).fit(*data).diagnose(data[0])
        for prior in (0.05, 0.95)
    )
    assert (low.recorded < high.recorded).all()
    assert (low.log_probability[:, -1] > high.log_probability[:, -1]).all()


def test_noise_of_any_colour_is_not_named_surely(fitted):
    poles = enumerate((0.95, 0.25, -0.95))
    noise = np.concatenate([rows(pole, 4, 50 + seed) for seed, pole in poles])
    assert np.exp(fitted.diagnose(noise).log_probability[:, :-1]).max() < 0.9


def test_what_is_far_from_everything_is_not_named(data):
    fitted = classifier().fit(*data, rpm=900)
    rough = np.diff(rows(0.0, 4, 70), n=2, axis=1, prepend=[[0.0, 0.0]] * 4)
    smooth = rows(0.0, 4, 71).cumsum(axis=1).cumsum(axis=1)
    found = fitted.diagnose(np.concatenate([rough, smooth]), rpm=900)
    assert found.levels.min() > 2
    assert np.exp(found.log_probability[:, :-1]).max() < 0.5
    assert found.recorded.max() < 0.05


def specimens():
    """Rows, locations and specimens."""
    X = np.concatenate([rows(a, 6, i) for i, a in enumerate((0.5, 0.52, -0.5, -0.52))])
    return X, np.repeat(["inner", "outer"], 12), np.repeat(list("abcd"), 6)


def test_specimens_reach_the_classifier_through_the_pipeline():
    X, y, names = specimens()
    alone = make_diagnoser().fit(X, y, specimen=names)["decide"]
    assert alone.n_specimens_.tolist() == [2, 2]
    options = {"bearing": "6205", "sampling_rate": 1000.0}
    joint = make_diagnoser(**options).fit(X, y, rpm=6000.0, specimen=names)["decide"]
    assert joint.conditions_.n_specimens_.tolist() == [2, 2]
    message = "Length of specimen: 2, expected 24, as X has rows"
    with pytest.raises(ValueError, match=message):
        classifier().fit(X, y, specimen=["a", "b"])
