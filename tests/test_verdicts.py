import numpy as np
import pandas as pd
import pytest
from scipy.special import softmax

from skarxlag import (
    make_alpio,
    make_detector,
    recording_verdicts,
    window_verdicts,
)
from skarxlag.commands.remarks import verdict_remarks
from skarxlag.verdicts import recording_verdict

pytestmark = pytest.mark.filterwarnings("ignore:rpm is not given:UserWarning")


@pytest.fixture(scope="module")
def windows():
    rng = np.random.default_rng(0)
    white, coloured = rng.normal(size=(20, 400)), rng.normal(size=(20, 400)).cumsum(axis=1)
    return np.concatenate([white, coloured]), np.repeat(["white", "coloured"], 20)


@pytest.fixture(scope="module")
def diagnoser(windows):
    return make_alpio().fit(*windows)


def test_windows_get_what_the_pipeline_says(diagnoser, windows):
    X, _ = windows
    verdicts = window_verdicts(diagnoser, X)
    np.testing.assert_array_equal(verdicts["verdict"], diagnoser.predict(X))
    columns = ["probability of coloured", "probability of white"]
    np.testing.assert_allclose(verdicts[columns], diagnoser.predict_proba(X))
    reversed_columns = window_verdicts(diagnoser, X, ["white", "coloured"]).columns.tolist()
    assert reversed_columns[3:] == columns[::-1]


def test_evidence_of_a_recording_is_the_sum_over_its_windows(diagnoser, windows):
    X, _ = windows
    recording = np.arange(40) % 3
    table = recording_verdicts(diagnoser, X, recording)
    evidence = diagnoser.predict_log_proba(X)
    for name, row in table.iterrows():
        mean = evidence[recording == name].mean(axis=0)
        assert row["verdict"] == diagnoser.classes_[mean.argmax()]
        assert row["confidence"] == pytest.approx(softmax(mean).max(), rel=1e-3)
        assert row["windows"] == np.sum(recording == name)


def test_recordings_keep_their_order_of_appearance(diagnoser, windows):
    table = recording_verdicts(diagnoser, windows[0], np.repeat(["z", "a"], 20))
    assert table.index.tolist() == ["z", "a"]


def test_detector_names_what_it_does_not_flag(windows):
    X, _ = windows
    detector = make_detector(false_alarm_rate=0.1, fixed_gain=True).fit(X[:20])
    assert set(window_verdicts(detector, X)["verdict"]) <= {"healthy", "faulty"}
    assert recording_verdicts(detector, X, np.repeat([0, 1], 20))["verdict"].tolist() == [
        "healthy",
        "faulty",
    ]


def test_recording_must_fit_the_windows(diagnoser, windows):
    with pytest.raises(ValueError, match="inconsistent numbers of samples"):
        recording_verdicts(diagnoser, windows[0], [1, 2])


def test_false_alarm_rate_reaches_the_detector(windows):
    X, _ = windows
    offsets = [make_detector(false_alarm_rate=rate).fit(X[:20])[-1].offset_ for rate in (0.1, 0.4)]
    np.testing.assert_allclose(offsets, np.log([0.1, 0.4]))


def test_windows_without_a_signal_get_no_verdict_and_do_not_count(diagnoser, windows):
    X = windows[0].copy()
    X[1], X[2, 7], X[3] = 0.25, np.nan, X[3].clip(-0.1, 0.1)
    verdicts = window_verdicts(diagnoser, X)
    bad = [1, 2, 3]
    assert verdicts["quality"][bad].tolist() == ["constant", "not finite", "clipped"]
    assert (verdicts["verdict"][bad] == "no signal").all() and not verdicts["alarm"][bad].any()
    assert verdicts.loc[bad, "probability of white"].isna().all()
    others = np.delete(np.arange(40), bad)
    expected = window_verdicts(diagnoser, windows[0][others])
    pd.testing.assert_frame_equal(verdicts.loc[others].reset_index(drop=True), expected)
    run = np.repeat(["start", "rest"], [20, 20])
    row = recording_verdicts(diagnoser, X, run).loc["start"]
    without = recording_verdicts(diagnoser, X[others], run[others]).loc["start"]
    assert (row["windows"], row["no signal"]) == (20, 3)
    names = ["verdict", "confidence", "alarms", "share of white"]
    assert row[names].tolist() == without[names].tolist()


def test_a_dead_sensor_gives_no_verdict(diagnoser):
    X = np.zeros((4, 400))
    windows = window_verdicts(diagnoser, X)
    verdict = recording_verdict(windows, ["coloured", "white"])
    assert verdict["verdict"] == "no signal" and np.isnan(verdict["confidence"])
    (remark,) = verdict_remarks(windows, verdict, ["coloured", "white"])
    assert "constant: 4" in remark and "check the sensor" in remark
    healthy = np.random.default_rng(0).normal(size=(9, 400))
    detector = make_detector(false_alarm_rate=0.1).fit(healthy)
    assert recording_verdicts(detector, X, np.zeros(4))["verdict"].tolist() == ["no signal"]


@pytest.mark.parametrize(
    ("verdict", "alarm", "message"),
    [
        ("good", True, "The verdict is good, but most windows exceed the detection threshold"),
        ("worn", False, "The verdict is worn, but most windows stay below the detection threshold"),
        ("good", False, None),
        ("worn", True, None),
    ],
)
def test_verdict_and_alarm_that_contradict_each_other_are_explained(verdict, alarm, message):
    windows = pd.DataFrame(
        {"verdict": verdict, "alarm": [alarm] * 3, "quality": "good"}
        | {f"probability of {c}": 0.9 if c == verdict else 0.1 for c in ("good", "worn")}
    )
    found = recording_verdict(windows, ["good", "worn"])
    assert found["verdict"] == verdict
    remarks = verdict_remarks(windows, found, ["good", "worn"])
    assert (remarks == []) if message is None else remarks[0].startswith(message)


def test_speeds_reach_the_detector(windows):
    X, _ = windows
    rpm = np.repeat([1000.0, 1200.0], 10)
    detector = make_detector(false_alarm_rate=0.1).fit(X[:20], rpm=rpm)
    new = X[10:20].copy()
    new[3] = 0.0
    verdicts = window_verdicts(detector, new, rpm=np.linspace(900, 1300, 10))
    assert verdicts["verdict"][3] == "no signal"
    good = np.arange(10) != 3
    expected = detector.decision_function(new[good], rpm=np.linspace(900, 1300, 10)[good])
    np.testing.assert_allclose(verdicts["score"][good], expected)
