import numpy as np
import pytest
from matplotlib.figure import Figure
from sklearn.metrics import r2_score

from skarxlag import ARXLaguerre, make_alpio
from skarxlag.plotting import IdentificationDisplay

from .conftest import COLORS

DRAW = IdentificationDisplay.from_estimator


def test_lines_carry_output_prediction_and_error(bank, rig, axes):
    window = 7 + 100 * rig.X[15]
    display = DRAW(bank, window, model="worn", axes=axes)
    prediction = bank[0].predict_output(window[np.newaxis])[0, 1]
    output = window[-len(prediction) :]
    np.testing.assert_array_equal(display.output_line_.get_ydata(), output)
    np.testing.assert_array_equal(display.prediction_line_.get_ydata(), prediction)
    np.testing.assert_array_equal(display.error_line_.get_ydata(), output - prediction)
    # Output less prediction is the innovation, in the unit of the sensor.
    innovations = bank[0].transform(window[np.newaxis])[0, 1]
    error = display.error_line_.get_ydata() / np.std(window)
    np.testing.assert_allclose(error, innovations, atol=1e-10)


def test_fit_is_that_of_the_model_and_stands_in_the_legend(bank, rig, axes):
    display = DRAW(bank, rig.X[3], axes=axes)
    # The transient is a small part of the window; beyond it both see the same samples.
    error = display.output - display.prediction
    spread = display.output - display.output.mean()
    expected = 100 * (1 - np.sqrt(np.sum(error**2) / np.sum(spread**2)))
    assert display.fit_percentage == pytest.approx(expected, rel=1e-12)
    assert expected == pytest.approx(
        100 * (1 - np.sqrt(1 - r2_score(display.output, display.prediction))), rel=1e-9
    )
    label = axes[0].get_legend().get_texts()[1].get_text()
    assert label == f"prediction, model of good: fit {expected:.1f} %"


def test_model_of_the_healthy_condition_is_the_default(bank, rig, axes):
    assert DRAW(bank, rig.X[0], axes=axes).model == "good"
    alpio = make_alpio(healthy="worn").fit(rig.X, rig.y)
    assert DRAW(alpio, rig.X[0], axes=axes).model == "worn"
    identify = ARXLaguerre().fit(rig.X, rig.y)
    display = DRAW(identify, rig.X[0], model="worn", axes=axes)
    prediction = identify.predict_output(rig.X[:1])[0, 1]
    np.testing.assert_array_equal(display.prediction, prediction)
    assert display.conditions == ["good", "worn"]


def test_windows_with_inputs_show_their_output(rig, axes):
    noise = np.random.default_rng(1).normal(size=rig.X.shape)
    windows = np.stack([rig.X, noise], axis=1)
    display = DRAW(ARXLaguerre().fit(windows, rig.y), windows[0], axes=axes)
    np.testing.assert_array_equal(display.output, rig.X[0, -len(display.output) :])


@pytest.mark.parametrize(
    ("options", "color"),
    [
        ({}, "#7a7a7a"),
        ({"condition": "b"}, COLORS[0]),
        ({"condition": "b", "conditions": ["a", "b"]}, COLORS[1]),
    ],
)
def test_condition_and_order_give_the_colour(axes, options, color):
    display = IdentificationDisplay([1.0, 2.0, 0.0], np.ones(3), **options).plot(axes)
    lines = (display.error_line_, display.output_line_)
    assert [line.get_color() for line in lines] == [color, color]


def test_time_axis(axes):
    display = IdentificationDisplay(
        np.array([1.0, 2.0, 0.0]), np.ones(3), sampling_rate=2000.0
    )
    display.plot(axes=axes)
    np.testing.assert_array_equal(display.output_line_.get_xdata(), [0, 0.5, 1])
    assert axes[1].get_xlabel() == "Time (ms)"
    display.sampling_rate = None
    assert display.plot(axes=Figure().subplots(2)).axes_[1].get_xlabel() == "Sample"


def test_what_cannot_be_shown_is_refused(bank, rig):
    message = r"model == 'bent', expected a model .* \['good', 'worn'\]"
    with pytest.raises(ValueError, match=message):
        DRAW(bank, rig.X[0], model="bent")
    message = r"conditions == \['a'\], expected each condition once"
    with pytest.raises(ValueError, match=message):
        IdentificationDisplay([1.0], [1.0], condition="b", conditions=["a"])
