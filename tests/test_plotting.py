import sys

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.signal import lfilter
from sklearn.dummy import DummyClassifier
from sklearn.pipeline import make_pipeline

from skarxlag import (
    ARXLaguerre,
    FaultDetector,
    PIObserver,
    ThresholdLadder,
    make_alpio,
    make_diagnoser,
    make_extended_state_pio,
    speed_splits,
)
from skarxlag.plotting import ResidualDisplay, SpeedAccuracyDisplay, TrajectoryDisplay

rng = np.random.default_rng(0)
Y = np.repeat(["good", "worn"], 12)
X = np.concatenate([lfilter([1.0], [1.0, a], rng.normal(size=(12, 300))) for a in (-0.9, 0.9)])
RPM = np.tile(np.repeat([300.0, 500.0], 6), 2)
RECORDING = np.repeat(["a", "b", "c", "d"], 6)


@pytest.fixture
def ax():
    return Figure().subplots()


@pytest.fixture(scope="module")
def bank():
    return make_extended_state_pio(healthy="good").fit(X, Y)


def test_accuracy_of_speed_pairs_from_predictions(ax):
    display = SpeedAccuracyDisplay.from_predictions(
        list("abab"), list("abaa"), train_rpm=[300] * 4, test_rpm=[300, 300, 500, 500], ax=ax
    )
    np.testing.assert_array_equal(display.accuracy, [[1.0, 0.5]])
    (line,) = display.lines_
    np.testing.assert_array_equal(line.get_xydata(), [[300, 1], [500, 0.5]])
    hollow = ax.lines[1]
    np.testing.assert_array_equal(hollow.get_xydata(), [[300, 1]])
    assert hollow.get_markerfacecolor() == "white" and hollow.get_color() == line.get_color()
    assert line.get_label() == "calibrated at 300 rpm"
    assert display.ax_ is ax and display.figure_ is ax.figure


def test_pairs_that_were_not_tested_are_left_out(ax):
    display = SpeedAccuracyDisplay.from_predictions(
        list("aa"), list("aa"), train_rpm=[300, 500], test_rpm=[500, 300], ax=ax
    )
    assert np.isnan(display.accuracy).tolist() == [[True, False], [False, True]]
    assert [len(line.get_xdata()) for line in display.lines_] == [1, 1]


@pytest.mark.parametrize("train_rpm", [None, 500])
@pytest.mark.parametrize("recording", [None, RECORDING])
def test_accuracy_of_speed_pairs_from_estimator(ax, train_rpm, recording):
    estimator = make_alpio()
    display = SpeedAccuracyDisplay.from_estimator(
        estimator, X, Y, rpm=RPM, recording=recording, train_rpm=train_rpm, name="A", ax=ax
    )
    splits = speed_splits(
        RPM, recording=recording, train_rpm=train_rpm, same_speed=recording is not None
    )
    for train, test in splits:
        row = list(display.train_rpm).index(RPM[train[0]])
        column = list(display.test_rpm).index(RPM[test[0]])
        expected = make_alpio().fit(X[train], Y[train]).score(X[test], Y[test])
        assert display.accuracy[row, column] == expected
    assert np.isfinite(display.accuracy).sum() == len(splits)
    assert ax.get_legend().get_texts()[-1].get_text() == "A, calibrated at 500 rpm"
    assert not hasattr(estimator[0], "coef_")


def test_name_of_the_class_is_the_default_and_plot_can_be_repeated(ax):
    display = SpeedAccuracyDisplay.from_estimator(DummyClassifier(), X, Y, rpm=RPM, ax=ax)
    assert display.name == "DummyClassifier"
    other = Figure().subplots()
    display.plot(ax=other, name="B", linestyle=":")
    assert display.lines_[0].get_label() == "B, calibrated at 300 rpm"
    assert display.lines_[0].get_linestyle() == ":" and display.ax_ is other


def test_residual_of_a_bank_and_its_thresholds(ax, bank):
    window = X[15]
    display = ResidualDisplay.from_estimator(bank, window, ax=ax)
    innovations = bank[0].transform(window[np.newaxis])
    trajectories = bank[1].observe(innovations)
    np.testing.assert_array_equal(display.line_.get_ydata(), trajectories.residual[0, 0])
    np.testing.assert_array_equal(np.abs(display.residuals), trajectories.switching_gain[0])
    lines = {key: line.get_ydata()[0] for key, line in display.threshold_lines_.items()}
    assert lines[r"$\Gamma$ (detection)"] == bank[2].detection_threshold_
    levels = bank[1].transform(innovations)[0]
    scale = np.sqrt(levels[0] * levels[1])
    assert lines[r"$\Delta$ of good"] == pytest.approx(
        bank[2].isolation_thresholds_[0] * scale, rel=1e-12
    )
    display.plot(ax=Figure().subplots(), model="worn", color="red")
    assert list(display.threshold_lines_) == [r"$\Delta$ of worn"]
    np.testing.assert_array_equal(display.line_.get_ydata(), trajectories.residual[0, 1])
    assert display.line_.get_color() == "red"
    # A threshold bounds the residual exactly where the ladder says so.
    exceeds = levels[0] > bank[2].detection_threshold_
    assert exceeds == bank[2].detect(levels[np.newaxis])[0]


