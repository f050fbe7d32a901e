"""Masked samples are missing, and True is no number."""

import numpy as np
import pytest

from skarxlag import (
    ARXLaguerre,
    ConditionMonitor,
    FaultOrderClassifier,
    envelope_spectrum,
    estimate_shaft_speed,
    make_detector,
    make_diagnoser,
    make_windows,
    signal_quality,
    window_verdicts,
)

LENGTH, RATE = 400, 1000.0
X = np.random.default_rng(0).normal(size=(40, LENGTH))
X[20:] = X[20:].cumsum(axis=1)
Y = np.repeat(["good", "worn"], 20)
FOURTH = np.arange(40) == 3
TIME = np.datetime64("2026-01-01", "s")
#: The hidden values would be the largest of all.
MASKED = np.ma.masked_greater(np.where(np.arange(LENGTH) < 300, X, 1e6), 1e5)


@pytest.fixture(scope="module")
def diagnoser():
    return make_diagnoser(healthy="good").fit(X, Y, rpm=np.repeat(900.0, 40))


@pytest.mark.parametrize(
    "use",
    [
        lambda X, _: make_windows(X[0], 100),
        lambda X, _: ARXLaguerre().fit(X),
        lambda X, _: make_diagnoser().fit(X, Y),
        lambda X, diagnoser: diagnoser.predict(X),
        lambda X, _: envelope_spectrum(X[0], RATE),
        lambda X, _: estimate_shaft_speed(X, RATE, 900),
        lambda X, _: FaultOrderClassifier(bearing="6205", sampling_rate=RATE).fit(X),
    ],
)
def test_masked_samples_and_flags_are_refused(diagnoser, use):
    with pytest.raises(ValueError, match="NaN"):
        use(MASKED, diagnoser)
    for flags in (X > 0, (X > 0).tolist()):
        with pytest.raises(ValueError, match=r"dtype == .*bool.*, expected real numb"):
            use(flags, diagnoser)


def test_masked_samples_are_no_signal(diagnoser):
    assert set(signal_quality(MASKED)) == {"not finite"}
    assert set(window_verdicts(diagnoser, MASKED, rpm=900)["verdict"]) == {"no signal"}
    monitor = ConditionMonitor(diagnoser, RATE, window_length=LENGTH)
    verdicts = monitor.update(np.ma.concatenate([X[0], MASKED[1]]), rpm=900)
    assert [verdict.quality for verdict in verdicts] == ["good", "not finite"]
    integers = np.ma.array(np.arange(LENGTH) % 7, mask=np.arange(LENGTH) == 3)
    assert signal_quality(integers[np.newaxis]).tolist() == ["not finite"]


@pytest.mark.parametrize("rpm", [True, np.True_, [True] * 40, np.ones(40, dtype=bool)])
def test_a_flag_is_no_speed(diagnoser, rpm):
    for use in (diagnoser.predict, make_detector().fit):
        with pytest.raises(ValueError, match="rpm must hold numbers, got"):
            use(X, rpm=rpm)
    with pytest.raises(ValueError, match="rpm must hold numbers, got"):
        window_verdicts(diagnoser, X, rpm=rpm)


@pytest.mark.parametrize(
    ("name", "given"),
    [
        ("rpm must hold numbers, got True", {"rpm": True}),
        ("time == True, expected a number", {"time": True}),
        (r"samples\.dtype == .*bool.*, expected real numbers", {"samples": X[0] > 0}),
    ],
)
def test_flags_in_a_monitor(diagnoser, name, given):
    monitor = ConditionMonitor(diagnoser, RATE, window_length=LENGTH)
    with pytest.raises(ValueError, match=name):
        monitor.update(**{"samples": X[0]} | given)
    assert monitor.counts["samples"] == 0
    with pytest.raises(ValueError, match="sampling_rate == True, expected a number"):
        ConditionMonitor(diagnoser, True)
    with pytest.raises(ValueError, match="sampling_rate == True, expected a number"):
        signal_quality(X, sampling_rate=True)


def test_a_masked_speed_is_unknown(diagnoser):
    speeds = np.ma.array(np.full(40, 900.0), mask=FOURTH)
    verdicts = window_verdicts(diagnoser, X, rpm=speeds)["verdict"]
    assert verdicts[3].startswith("no verdict: speed nan rpm") and verdicts[4] == "good"


@pytest.mark.parametrize(
    ("name", "values", "message"),
    [
        (
            "rpm",
            np.full(40, 900 + 1j),
            r"rpm must hold numbers|rpm.dtype == 'complex128'",
        ),
        ("rpm", np.full(40, TIME), "rpm"),
        ("sample_weight", np.ma.array(np.ones(40), mask=FOURTH), "weight contains NaN"),
        ("y", np.ma.array(Y, mask=FOURTH), "Masked labels in y: 1, expected none"),
        ("X", np.full((40, 400), TIME), "X.dtype"),
    ],
    ids=["complex speed", "time as speed", "masked weight", "masked label", "times"],
)
def test_values_that_are_no_real_numbers_are_refused_in_fit(name, values, message):
    given = {"X": X, "y": Y, name: values}
    with pytest.raises(ValueError, match=message):
        make_diagnoser().fit(given.pop("X"), given.pop("y"), **given)
