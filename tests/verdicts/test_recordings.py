import warnings

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter
from scipy.special import softmax
from scipy.stats import norm
from sklearn.linear_model import LogisticRegression, RidgeClassifier

from skarxlag import (
    make_alpio,
    make_detector,
    make_diagnoser,
    make_known_conditions,
    recording_verdicts,
    window_verdicts,
)
from skarxlag.core.fault_locations import NO_FINDING, NOT_IDENTIFIABLE
from skarxlag.decisions import comb_limits
from skarxlag.kernels.evidence import (
    CORRELATION,
    NEAREST_CORRELATION,
    P_VALUE_CORRELATION,
    combined_p_value,
    effective_number,
)
from skarxlag.kernels.posterior import condition_log_probabilities
from skarxlag.verdicts.judge import Judge
from skarxlag.verdicts.limits import FEW_HEALTHY
from skarxlag.verdicts.names import check_conditions, no_verdict
from skarxlag.verdicts.windows import HOLD

from ..bearing_rows import classifier
from ..bearing_rows import row as signal_of
from ..impacts import ORDERS, RATE, stretches

pytestmark = pytest.mark.filterwarnings("ignore::UserWarning")
SPEEDS = np.repeat([900.0, 1200.0], 100)


def log_probabilities(table):
    """Evidence of windows for a classifier that cannot join rows."""
    return np.log(table[["probability of coloured", "probability of white"]].to_numpy())


@pytest.fixture(scope="module")
def windows():
    rng = np.random.default_rng(0)
    white, coloured = (
        rng.normal(size=(20, 400)),
        rng.normal(size=(20, 400)).cumsum(axis=1),
    )
    return np.concatenate([white, coloured]), np.repeat(["white", "coloured"], 20)


@pytest.fixture(scope="module")
def diagnoser(windows):
    return make_alpio(healthy="white").fit(*windows)


@pytest.fixture(scope="module")
def healthy():
    return np.random.default_rng(1).normal(size=(200, 400))


@pytest.fixture(scope="module")
def detector(healthy):
    return make_detector().fit(healthy, rpm=SPEEDS)


def test_windows_get_what_the_pipeline_says(diagnoser, windows):
    X, _ = windows
    verdicts = window_verdicts(diagnoser, X)
    np.testing.assert_array_equal(verdicts["verdict"], diagnoser.predict(X))
    columns = ["probability of coloured", "probability of white"]
    np.testing.assert_allclose(verdicts[columns], diagnoser.predict_proba(X))
    assert verdicts.columns[5:].tolist() == columns
    reversed_columns = window_verdicts(
        diagnoser, X, ["white", "coloured"]
    ).columns.tolist()
    assert reversed_columns[5:] == columns[::-1]


def test_evidence_of_a_recording_counts_correlated_windows(diagnoser, windows):
    X, _ = windows
    recording = np.arange(40) % 3
    table = recording_verdicts(diagnoser, X, recording)
    evidence = diagnoser.predict_log_proba(X).clip(np.log(1e-6))
    for name, row in table.iterrows():
        n, mean = np.sum(recording == name), evidence[recording == name].mean(axis=0)
        n_effective = 1 / (CORRELATION + (1 - CORRELATION) / n)
        assert row["verdict"] == diagnoser.classes_[mean.argmax()]
        assert row["probability"] == pytest.approx(
            softmax(n_effective * mean).max(), rel=1e-6
        )
        assert row["windows"] == n


def test_a_recording_is_diagnosed_by_the_mean_log_residuals_of_its_windows(windows):
    X, y = windows
    diagnoser = make_diagnoser(healthy="white").fit(X, y)
    X = np.random.default_rng(5).normal(size=(9, 400)).cumsum(axis=1)
    X[6:] = np.nan
    row = recording_verdicts(diagnoser, X, np.zeros(9)).iloc[0]
    decide = diagnoser["decide"]
    found = condition_log_probabilities(
        np.log(diagnoser.diagnose(X[:6]).levels).mean(axis=0, keepdims=True),
        np.array([0, 1]),
        1,
        decide.noise_gaps_,
        n_rows=6,
    )
    assert (row["verdict"], row["no signal"]) == ("coloured", 3)
    expected = np.exp(found.log_probability[0, 0])
    assert row["probability"] == pytest.approx(expected)


