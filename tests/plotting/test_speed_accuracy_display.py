import matplotlib.style
import numpy as np
import pytest
from matplotlib.figure import Figure
from sklearn.dummy import DummyClassifier

from skarxlag import SpeedSplit, make_alpio
from skarxlag.plotting import SpeedAccuracyDisplay
from skarxlag.plotting._style import PALETTE


def test_accuracy_of_speed_pairs_from_predictions(ax):
    display = SpeedAccuracyDisplay.from_predictions(
        list("abab"), list("abaa"), train_rpm=[300] * 4, test_rpm=[300, 300, 500, 500], ax=ax
    )
    np.testing.assert_array_equal(display.accuracy, [[1.0, 0.5]])
    (line,) = display.lines_
    np.testing.assert_array_equal(line.get_xydata(), [[300, 1], [500, 0.5]])
    hollow = ax.lines[1]
    np.testing.assert_array_equal(hollow.get_xydata(), [[300, 1]])
    assert (
        hollow.get_markerfacecolor() == ax.get_facecolor()
        and hollow.get_color() == line.get_color()
    )
    assert line.get_label() == "calibrated at 300 rpm"
    assert display.ax_ is ax and display.figure_ is ax.figure


def test_pairs_that_were_not_tested_are_left_out(ax):
    display = SpeedAccuracyDisplay.from_predictions(
        list("aa"), list("aa"), train_rpm=[300, 500], test_rpm=[500, 300], ax=ax
    )
    assert np.isnan(display.accuracy).tolist() == [[True, False], [False, True]]
    assert [len(line.get_xdata()) for line in display.lines_] == [1, 1]


@pytest.mark.parametrize("train_rpm", [None, 500])
@pytest.mark.parametrize("halves", [False, True])
def test_accuracy_of_speed_pairs_from_estimator(ax, rig, train_rpm, halves):
    recording = rig.recording if halves else None
    estimator = make_alpio()
    display = SpeedAccuracyDisplay.from_estimator(
        estimator,
        rig.X,
        rig.y,
        rpm=rig.rpm,
        recording=recording,
        train_rpm=train_rpm,
        name="A",
        ax=ax,
    )
    groups = np.column_stack([rig.rpm, rig.recording]) if halves else rig.rpm
    splits = list(SpeedSplit(train_rpm=train_rpm, same_speed=halves).split(rig.X, groups=groups))
    for train, test in splits:
        row = list(display.train_rpm).index(rig.rpm[train[0]])
        column = list(display.test_rpm).index(rig.rpm[test[0]])
        expected = make_alpio().fit(rig.X[train], rig.y[train]).score(rig.X[test], rig.y[test])
        assert display.accuracy[row, column] == expected
    assert np.isfinite(display.accuracy).sum() == len(splits)
    assert ax.get_legend().get_texts()[-1].get_text() == "A, calibrated at 500 rpm"
    assert not hasattr(estimator[0], "coef_")


def test_name_of_the_class_is_the_default_and_plot_can_be_repeated(ax, rig):
    display = SpeedAccuracyDisplay.from_estimator(
        DummyClassifier(), rig.X, rig.y, rpm=rig.rpm, ax=ax
    )
    assert display.name == "DummyClassifier"
    other = Figure().subplots()
    display.plot(ax=other, name="B", linestyle=":")
    assert display.lines_[0].get_label() == "B, calibrated at 300 rpm"
    assert display.lines_[0].get_linestyle() == ":" and display.ax_ is other


def test_lines_of_several_displays_on_one_axes_differ(ax):
    for name in ("A", "B"):
        display = SpeedAccuracyDisplay.from_predictions(
            list("aa"), list("ab"), train_rpm=[1, 1], test_rpm=[1, 2], name=name, ax=ax
        )
    labelled = [line for line in ax.lines if not line.get_label().startswith("_")]
    assert [line.get_color() for line in labelled] == list(PALETTE[:2])
    assert labelled[0].get_marker() != labelled[1].get_marker()
    assert display.lines_ == labelled[1:]


def test_hollow_markers_show_the_page_behind_them():
    with matplotlib.style.context("dark_background"):
        dark = Figure().subplots()
    SpeedAccuracyDisplay.from_predictions(["a"], ["a"], train_rpm=[1], test_rpm=[1], ax=dark)
    assert dark.lines[1].get_markerfacecolor() == (0, 0, 0, 1)
