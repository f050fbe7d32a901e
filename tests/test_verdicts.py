import numpy as np
import pytest
from scipy.special import softmax

from skarxlag import (
    make_alpio,
    make_detector,
    recording_verdicts,
    window_verdicts,
)


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
    assert reversed_columns[2:] == columns[::-1]


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
    detector = make_detector().fit(X[:20])
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
    thresholds = [
        make_detector(false_alarm_rate=rate).fit(X[:20])[-1].detection_threshold_
        for rate in (0.1, 0.4)
    ]
    assert thresholds[0] > thresholds[1]