def test_effective_number_is_that_of_the_variance_of_a_mean():
    n, rng = 7, np.random.default_rng(0)
    covariance = np.full((n, n), P_VALUE_CORRELATION) + (
        1 - P_VALUE_CORRELATION
    ) * np.eye(n)
    assert effective_number(n, P_VALUE_CORRELATION) == pytest.approx(
        1 / covariance.mean()
    )
    assert effective_number(1) == 1 and effective_number(0.25) == 0.25
    # Combined p-values of equally correlated windows are uniform.
    scores = rng.multivariate_normal(np.zeros(n), covariance, size=20_000)
    combined = np.array([combined_p_value(norm.sf(row)) for row in scores[:4000]])
    for rate in (0.01, 0.05, 0.3):
        assert np.mean(combined < rate) == pytest.approx(rate, rel=0.4)
    assert 0 < combined_p_value([1e-320, 1.0, 0.5]) < 1


def test_detector_alone_says_healthy_or_changed(detector, healthy):
    X = np.concatenate([healthy[:20], healthy[:20].cumsum(axis=1)])
    found = recording_verdicts(detector, X, np.repeat(["a", "b"], 20), rpm=900.0)
    assert found["verdict"].tolist() == ["healthy", "changed"]
    assert found["alarm"].tolist() == ["no", "yes"]
    assert found.loc["a", "p-value"] > 0.01 > found.loc["b", "p-value"]
    assert found["probability"].isna().all() and (found["limits"] == "hold").all()
    assert (found["share of changed"] > 0.9).tolist() == [False, True]
    judge = Judge(detector)
    evidence = judge.window_results(X, 900.0).evidence
    assert evidence.shape == (40, judge.n_evidence) == (40, 0)
    named = recording_verdicts(detector, X[:20], np.zeros(20), ["ok"], rpm=1000.0)
    assert named["verdict"].tolist() == ["ok"]
    without = recording_verdicts(detector, X[:20], np.zeros(20))
    assert without["verdict"].tolist() == [
        "no verdict: the speed is not stated, and healthy limits hold at 900, 1200 rpm only"
    ]


@pytest.mark.parametrize(
    "ramp", [None, np.linspace(-50, 50, 400)], ids=["row", "sample"]
)
def test_p_values_are_those_of_the_detector(detector, healthy, ramp):
    X, rpm = healthy[:9], np.linspace(900, 1300, 9)
    if ramp is not None:
        rpm = rpm[:, np.newaxis] + ramp
    verdicts = window_verdicts(detector, X, rpm=rpm)
    np.testing.assert_allclose(verdicts["p-value"], detector.p_values(X, rpm=rpm))
    np.testing.assert_allclose(
        verdicts["score"], detector.decision_function(X, rpm=rpm)
    )
    np.testing.assert_array_equal(verdicts["alarm"], detector.predict(X, rpm=rpm) == -1)
    row = recording_verdicts(detector, X, np.zeros(9), rpm=rpm).iloc[0]
    assert row["p-value"] == combined_p_value(verdicts["p-value"])


@pytest.mark.parametrize(
    ("arguments", "alarm", "limits"),
    [
        ({}, "-", "the speed is not stated"),
        ({"rpm": 900.0, "train_rpm": [900.0]}, "no", "hold"),
        (
            {"rpm": 1200.0, "train_rpm": [900.0]},
            "-",
            "healthy limits hold at 900 rpm only",
        ),
        (
            {"train_rpm": [900.0]},
            "-",
            "the speed is not stated, and healthy limits hold at 900 rpm only",
        ),
        ({"rpm": 900.0}, "-", "the training speeds are not known"),
    ],
)
def test_alarm_where_the_detection_threshold_holds(
    arguments, alarm, limits, diagnoser, windows
):
    row = recording_verdicts(
        diagnoser, windows[0][:20], np.zeros(20), **arguments
    ).iloc[0]
    assert (row["verdict"], row["alarm"], row["limits"]) == ("white", alarm, limits)
    assert row["probability"] > 0.5 and np.isnan(row["p-value"])


