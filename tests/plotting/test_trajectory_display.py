import numpy as np
import pytest
from matplotlib.figure import Figure

from skarxlag.plotting import TrajectoryDisplay
from skarxlag.plotting._style import NEUTRAL, PALETTE


def test_lines_carry_what_the_observer_returns(bank, rig, axes):
    display = TrajectoryDisplay.from_estimator(bank, rig.X[15], model="worn", axes=axes)
    innovations = bank[0].transform(rig.X[15:16])
    observed = bank[1].observe(innovations)
    np.testing.assert_array_equal(display.innovations_line_.get_ydata(), innovations[0, 1])
    np.testing.assert_array_equal(display.error_line_.get_ydata(), observed.error[0, 1])
    estimate = display.fault_estimate_line_.get_ydata()
    np.testing.assert_array_equal(estimate, observed.fault_estimate[0, 1])
    assert list(display.axes_) == list(axes) and display.figure_ is axes[0].figure
    healthy = TrajectoryDisplay.from_estimator(bank, rig.X[15], axes=Figure().subplots(2))
    assert healthy.model == "good" and not np.array_equal(healthy.error, display.error)


def test_estimator_and_predictions_draw_the_same(bank, rig, axes):
    given = {"condition": "worn", "conditions": ["good", "worn"], "sampling_rate": 10.0}
    one = TrajectoryDisplay.from_estimator(bank, rig.X[15], model="good", axes=axes, **given)
    other = TrajectoryDisplay.from_predictions(
        one.innovations,
        one.error,
        one.fault_estimate,
        model="good",
        axes=Figure().subplots(2),
        **given,
    )
    for first, second in zip(one.axes_, other.axes_, strict=True):
        for a, b in zip(first.lines, second.lines, strict=True):
            np.testing.assert_array_equal(a.get_xydata(), b.get_xydata())
            assert a.get_color() == b.get_color() and a.get_label() == b.get_label()


def test_colours_time_axis_and_line_keywords(axes):
    display = TrajectoryDisplay.from_predictions([1, 2], [1, 1], [0, 3], axes=axes)
    assert display.fault_estimate_line_.get_color() == NEUTRAL
    assert axes[1].get_xlabel() == "Sample"
    assert axes[0].get_legend().get_texts()[0].get_text() == "innovations"
    display = TrajectoryDisplay.from_predictions(
        [1, 2],
        [1, 1],
        [0, 3],
        model="a",
        condition="b",
        conditions=["a", "b"],
        sampling_rate=100.0,
        axes=Figure().subplots(2),
    )
    assert display.error_line_.get_color() == PALETTE[1]
    np.testing.assert_array_equal(display.error_line_.get_xdata(), [0, 10])
    legend = display.axes_[0].get_legend().get_texts()
    assert legend[0].get_text() == "innovations, model of a"
    display.plot(axes=Figure().subplots(2), linewidth=4)
    assert display.fault_estimate_line_.get_linewidth() == 4


def test_wrong_arrays_are_refused():
    with pytest.raises(ValueError, match=r"innovations, error and fault_estimate have the shapes"):
        TrajectoryDisplay.from_predictions([1, 2], [1, 2], [1])
