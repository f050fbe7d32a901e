import numpy as np

from skarxlag.plotting import SpeedAccuracyDisplay

from .conftest import COLORS


def test_accuracy_of_speed_pairs_from_predictions(ax):
    display = SpeedAccuracyDisplay(
        list("abab"), list("abaa"), train_rpm=[300] * 4, test_rpm=[300, 300, 500, 500]
    ).plot(ax=ax)
    np.testing.assert_array_equal(display.accuracy, [[1.0, 0.5]])
    (line,) = display.lines_
    np.testing.assert_array_equal(line.get_xydata(), [[300, 1], [500, 0.5]])
    hollow = ax.lines[1]
    np.testing.assert_array_equal(hollow.get_xydata(), [[300, 1]])
    assert hollow.get_markerfacecolor() == ax.get_facecolor()
    assert hollow.get_color() == line.get_color()
    assert line.get_label() == "calibrated at 300 rpm"


def test_lines_of_several_displays_on_one_axes_differ(ax):
    for name in ("A", "B"):
        display = SpeedAccuracyDisplay(
            list("aa"), list("ab"), train_rpm=[1, 1], test_rpm=[1, 2], name=name
        ).plot(ax=ax)
    labelled = [line for line in ax.lines if not line.get_label().startswith("_")]
    assert [line.get_color() for line in labelled] == COLORS[:2]
    assert labelled[0].get_marker() != labelled[1].get_marker()
    assert [line.get_label()[:16] for line in labelled] == [
        "A, calibrated at",
        "B, calibrated at",
    ]
    assert display.lines_ == labelled[1:]