@pytest.mark.parametrize(("n_healthy", "limits"), [(8, FEW_HEALTHY), (9, HOLD)])
def test_limits_of_few_healthy_rows_are_said_to_be_weak(n_healthy, limits, healthy):
    with warnings.catch_warnings(action="ignore", category=UserWarning):
        detector = make_detector().fit(healthy[:n_healthy], rpm=900.0)
    row = recording_verdicts(detector, healthy[20:24], np.zeros(4), rpm=900.0).iloc[0]
    assert (row["alarm"], row["limits"]) == ("no", limits)


def test_classifier_without_healthy_limits_raises_no_alarm(windows):
    model = LogisticRegression().fit(windows[0], windows[1])
    row = recording_verdicts(model, windows[0][:20], np.zeros(20)).iloc[0]
    assert (row["alarm"], row["limits"]) == ("-", "no healthy limits were learned")


def test_healthy_limits_of_a_detector_decide_between_healthy_and_changed(
    diagnoser, detector, windows
):
    X = windows[0].copy()
    X[:10, ::200] += 40.0  # impacts, which the diagnoser takes for noise
    found = recording_verdicts(
        diagnoser, X, np.repeat(["struck", "quiet", "worn"], [10, 10, 20]),
        rpm=900.0, detector=detector,
    )  # fmt: skip
    assert found["verdict"].tolist() == ["changed", "white", "coloured"]
    assert found["alarm"].tolist() == ["yes", "no", "yes"]
    assert np.isnan(found.loc["struck", "probability"])
    assert found.loc["worn", "probability"] > 0.5


def test_alarm_next_to_a_diagnoser_is_that_of_the_detector(diagnoser, windows):
    X = windows[0]
    detector = make_detector(false_alarm_rate=0.3).fit(X[:20])
    alarm = window_verdicts(diagnoser, X, detector=detector)["alarm"]
    np.testing.assert_array_equal(alarm, detector.predict(X) == -1)
    assert (alarm != window_verdicts(diagnoser, X)["alarm"]).any()


def test_recording_that_resembles_no_condition(diagnoser, windows, healthy):
    known = make_known_conditions().fit(healthy, np.repeat(["a", "b"], 100), rpm=900.0)
    new, run = (
        np.concatenate([windows[0][-8:], healthy[:8]]),
        np.repeat(["strange", "known"], 8),
    )
    found = recording_verdicts(diagnoser, new, run, known=known, rpm=900.0)
    assert found["verdict"].tolist() == ["unknown condition", "white"]
    assert np.isnan(found.loc["strange", "probability"])
    nearest = window_verdicts(diagnoser, new, known=known, rpm=900.0)[
        "p-value of nearest"
    ]
    np.testing.assert_allclose(nearest, np.exp(known.score_samples(new, rpm=900.0)))
    assert found.loc["known", "p-value of nearest"] == combined_p_value(
        nearest[8:], NEAREST_CORRELATION
    )


@pytest.mark.parametrize(
    ("rpm", "reason"),
    [
        (12.5, "speed 12.5 rpm is outside 180 to 6000 rpm"),
        (1e9, "speed 1e+09 rpm is outside 180 to 6000 rpm"),
        (0.0, "speed 0 rpm is not a number above 0"),
        (-900.0, "speed -900 rpm is not a number above 0"),
        (np.nan, "speed nan rpm is not a number above 0"),
        (np.inf, "speed inf rpm is not a number above 0"),
    ],
)
def test_implausible_speed_gets_no_verdict(rpm, reason, detector, diagnoser, healthy):
    arguments = {"rpm": rpm, "train_rpm": [900, 1200]}
    for model in (detector, diagnoser):
        found = recording_verdicts(model, healthy[:5], np.zeros(5), **arguments).iloc[0]
        assert found["verdict"] == f"no verdict: {reason}"
        assert found["alarm"] == "-"
        assert np.isnan([found["probability"], found["p-value"]]).all()
    # The models know their training speeds themselves.
    (own,) = recording_verdicts(detector, healthy[:5], np.zeros(5), rpm=rpm)["verdict"]
    assert own == f"no verdict: {reason}"


