import copy
import pickle
import warnings
from unittest import mock

import numpy as np
import pytest
import sklearn
from scipy import stats
from scipy.signal import lfilter
from sklearn.base import clone
from sklearn.pipeline import Pipeline

from skarxlag import (
    DiagnosisPipeline,
    FaultDetector,
    KnownConditions,
    load_diagnoser,
    make_diagnoser,
    make_known_conditions,
    save_diagnoser,
)
from skarxlag.core.state import check_state
from skarxlag.decisions.row_outliers import features_of_rows

LENGTH, RATE = 1200, 0.05
COLOURS = {"good": -0.8, "inner": 0.0, "outer": 0.8}


def rows(condition, n, rpm, seed):
    """Noise of a condition's colour, which drifts a little with speed."""
    rng = np.random.default_rng([seed, int(rpm), list(COLOURS).index(condition)])
    return lfilter(
        [1], [1, COLOURS[condition] + rpm / 1e4], rng.normal(size=(n, LENGTH))
    )


def rig(conditions, speeds, n, seed=0):
    parts = [(c, s) for c in conditions for s in speeds]
    X = np.concatenate([rows(c, n, s, seed) for c, s in parts])
    y, rpm = (np.repeat([part[i] for part in parts], n) for i in (0, 1))
    return X, y, rpm.astype(float)


