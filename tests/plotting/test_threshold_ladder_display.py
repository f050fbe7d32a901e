import numpy as np
import pytest
from matplotlib.figure import Figure
from sklearn.pipeline import make_pipeline

from skarxlag import ARXLaguerre, PIObserver, ThresholdLadder
from skarxlag.plotting import ThresholdLadderDisplay

from .conftest import COLORS, heights

DRAW = ThresholdLadderDisplay.from_estimator
THREE = {"low": 1.0, "middle": 2.0, "high": np.inf}


def shown_levels(display):
    return {name: line.get_ydata() for name, line in display.lines_.items()}


def test_rungs_are_bands_and_verdicts_can_be_read_off(ladder, rig, ax):
    display = DRAW(ladder, rig.X, rig.y, ax=ax)
    levels = ladder[:-1].transform(rig.X)[:, 0]
    for name in ("good", "worn"):
        shown = shown_levels(display)[name]
        np.testing.assert_array_equal(shown, levels[rig.y == name])
    decide = ladder[-1]
    assert heights(display) == {r"$\Gamma$": decide.detection_threshold_}
    assert list(display.bands_) == decide.rungs_.tolist()
    bounds = {
        name: (band.get_y(), band.get_y() + band.get_height())
        for name, band in display.bands_.items()
    }
    (threshold,) = decide.isolation_thresholds_
    bottom, top = ax.get_ylim()
    assert bounds["good"] == pytest.approx((bottom, threshold), rel=1e-12)
    assert bounds["worn"] == pytest.approx((threshold, top), rel=1e-12)
    verdict = [
        next(name for name, (low, high) in bounds.items() if low < level <= high)
        for level in levels
    ]
    assert verdict == decide.predict(levels[:, np.newaxis]).tolist()


def test_powers_of_ten_are_labelled_with_plain_decimals(ax):
    display = ThresholdLadderDisplay(
        ["good", "worn"], [0.02, 50.0], detection_threshold=1.0
    )
    display.plot(ax=ax)
    ax.figure.canvas.draw()
    labels = [label.get_text() for label in ax.yaxis.get_ticklabels()]
    assert set(labels) >= {"0.1", "1", "10"}


def test_detection_shows_the_healthy_residual_and_gamma(
    bank, ladder, detector, rig, ax
):
    for estimator in (bank, ladder, detector):
        axes = Figure().subplots()
        display = DRAW(estimator, rig.X, rig.y, decision="detection", ax=axes)
        levels = estimator[:-1].transform(rig.X)[rig.y == "worn", 0]
        np.testing.assert_array_equal(shown_levels(display)["worn"], levels)
        assert heights(display) == {r"$\Gamma$": estimator[-1].detection_threshold_}
        assert not display.bands_ and display.rival_line_ is None
    default = DRAW(detector, rig.X, rig.y, ax=ax)
    assert heights(default) == heights(display)


def test_healthy_model_of_a_bank_need_not_be_the_first(rig, ax):
    bank = make_pipeline(ARXLaguerre(), PIObserver(), ThresholdLadder(healthy="worn"))
    bank.fit(rig.X, rig.y)
    display = DRAW(bank, rig.X, rig.y, decision="detection", ax=ax)
    assert display.conditions == ["worn", "good"]
    levels = bank[:-1].transform(rig.X)[:, 1]
    np.testing.assert_array_equal(
        shown_levels(display)["good"], levels[rig.y == "good"]
    )


def test_bank_shows_own_and_rival_relative_to_all(bank, rig, ax):
    display = DRAW(bank, rig.X, rig.y, ax=ax)
    levels = bank[:-1].transform(rig.X)
    relative = levels / np.sqrt(levels[:, :1] * levels[:, 1:])
    for column, name in enumerate(["good", "worn"]):
        own = relative[rig.y == name]
        np.testing.assert_allclose(
            shown_levels(display)[name], own[:, column], rtol=1e-12
        )
        x = display.lines_[name].get_xdata()
        of_name = np.isin(display.rival_line_.get_xdata(), x)
        rivals = display.rival_line_.get_ydata()[of_name]
        np.testing.assert_allclose(rivals, own[:, 1 - column], rtol=1e-12)
        np.testing.assert_array_equal(
            display.levels[rig.y == name] < rivals,
            bank.predict(rig.X[rig.y == name]) == name,
        )
        delta = display.threshold_lines_[rf"$\Delta$ {name}"]
        np.testing.assert_array_equal(
            delta.get_ydata(), bank[-1].isolation_thresholds_[column]
        )
        np.testing.assert_array_equal(delta.get_xdata(), [x[0], x[-1]])
    assert not display.bands_ and r"$\Gamma$" not in display.threshold_lines_