def test_single_implausible_windows(detector, healthy):
    rpm = np.array([1000.0, 6500.0, 1000.0])
    found = window_verdicts(detector, healthy[:3], rpm=rpm)["verdict"]
    assert found[1].startswith("no verdict: ") and found[0] == found[2] == "healthy"
    row = recording_verdicts(detector, healthy[:3], np.zeros(3), rpm=rpm).iloc[0]
    assert (row["verdict"], row["windows"]) == ("healthy", 3)
    with pytest.raises(ValueError, match=r"rpm.shape =="):
        window_verdicts(detector, healthy[:3], rpm=[900.0, 900.0])


@pytest.mark.parametrize(
    "conditions",
    [
        ["white"],
        ["white", "white"],
        ["white", "coloured", "other"],
        ["white", "grey"],
        [],
        # These have no order.
        {"white", "coloured"},
        frozenset({"white", "coloured"}),
        [["white", "coloured"]],
    ],
)
def test_only_a_permutation_of_the_conditions_is_accepted(
    conditions, diagnoser, windows
):
    with pytest.raises(ValueError, match="expected a permutation of"):
        recording_verdicts(diagnoser, windows[0], np.zeros(40), conditions)


@pytest.mark.parametrize("conditions", [{"white"}, [], ["a", "b"], [["a"]], "a"])
def test_a_detector_has_one_condition(conditions, detector, healthy):
    with pytest.raises(ValueError, match="expected the healthy one only"):
        window_verdicts(detector, healthy[:2], conditions)


@pytest.mark.parametrize(
    "name", ["no signal", "Changed", "unknown condition", "no verdict: x"]
)
def test_condition_named_like_a_verdict_is_refused(name, windows):
    with pytest.raises(ValueError, match="this one is a verdict of its own"):
        check_conditions(["healthy", name], ["healthy", name])
    model = make_alpio().fit(windows[0], np.repeat(["white", name], 20))
    with pytest.raises(ValueError, match="this one is a verdict of its own"):
        window_verdicts(model, windows[0])


@pytest.mark.parametrize("missing", [None, np.nan, pd.NA, pd.NaT])
def test_windows_without_a_recording_are_refused(missing, diagnoser, windows):
    run = np.array(["a"] * 39 + [missing], dtype=object)
    message = r"recording\[39\] == .*, expected an identifier"
    with pytest.raises(ValueError, match=message):
        recording_verdicts(diagnoser, windows[0], run)
    with pytest.raises(ValueError, match="inconsistent numbers of samples"):
        recording_verdicts(diagnoser, windows[0], run[:2])


@pytest.mark.parametrize(
    "names",
    [
        ("z", "a"),
        ("1", 1),
        (1, 1.5),
        (("a", 1), ("a", 2)),
        ("1", 1.0),
        (b"a", "a"),
        (2**53, 2**53 + 1),
    ],
)
def test_recordings_of_different_identifiers_stay_apart(names, diagnoser, windows):
    found = recording_verdicts(diagnoser, windows[0], [names[0]] * 20 + [names[1]] * 20)
    assert found.index.tolist() == list(names) and found["windows"].tolist() == [20, 20]
    assert found["verdict"].tolist() == ["white", "coloured"]


def test_the_index_of_a_column_of_recordings_does_not_matter(diagnoser, windows):
    runs = pd.Series(np.repeat(["a", "b"], 20), index=np.arange(40)[::-1])
    found = recording_verdicts(diagnoser, windows[0], runs)
    assert found["verdict"].tolist() == ["white", "coloured"]
    assert found.index.tolist() == ["a", "b"]


def test_false_alarm_rate_reaches_the_detector(windows):
    X, _ = windows
    offsets = [
        make_detector(false_alarm_rate=rate).fit(X[:20])[-1].offset_
        for rate in (0.1, 0.4)
    ]
    np.testing.assert_allclose(offsets, np.log([0.1, 0.4]))