def fit(estimator, *data, **options):
    """Fit without what few rows of one speed make it say."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return estimator.fit(*data, **options)


@pytest.fixture(scope="module")
def fitted():
    X, y, rpm = rig(("good", "inner"), (800, 1200), 30)
    return fit(KnownConditions(false_rejection_rate=RATE), X, y, rpm=rpm)


def test_each_condition_has_the_p_values_of_its_detector(fitted):
    X, y, rpm = rig(("good", "inner"), (800, 1200), 30)
    fresh = rows("good", 5, 1000, 1)
    found = fitted.p_values(fresh, rpm=1000)
    for place, name in enumerate(fitted.classes_):
        own = y == name
        alone = fit(FaultDetector(false_alarm_rate=RATE), X[own], rpm=rpm[own])
        # Of the unsteadiness both sides count, so a p-value may be twice as large, or
        # smaller.
        one_sided = alone.p_values(fresh, rpm=1000)
        assert np.all(found[:, place] <= 2 * one_sided * (1 + 1e-9))
        measured = features_of_rows(
            fresh[:, np.newaxis], 1, with_level=False, n_jobs=None
        )
        both = alone._log_p_values_of(
            measured, np.full(5, np.log(1000)), two_sided=True
        )
        np.testing.assert_allclose(found[:, place], np.exp(both), rtol=1e-9)
    assert found.shape == (5, 2) and fitted.classes_.tolist() == ["good", "inner"]
    scores = fitted.score_samples(fresh, rpm=1000)
    np.testing.assert_allclose(scores, np.log(found.max(axis=1)))
    np.testing.assert_allclose(
        fitted.decision_function(fresh, rpm=1000), scores - np.log(RATE)
    )
    verdicts = fitted.predict(fresh, rpm=1000)
    np.testing.assert_array_equal(verdicts, np.where(found.max(axis=1) < RATE, -1, 1))


@pytest.mark.parametrize(
    "detector",
    [KnownConditions(false_rejection_rate=0.5), FaultDetector(false_alarm_rate=0.5)],
    ids=["known", "detector"],
)
def test_verdict_score_and_p_values_are_of_one_set_of_measures(detector):
    X, y, rpm = rig(("good", "inner"), (800, 1200), 30)
    pipeline = fit(DiagnosisPipeline([("detect", clone(detector))]), X, y, rpm=rpm)
    fresh = rows("good", 10, 1000, 1)
    with mock.patch(
        "skarxlag.decisions.row_outliers.features_of_rows",
        side_effect=features_of_rows,
    ) as measured:
        found = pipeline.diagnose(fresh, rpm=1000)
    assert measured.call_count == 1
    p_values = pipeline.p_values(fresh, rpm=1000)
    np.testing.assert_array_equal(found.p_values, p_values.reshape(10, -1))
    np.testing.assert_array_equal(found.verdict, pipeline.predict(fresh, rpm=1000))
    np.testing.assert_array_equal(
        found.score, pipeline.decision_function(fresh, rpm=1000)
    )
    np.testing.assert_array_equal(found.alarm, found.verdict == -1)
    assert 0 < found.alarm.sum() < 10


def test_rows_without_strikes_are_not_of_a_fault():
    def struck(n, seed, height):
        noise = np.random.default_rng(seed).normal(size=(n, LENGTH))
        noise[:, ::150] += height
        return noise

    X = struck(60, 0, 20.0)
    known = fit(KnownConditions(false_rejection_rate=RATE), X, rpm=1000)
    detector = fit(FaultDetector(false_alarm_rate=RATE), X, rpm=1000)
    assert (known.predict(struck(20, 1, 20.0), rpm=1000) == 1).mean() > 0.8
    without = struck(20, 3, 0.0)
    assert np.all(known.predict(without, rpm=1000) == -1)
    assert np.all(
        known.score_samples(without, rpm=1000)
        < detector.score_samples(without, rpm=1000)
    )


def test_a_condition_that_was_not_trained_is_rejected(fitted):
    assert np.all(fitted.predict(rows("outer", 20, 1200, 3), rpm=1200) == -1)
    # With it in training it is known.
    X, y, rpm = rig(COLOURS, (800, 1200), 30)
    three = fit(clone(fitted), X, y, rpm=rpm)
    assert (three.predict(rows("outer", 20, 1200, 3), rpm=1200) == 1).mean() > 0.8


UNLIKE = {
    "white noise": np.random.default_rng(9).normal(size=(8, LENGTH)),
    "a sine": np.sin(0.3 * np.arange(LENGTH) + np.arange(8)[:, np.newaxis]),
    "a time column": np.linspace(0, 1, 8 * LENGTH).reshape(8, LENGTH),
    "another sensor": np.cumsum(
        np.random.default_rng(8).normal(size=(8, LENGTH)), axis=1
    ),
}


@pytest.mark.parametrize("what", UNLIKE)
@pytest.mark.parametrize("rpm", [800, 1200])
def test_what_is_no_signal_of_the_machine_is_rejected(what, rpm):
    # 400 rows are ten blocks of time.
    X, y, speeds = rig(("good", "outer"), (rpm,), 400)
    known = fit(KnownConditions(), X, y, rpm=speeds)
    assert np.all(known.predict(UNLIKE[what], rpm=rpm) == -1)


@pytest.mark.parametrize("rpm", [800, 1000, 1200])
def test_rate_of_false_rejections_holds_over_seeds(rpm):
    n_seeds, n_rows, rejected = 8, 20, 0
    for seed in range(n_seeds):
        X, y, speeds = rig(("good", "inner"), (800, 1200), 25, seed)
        known = fit(KnownConditions(false_rejection_rate=RATE), X, y, rpm=speeds)
        for condition in ("good", "inner"):
            new = rows(condition, n_rows, rpm, 100 + seed)
            rejected += np.sum(known.predict(new, rpm=rpm) == -1)
    assert rejected <= stats.binom.isf(1e-3, 2 * n_seeds * n_rows, RATE)


def test_an_unknown_speed_may_lie_beyond_those_of_fit():
    def struck(n, seed, height):
        noise = np.random.default_rng(seed).normal(size=(n, LENGTH))
        noise[:, ::150] += height
        return noise

    known = fit(
        KnownConditions(), struck(15, 0, 20.0), rpm=np.repeat([600, 800, 1200], 5)
    )
    ends = 600 / 1.3, 600, 800, 1200, 1200 * 1.3
    # Unsteadiness falls with speed: strong impacts are expected below, weak ones above.
    for height, end in ((60.0, 0), (10.0, 4)):
        new = struck(5, 1, height)
        each = np.array([known.score_samples(new, rpm=rpm) for rpm in ends])
        assert np.all(each[end] > np.delete(each, end, axis=0).max(axis=0))
        np.testing.assert_allclose(known.score_samples(new), each[end])


def test_a_speed_may_be_unknown(fitted):
    new = rows("good", 10, 800, 4)
    # Where `fit` had no speed, the limits are those for one that differs by the factor
    # 1.3.
    X, y, _ = rig(("good", "inner"), (800,), 30)
    never = fit(clone(fitted), X, y)
    np.testing.assert_array_equal(never.p_values(new), never.p_values(new, rpm=123))
    at_800 = fit(clone(fitted), X, y, rpm=800.0)
    np.testing.assert_allclose(never.p_values(new), at_800.p_values(new, rpm=1.3 * 800))


def test_without_conditions_all_rows_are_of_one():
    X = rows("good", 40, 1000, 0)
    known = fit(KnownConditions(false_rejection_rate=RATE), X, rpm=1000)
    assert known.classes_.tolist() == ["known"] and known.p_values(
        X, rpm=1000
    ).shape == (40, 1)


def test_gain_does_not_matter(fitted):
    new = rows("inner", 5, 1000, 2)
    np.testing.assert_allclose(
        fitted.score_samples(1e6 * new, rpm=1000),
        fitted.score_samples(new, rpm=1000),
        rtol=1e-6,
    )


def test_weak_calibrations_are_said():
    X, y, _ = rig(("good", "inner"), (800,), 10)
    with pytest.warns(UserWarning) as said:
        KnownConditions().fit(X[:18], y[:18], rpm=800)
    texts = [str(each.message) for each in said]
    assert "8 rows of condition inner" in texts[0] and "1/9 = 0.11" in texts[0]
    assert "Use at least 99 rows" in texts[0] and "one speed, 800 rpm" in texts[1]
    assert len(texts) == 2 and said[0].filename == __file__
    with pytest.warns(UserWarning) as said:
        left_out = KnownConditions().fit(X[:11], y[:11], rpm=800)
    assert "one row at each speed are left out: 'inner'" in str(said[0].message)
    assert left_out.classes_.tolist() == ["good"]
    with pytest.warns(UserWarning) as said:
        KnownConditions().fit(X, y)
    assert "rpm is not given" in str(said[1].message) and len(said) == 2
    with pytest.raises(
        ValueError, match="of one condition and speed == 1, expected at least 2"
    ):
        KnownConditions().fit(X[[0, 10]], y[[0, 10]])
    with pytest.raises(
        ValueError, match="of one condition and speed == 1, expected at least 2"
    ):
        KnownConditions().fit(X[:2], rpm=[800, 1200])


def test_a_condition_with_two_rows_of_one_of_its_speeds_is_known():
    X, y, _ = rig(("good", "inner"), (800,), 3)
    known = fit(KnownConditions(), X, y, rpm=[800, 800, 1200] * 2)
    assert known.classes_.tolist() == ["good", "inner"]
    for detector in known.detectors_:
        np.testing.assert_allclose(detector.speeds_, [800, 1200])


def test_a_condition_of_one_speed_drifts_as_experience_says(fitted):
    X, y, _ = rig(("good", "inner"), (800,), 4)
    for rpm in (None, 800):
        known = fit(KnownConditions(), X, y, rpm=rpm)
        assert [detector.drift_scale_ for detector in known.detectors_] == [3.0, 3.0]
    # With several speeds it is that of a detector.
    X, y, rpm = rig(("good", "inner"), (800, 1200), 30)
    own = y == "good"
    alone = fit(FaultDetector(false_alarm_rate=RATE), X[own], rpm=rpm[own])
    assert fitted.detectors_[0].drift_scale_ == alone.drift_scale_


def test_rows_are_cut_into_windows():
    noise = np.random.default_rng(0).normal(size=(2, 9600))
    n_windows = {
        length: fit(KnownConditions(**options), noise, rpm=800).detectors_[0].n_windows_
        for length, options in {4800: {}, 1200: {"window_length": 1200}}.items()
    }
    assert n_windows == {4800: 2, 1200: 8}
    # Windows of one sample have no spectrum, and their level counts.
    single = fit(KnownConditions(window_length=1), noise[:, :7], rpm=800)
    assert single.detectors_[0].n_windows_ == 7
    assert np.all(single.p_values(noise[:, :7], rpm=800) > 0)


def test_bad_input_is_named(fitted):
    X, y, _ = rig(("good", "inner"), (800,), 4)
    for rate in (0.0, 1.0):
        with pytest.raises(ValueError, match="false_rejection_rate"):
            KnownConditions(false_rejection_rate=rate).fit(X, y)
    with pytest.raises(ValueError, match="window_length"):
        KnownConditions(window_length=0).fit(X, y)
    with pytest.raises(ValueError, match="rpm of row 0 == -1"):
        KnownConditions().fit(X, y, rpm=-1)
    with pytest.warns(
        UserWarning, match="8 of 8 rows are treated as rows without a signal"
    ):
        p_values = fitted.p_values(X, rpm=[0] * 8)
    assert np.all(p_values < 1e-30) and np.all(p_values > 0)
    with pytest.warns(UserWarning, match="rows without a signal"):
        assert np.all(fitted.predict(X, rpm=[0] * 8) == -1)
    with pytest.raises(ValueError, match="all texts or all numbers"):
        KnownConditions().fit(X, ["a", 1] * 4)


@pytest.mark.parametrize("routing", [False, True])
def test_speeds_reach_it_through_a_pipeline(routing):
    X, y, rpm = rig(("good", "inner"), (800, 1200), 20)
    with sklearn.config_context(enable_metadata_routing=routing):
        known = fit(make_known_conditions(false_rejection_rate=RATE), X, y, rpm=rpm)
        p_values, verdicts = known.p_values(X, rpm=rpm), known.predict(X, rpm=rpm)
    identified = known["identify"].transform(X)
    np.testing.assert_array_equal(
        p_values, known["decide"].p_values(identified, rpm=rpm)
    )
    np.testing.assert_array_equal(
        verdicts, np.where(p_values.max(axis=1) < RATE, -1, 1)
    )
    if routing:
        plain = Pipeline(make_known_conditions(false_rejection_rate=RATE).steps)
        with sklearn.config_context(enable_metadata_routing=True):
            found = fit(plain, X, y, rpm=rpm).predict(X, rpm=rpm)
        np.testing.assert_array_equal(found, verdicts)


def test_rows_count_as_their_weights_say(fitted):
    X, y, rpm = rig(("good", "inner"), (800, 1200), 30)
    first = np.arange(len(X)) % 30 < 15
    none_of_the_rest = fit(
        clone(fitted), X, y, rpm=rpm, sample_weight=first.astype(float)
    )
    half = fit(clone(fitted), X[first], y[first], rpm=rpm[first])
    new = rows("good", 5, 1000, 1)
    expected = half.p_values(new, rpm=1000)
    np.testing.assert_allclose(none_of_the_rest.p_values(new, rpm=1000), expected)
    light = fit(clone(fitted), X, y, rpm=rpm, sample_weight=1 + 9 * first)
    assert not np.allclose(
        light.p_values(new, rpm=1000), fitted.p_values(new, rpm=1000)
    )


def test_fit_predict_takes_conditions(fitted):
    X, y, rpm = rig(("good", "inner"), (800, 1200), 30)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        found = clone(fitted).fit_predict(X, y, rpm=rpm)
    np.testing.assert_array_equal(found, fitted.predict(X, rpm=rpm))


def test_pickled_saved_and_loaded(tmp_path, fitted):
    new = rows("good", 4, 1000, 5)
    again = pickle.loads(pickle.dumps(fitted))
    np.testing.assert_array_equal(
        again.p_values(new, rpm=900), fitted.p_values(new, rpm=900)
    )
    X, y, rpm = rig(("good", "inner"), (800, 1200), 20)
    diagnoser = make_diagnoser(healthy="good").fit(X, y)
    known = fit(make_known_conditions(), X, y, rpm=rpm)
    path = tmp_path / "bearing.skops"
    save_diagnoser(diagnoser, path, known_conditions=known, sampling_rate=1e3)
    loaded, facts = load_diagnoser(path)
    np.testing.assert_array_equal(loaded.predict(X), diagnoser.predict(X))
    beside = facts["known_conditions"]
    np.testing.assert_array_equal(
        beside.p_values(new, rpm=900), known.p_values(new, rpm=900)
    )
    save_diagnoser(diagnoser, path, known_conditions=fitted)
    alone = load_diagnoser(path)[1]["known_conditions"]
    np.testing.assert_array_equal(
        alone.p_values(new, rpm=900), fitted.p_values(new, rpm=900)
    )
    save_diagnoser(diagnoser, path)
    assert "known_conditions" not in load_diagnoser(path)[1]
    with pytest.raises(
        TypeError, match="known_conditions is a ConditionClassifier, expected"
    ):
        save_diagnoser(diagnoser, path, known_conditions=diagnoser[-1])
    with pytest.raises(sklearn.exceptions.NotFittedError):
        save_diagnoser(diagnoser, path, known_conditions=KnownConditions())


def test_tampered_known_conditions_are_refused_at_load(tmp_path):
    X, y, rpm = rig(("good", "inner"), (800,), 8)
    known = fit(make_known_conditions(), X, y, rpm=rpm)
    known["decide"].detectors_[1].axes_ = np.zeros((2, 2))
    path = tmp_path / "bearing.skops"
    with pytest.raises(ValueError, match="axes_ has shape"):
        save_diagnoser(make_diagnoser().fit(X, y), path, known_conditions=known)
    with mock.patch("skarxlag.persistence.models._check_content"):
        save_diagnoser(make_diagnoser().fit(X, y), path, known_conditions=known)
    with pytest.raises(ValueError, match="axes_ has shape"):
        load_diagnoser(path)


def of_other_length(fitted):
    detector = copy.deepcopy(fitted.detectors_[0])
    detector.window_shape_ = np.array([LENGTH + 1])
    detector.n_features_in_ = LENGTH + 1
    return detector


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("detectors_", lambda k: []),
        ("detectors_", lambda k: tuple(k.detectors_)),
        ("detectors_", lambda k: [k.detectors_[0], "detector"]),
        ("classes_", lambda k: [k.detectors_[0]]),
        ("detectors_", lambda k: [k.detectors_[0], of_other_length(k)]),
        ("window_shape_", lambda k: [of_other_length(k), of_other_length(k)]),
    ],
)
def test_inconsistent_detectors_are_refused(fitted, name, change):
    check_state(fitted)
    broken = copy.deepcopy(fitted)
    broken.detectors_ = change(fitted)
    with pytest.raises(ValueError, match=name):
        check_state(broken)


@pytest.mark.parametrize("rpm", [12.5, 1e9])
def test_rows_at_implausible_speeds_are_of_no_known_condition(fitted, rpm):
    X, _, _ = rig(("good", "inner"), (800,), 4)
    with pytest.warns(
        UserWarning, match="8 of 8 rows are treated as rows without a signal"
    ):
        assert np.all(fitted.predict(X, rpm=rpm) == -1)