def test_estimator_may_be_the_last_step_alone(bank, ladder, rig, ax):
    for pipeline in (bank, ladder):
        whole = DRAW(pipeline, rig.X, rig.y, ax=ax)
        levels = pipeline[:-1].transform(rig.X)
        last = DRAW(pipeline[-1], -levels, rig.y, ax=Figure().subplots())
        np.testing.assert_array_equal(whole.levels, last.levels)
        assert heights(whole) == heights(last)


def test_several_residuals_that_are_no_bank_are_combined(ax):
    levels = np.array([[3.0, 4.0, 0.0], [0.3, 0.4, 0.0]])
    decide = ThresholdLadder().fit(np.repeat(levels, 2, axis=0), list("aabb"))
    display = DRAW(decide, levels, ["a", "b"], ax=ax)
    np.testing.assert_allclose(
        display.levels, np.array([5.0, 0.5]) / np.sqrt(3), rtol=1e-12
    )


def test_order_places_and_colours(ax):
    y = ["high", "low", "middle", "low"]
    display = ThresholdLadderDisplay(
        y, [3.0, 0.5, 1.5, 0.7], isolation_thresholds=THREE
    ).plot(ax=ax)
    assert list(display.lines_) == list(THREE)
    np.testing.assert_array_equal(display.lines_["low"].get_ydata(), [0.5, 0.7])
    places = np.concatenate([line.get_xdata() for line in display.lines_.values()])
    assert np.all(np.diff(places) > 0)
    assert [label.get_text() for label in ax.get_xticklabels()] == list(THREE)
    colors = [line.get_color() for line in display.lines_.values()]
    assert colors == COLORS[:3]
    assert display.bands_["middle"].get_y() == 1.0
    assert display.bands_["middle"].get_height() == pytest.approx(1.0)
    legend = [text.get_text() for text in ax.get_legend().get_texts()]
    assert legend == [r"$\Delta$ middle", r"$\Delta$ low"]
    turned = ThresholdLadderDisplay(
        y, [3.0, 0.5, 1.5, 0.7], conditions=["high", "middle", "low"]
    ).plot(ax=Figure().subplots())
    assert list(turned.lines_) == ["high", "middle", "low"]
    assert turned.lines_["high"].get_color() == COLORS[0]


def test_conditions_without_windows_keep_their_colours(ax):
    display = ThresholdLadderDisplay(
        ["high"], [3.0], isolation_thresholds=THREE, detection_threshold=0.9
    ).plot(ax=ax)
    assert list(display.lines_) == ["high"]
    assert display.lines_["high"].get_color() == COLORS[2]
    assert list(heights(display).values()) == [0.9, 1.0, 2.0]
    bank = ThresholdLadderDisplay(
        ["low"], [0.9], rivals=[1.1], isolation_thresholds=THREE
    ).plot(ax=Figure().subplots())
    assert heights(bank) == {r"$\Delta$ low": 1.0}


@pytest.mark.parametrize(
    ("name", "labels", "options", "message"),
    [
        (
            "bank",
            ["good"],
            {"decision": "both"},
            r"one of \('detection', 'isolation'\)",
        ),
        ("detector", ["good"], {"decision": "isolation"}, r"one of \('detection',\)"),
        (
            "bank",
            ["bent"],
            {},
            "Conditions in y: .*'bent'.*, expected models of the bank",
        ),
        (
            "bank",
            ["good"],
            {"conditions": ["worn"]},
            r"conditions == \['worn'\], .* all",
        ),
    ],
)
def test_wrong_parameters_are_refused(request, rig, name, labels, options, message):
    with pytest.raises(ValueError, match=message):
        DRAW(request.getfixturevalue(name), rig.X[:1], labels, **options)