def test_windows_without_a_signal_get_no_verdict_and_do_not_count(diagnoser, windows):
    X = windows[0].copy()
    X[1], X[2, 7], X[3] = 0.25, np.nan, X[3].clip(-0.1, 0.1)
    verdicts = window_verdicts(diagnoser, X)
    bad = [1, 2, 3]
    assert verdicts["quality"][bad].tolist() == ["constant", "not finite", "clipped"]
    assert (verdicts["verdict"][bad] == "no signal").all() and verdicts["alarm"][
        bad
    ].isna().all()
    assert verdicts.loc[bad, "probability of white"].isna().all()
    others = np.delete(np.arange(40), bad)
    expected = window_verdicts(diagnoser, windows[0][others])
    found = verdicts.loc[others].reset_index(drop=True)
    pd.testing.assert_frame_equal(found, expected, check_dtype=False)
    run = np.repeat(["start", "rest"], [20, 20])
    row = recording_verdicts(diagnoser, X, run).loc["start"]
    without = recording_verdicts(diagnoser, X[others], run[others]).loc["start"]
    assert (row["windows"], row["no signal"]) == (20, 3)
    names = ["verdict", "probability", "alarm", "share of white"]
    assert row[names].tolist() == without[names].tolist()


def test_a_dead_sensor_gives_no_verdict(diagnoser, detector, windows):
    known = make_known_conditions().fit(*windows)
    row = recording_verdicts(diagnoser, np.zeros((2, 400)), [0, 0], known=known).iloc[0]
    assert row["verdict"] == "no signal" and np.isnan(row["p-value of nearest"])
    for model in (diagnoser, detector):
        row = recording_verdicts(
            model, np.zeros((4, 400)), np.zeros(4), rpm=900.0
        ).iloc[0]
        assert (row["verdict"], row["alarm"], row["no signal"]) == ("no signal", "-", 4)
        assert np.isnan([row["probability"], row["p-value"]]).all()


def test_healthy_condition_is_the_first_of_the_stated_ones_or_known(diagnoser, windows):
    assert Judge(diagnoser).healthy == "white"
    assert Judge(diagnoser, conditions=["coloured", "white"]).healthy == "coloured"
    assert (
        Judge(None, detector=make_detector().fit(windows[0][:20])).healthy == "healthy"
    )
    with pytest.raises(ValueError, match="diagnoser and detector: None"):
        Judge(None)
    for model in (make_known_conditions().fit(*windows), diagnoser):
        with pytest.raises(ValueError, match="expected an outlier detector"):
            Judge(diagnoser, detector=model)


@pytest.mark.parametrize(
    ("n_windows", "n_exceed", "alarm"), [(20, 10, "no"), (25, 13, "yes")]
)
def test_most_windows_must_exceed_the_limits_of_a_recording(
    diagnoser, n_windows, n_exceed, alarm
):
    columns = {"verdict": "white", "quality": "good", "limits": "hold", "alarm": False}
    windows = pd.DataFrame(columns, index=range(n_windows))
    windows[["probability of white", "probability of coloured"]] = [0.9, 0.1]
    windows.loc[: n_exceed - 1, "alarm"] = True
    answer = Judge(diagnoser).recording(windows, log_probabilities(windows))
    assert answer["alarm"] == alarm
    assert answer["verdict"] == ("changed" if alarm == "yes" else "white")


def test_recording_whose_p_value_is_the_stated_rate_is_healthy(detector, healthy):
    judge = Judge(detector)
    results = judge.window_results(healthy[:2], rpm=900.0)
    windows = results.table()
    judge.limits.rate = combined_p_value(windows["p-value"])
    assert judge.recording(windows, results.evidence)["alarm"] == "no"
    judge.limits.rate = np.nextafter(judge.limits.rate, 1)
    assert judge.recording(windows, results.evidence)["alarm"] == "yes"