def test_power_shows_the_error(ax):
    alpio = make_alpio(healthy="good").fit(X, Y)
    display = ResidualDisplay.from_estimator(alpio, X[0], model="worn", ax=ax)
    error = alpio[1].observe(alpio[0].transform(X[:1])).error[0]
    np.testing.assert_array_equal(display.residuals, error)
    level = np.sqrt(np.mean(error**2, axis=1))
    np.testing.assert_allclose(level, alpio[:-1].transform(X[:1])[0], rtol=1e-12)


def test_one_residual_has_all_rungs(ax):
    ladder = make_pipeline(
        ARXLaguerre(healthy="good", unit_rms=False), PIObserver(), ThresholdLadder(healthy="good")
    ).fit(X, Y)
    display = ResidualDisplay.from_estimator(ladder, X[0], ax=ax)
    assert display.models == ["good"]
    values = [line.get_ydata()[0] for line in display.threshold_lines_.values()]
    assert values == [ladder[-1].detection_threshold_, *ladder[-1].isolation_thresholds_]


def test_detector_has_its_threshold(ax):
    detector = make_pipeline(ARXLaguerre(unit_rms=False), PIObserver(), FaultDetector()).fit(X[:12])
    display = ResidualDisplay.from_estimator(detector, X[0], ax=ax)
    (line,) = display.threshold_lines_.values()
    assert line.get_ydata()[0] == detector[-1].detection_threshold_


def test_trajectories(bank):
    window = 7 + 100 * X[15]
    axes = Figure().subplots(3)
    display = TrajectoryDisplay.from_estimator(bank, window, model="worn", axes=axes)
    lines = [ax.lines for ax in axes]
    n = len(display.output)
    np.testing.assert_array_equal(lines[0][0].get_ydata(), window[-n:])
    # Output less prediction is the innovation, in the unit of the sensor.
    scale = np.std(window)
    innovations = (lines[0][0].get_ydata() - lines[0][1].get_ydata()) / scale
    np.testing.assert_allclose(lines[1][0].get_ydata(), innovations, atol=1e-10)
    estimate = bank[1].observe(bank[0].transform(window[np.newaxis])).fault_estimate[0, 1]
    np.testing.assert_array_equal(lines[2][0].get_ydata(), estimate)
    healthy = TrajectoryDisplay.from_estimator(bank, window, axes=Figure().subplots(3))
    assert healthy.model == "good" and not np.array_equal(healthy.prediction, display.prediction)


def test_windows_with_inputs():
    windows = np.stack([X, rng.normal(size=X.shape)], axis=1)
    diagnoser = make_alpio().fit(windows, Y)
    display = TrajectoryDisplay.from_estimator(diagnoser, windows[0], axes=Figure().subplots(3))
    np.testing.assert_array_equal(display.output, X[0, -len(display.output) :])


@pytest.mark.parametrize("display", [ResidualDisplay, TrajectoryDisplay])
def test_what_cannot_be_shown_is_refused(display, bank):
    with pytest.raises(ValueError, match=r"model='bent' is not a model .* \['good', 'worn'\]"):
        display.from_estimator(bank, X[0], model="bent")
    with pytest.raises(ValueError, match="CepstralResidual before its decision"):
        display.from_estimator(make_diagnoser().fit(X, Y), X[0])


def test_whiteness_has_no_trajectory():
    white = make_pipeline(ARXLaguerre(), PIObserver(evaluation="whiteness"), ThresholdLadder())
    with pytest.raises(ValueError, match="evaluation='whiteness'"):
        ResidualDisplay.from_estimator(white.fit(X, Y), X[0])


def test_new_axes_come_from_pyplot(bank):
    from matplotlib import pyplot

    before = matplotlib.get_backend()
    pyplot.switch_backend("agg")
    try:
        display = TrajectoryDisplay.from_estimator(bank, X[0])
        assert display.figure_ is pyplot.gcf() and len(display.axes_) == 3
        assert ResidualDisplay.from_estimator(bank, X[0]).figure_ is pyplot.gcf()
    finally:
        pyplot.close("all")
        pyplot.switch_backend(before)


def test_missing_matplotlib_tells_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.delitem(sys.modules, "matplotlib.pyplot", raising=False)
    with pytest.raises(ImportError, match=r"pip install 'skarxlag\[plot\]'"):
        SpeedAccuracyDisplay.from_predictions(["a"], ["a"], train_rpm=[1], test_rpm=[2])