@pytest.mark.parametrize(
    ("p_value", "combs", "verdict"),
    [
        (0.05, None, "white"),
        (0.0499, None, "unknown condition"),
        (0.0499, [0.2, 0.9, 0.95], "unknown condition"),
        (0.0499, [0.2, 0.95, 0.95], "white"),
    ],
)
def test_rows_unlike_all_conditions_need_a_clear_comb(
    diagnoser, windows, p_value, combs, verdict
):
    rate = combined_p_value([0.05] * 3, NEAREST_CORRELATION)
    known = make_known_conditions(false_rejection_rate=rate).fit(*windows)
    columns = {"verdict": "white", "quality": "good", "limits": "no", "alarm": np.nan}
    table = pd.DataFrame(columns, index=range(3))
    table[["probability of white", "probability of coloured"]] = [0.9, 0.1]
    table["p-value of nearest"] = p_value
    if combs is not None:
        table["probability of a comb"] = combs
    judge = Judge(diagnoser, known=known)
    answer = judge.recording(table, log_probabilities(table))
    assert (answer["verdict"], answer["alarm"]) == (verdict, "-")
    assert (answer["share of white"], answer["share of coloured"]) == (1, 0)


def test_a_rejected_window_shares_its_probabilities_with_an_unknown_condition(windows):
    X, y = windows
    diagnoser = make_diagnoser(healthy="white").fit(X, y)
    known = make_known_conditions(false_rejection_rate=0.5).fit(X, y, rpm=800)
    plain = window_verdicts(diagnoser, X)
    table = window_verdicts(diagnoser, X, known=known, rpm=800)
    p_value = table["p-value of nearest"]
    is_rejected = p_value < 0.5
    assert 0 < is_rejected.sum() < len(X)
    share = (p_value / 0.5).where(is_rejected, 1.0)
    columns = ["probability of coloured", "probability of white"]
    np.testing.assert_allclose(table[columns], plain[columns].mul(share, axis=0))
    unknown = table["probability of unknown condition"]
    np.testing.assert_allclose(table[columns].sum(axis=1) + unknown, 1)


@pytest.mark.parametrize(
    ("is_alone", "evidence", "verdicts"),
    [
        (True, np.empty((2, 0)), ["healthy", "healthy"]),
        (False, np.log([[0.1, 0.9], [0.9, 0.1]]), ["white", "coloured"]),
    ],
)
def test_means_of_windows_are_named_by_the_classifier(
    diagnoser, detector, is_alone, evidence, verdicts
):
    judge = Judge(None if is_alone else diagnoser, detector=detector)
    named = judge.named(evidence, np.ones(2))
    assert [one.verdict for one in named] == verdicts


@pytest.mark.parametrize(
    ("with_detector", "rpm", "limits"),
    [
        (False, 900 * np.exp(0.02), "hold"),
        (False, 600 / np.exp(0.02), "hold"),
        (False, 900 * np.exp(0.021), "healthy limits hold at 600, 900 rpm only"),
        (True, 900 * 1.3, "hold"),
        (True, 600 / 1.3, "hold"),
        (True, 900 * 1.31, "healthy limits hold at 600, 900 rpm only"),
    ],
)
def test_limits_without_speeds_hold_near_the_stated_training_speeds(
    with_detector, rpm, limits, diagnoser, windows
):
    X = windows[0][:1]
    detector = make_detector().fit(windows[0][:20]) if with_detector else None
    judge = Judge(diagnoser, detector=detector, train_rpm=[600.0, 900.0])
    assert judge.window_results(X, rpm).columns["limits"].tolist() == [limits]


def test_limits_that_widen_hold_at_any_plausible_speed(detector, windows):
    X = windows[0][:20]
    assert Judge(detector).window_results(X[:1], 3000.0).columns["limits"].tolist() == [
        "hold"
    ]
    # Those of a detector without speeds are for a speed that differs.
    unknown = make_detector().fit(X)
    for rpm in (None, 3000.0):
        assert Judge(unknown).window_results(X[:1], rpm).columns["limits"].tolist() == [
            "hold"
        ]


def test_combinations_of_models_that_make_no_sense_are_refused(
    detector, diagnoser, healthy
):
    message = r"diagnoser == .*, expected a classifier next to a det"
    with pytest.raises(ValueError, match=message):
        Judge(detector, detector=detector)
    with pytest.raises(ValueError, match="diagnoser states no probabilities"):
        Judge(RidgeClassifier().fit(healthy, np.repeat([0, 1], 100)))


def test_p_value_of_combs_is_no_healthy_p_value_of_learned_conditions():
    X, y = stretches(900)
    model = make_diagnoser(sampling_rate=RATE, bearing=ORDERS, healthy=y[0]).fit(
        X, y, rpm=900
    )
    found = window_verdicts(model, X[:2], rpm=900)
    assert found["limits"].tolist() == ["hold", "hold"] and "p-value" not in found
    assert found["alarm"].tolist() == model.diagnose(X[:2], rpm=900).alarm.tolist()


def test_reasons_are_one_line():
    assert no_verdict(" two\nlines ") == "no verdict: two lines"


def test_nothing_warns_of_windows_without_numbers(diagnoser):
    with warnings.catch_warnings(action="error"):
        Judge(make_diagnoser(healthy="a").fit(
            np.random.default_rng(0).normal(size=(8, 400)), list("aaaabbbb")
        )).window_results(np.full((2, 400), np.nan)).table()  # fmt: skip


def test_combs_name_a_place_although_spectra_resemble_no_condition():
    X, y = stretches(900)
    new, _ = stretches(900, seed=3)
    # Another mounting, and the same without impacts.
    remounted = lfilter([1], [1, -0.9], new) + 4 * np.random.default_rng(8).normal(
        size=new.shape
    )
    quiet = lfilter([1], [1, -0.9], np.random.default_rng(9).normal(size=(4, RATE)))
    rows, recording = np.concatenate([remounted, quiet]), np.repeat(["a", "b", "c"], 4)
    with_combs, without = (
        make_diagnoser(sampling_rate=RATE, bearing=bearing).fit(X, y, rpm=900)
        for bearing in (ORDERS, None)
    )
    known = make_known_conditions(false_rejection_rate=0.3).fit(X, y, rpm=900)
    verdicts = [
        recording_verdicts(model, rows, recording, rpm=900, known=known)[
            "verdict"
        ].tolist()
        for model in (with_combs, without)
    ]
    assert verdicts[0] == ["inner", "outer", "unknown condition"]
    assert verdicts[1][1:] == ["unknown condition"] * 2


def test_rows_without_two_turns_have_no_verdict_by_combs():
    rows = np.stack([signal_of(place) for place in ("healthy", "outer", "outer")])
    judge = Judge(classifier().fit(rows), train_rpm=[300])
    found = judge.window_results(rows, rpm=[900, 100, 900]).table()
    reason = "combs need a plausible speed, and two revolutions of the shaft in a row"
    assert found["verdict"].tolist() == [NO_FINDING, f"no verdict: {reason}", "outer"]
    assert found["probability of outer"].isna().tolist() == [False, True, False]


def test_combs_of_two_places_are_not_identifiable(monkeypatch):
    rows = np.stack([signal_of(place) for place in ("healthy", "outer", "outer")])
    stated = {"rpm": 900, "train_rpm": [900]}
    named = classifier().fit(rows)
    found = recording_verdicts(named, rows, ["a", "b", "b"], **stated)
    assert found["verdict"].tolist() == [NO_FINDING, "outer"]
    assert found["alarm"].tolist() == ["no", "yes"]
    said = named.diagnose(rows, rpm=900)
    np.testing.assert_allclose(found["p-value"].iloc[0], said.p_value[0], rtol=2e-3)
    # No other place is far enough.
    monkeypatch.setattr(comb_limits, "_LEAST_LEAD", np.inf)
    windows = window_verdicts(named, rows, **stated)
    expected = [NO_FINDING, NOT_IDENTIFIABLE, NOT_IDENTIFIABLE]
    assert windows["verdict"].tolist() == expected
    assert "nearly as well" in windows["evidence"][1]
    found = recording_verdicts(named, rows, ["a", "b", "b"], **stated)
    assert found["verdict"].tolist() == [NO_FINDING, NOT_IDENTIFIABLE]
    assert found["alarm"].tolist() == ["no", "yes"] and np.isnan(
        found["probability"].iloc[1]
    )
