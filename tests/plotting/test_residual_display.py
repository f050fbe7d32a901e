import numpy as np
import pytest
from matplotlib.figure import Figure
from sklearn.pipeline import make_pipeline

from skarxlag import (
    ARXLaguerre,
    PIObserver,
    ThresholdLadder,
    make_alpio,
    make_diagnoser,
)
from skarxlag.plotting import ResidualDisplay
from skarxlag.plotting._style import PALETTE, ink


def heights(display):
    return {
        label: line.get_ydata()[0] for label, line in display.threshold_lines_.items()
    }


def test_residual_of_a_bank_and_its_thresholds(ax, bank, rig):
    window = rig.X[15]
    display = ResidualDisplay.from_estimator(bank, window, ax=ax)
    innovations = bank[0].transform(window[np.newaxis])
    trajectories = bank[1].observe(innovations)
    np.testing.assert_array_equal(
        display.line_.get_ydata(), trajectories.residual[0, 0]
    )
    np.testing.assert_array_equal(
        np.abs(display.residual), trajectories.switching_gain[0, 0]
    )
    levels = bank[1].transform(innovations)[0]
    assert display.level == levels[0] == display.level_line_.get_ydata()[0]
    scale = np.sqrt(levels[0] * levels[1])
    expected = {
        r"$\Gamma$": bank[2].detection_threshold_,
        r"$\Delta$ good": bank[2].isolation_thresholds_[0] * scale,
    }
    assert heights(display) == pytest.approx(expected, rel=1e-12)
    worn = ResidualDisplay.from_estimator(
        bank, window, model="worn", ax=Figure().subplots()
    )
    np.testing.assert_array_equal(worn.line_.get_ydata(), trajectories.residual[0, 1])
    expected = {r"$\Delta$ worn": bank[2].isolation_thresholds_[1] * scale}
    assert heights(worn) == pytest.approx(expected, rel=1e-12)
    # A level exceeds the drawn threshold exactly where the ladder says so.
    exceeds = display.level > heights(display)[r"$\Gamma$"]
    assert exceeds == bank[2].detect(levels[np.newaxis])[0]


def test_power_shows_the_error(ax, rig):
    alpio = make_alpio(healthy="good").fit(rig.X, rig.y)
    display = ResidualDisplay.from_estimator(alpio, rig.X[0], model="worn", ax=ax)
    error = alpio[1].observe(alpio[0].transform(rig.X[:1])).error[0, 1]
    np.testing.assert_array_equal(display.residual, error)
    assert display.level == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-12)


def test_one_residual_has_all_rungs(ax, ladder, rig):
    display = ResidualDisplay.from_estimator(ladder, rig.X[0], ax=ax)
    decide = ladder[-1]
    assert display.model == "good"
    assert (
        list(display.isolation_thresholds) == decide.rungs_.tolist() == ["good", "worn"]
    )
    assert list(display.isolation_thresholds.values()) == [
        *decide.isolation_thresholds_,
        np.inf,
    ]
    # The healthy rung ends at Gamma, the highest nowhere: neither is drawn twice.
    assert heights(display) == {r"$\Gamma$": decide.detection_threshold_}
    assert decide.isolation_thresholds_[0] == decide.detection_threshold_


def test_detector_has_its_threshold(ax, detector, rig):
    display = ResidualDisplay.from_estimator(
        detector, rig.X[0], condition="good", ax=ax
    )
    assert heights(display) == {r"$\Gamma$": detector[-1].detection_threshold_}
    assert display.line_.get_color() == PALETTE[0]


def test_estimator_and_predictions_draw_the_same(bank, rig, ax):
    given = {"condition": "worn", "conditions": ["worn", "good", "bent"]}
    one = ResidualDisplay.from_estimator(bank, rig.X[15], model="good", ax=ax, **given)
    other = ResidualDisplay(
        one.residual,
        level=one.level,
        detection_threshold=one.detection_threshold,
        isolation_thresholds=one.isolation_thresholds,
        model="good",
        **given,
    ).plot(ax=Figure().subplots())
    assert len(one.ax_.lines) == len(other.ax_.lines) == 7
    for a, b in zip(one.ax_.lines, other.ax_.lines, strict=True):
        np.testing.assert_array_equal(a.get_xydata(), b.get_xydata())
        assert a.get_color() == b.get_color() and a.get_label() == b.get_label()


def test_thresholds_stand_on_both_sides_in_the_colours_of_their_conditions(ax):
    display = ResidualDisplay(
        [1.0, -2.0],
        level=1.5,
        detection_threshold=1.2,
        isolation_thresholds={"a": 1.2, "b": 3.0, "c": np.inf},
        condition="b",
    ).plot(ax=ax)
    assert sorted(line.get_ydata()[0] for line in ax.lines[1:]) == [
        -3,
        -1.5,
        -1.2,
        1.2,
        1.5,
        3,
    ]
    assert heights(display) == {r"$\Gamma$": 1.2, r"$\Delta$ b": 3.0}
    assert display.threshold_lines_[r"$\Delta$ b"].get_color() == PALETTE[1]
    assert display.threshold_lines_[r"$\Gamma$"].get_color() == ink()
    assert display.line_.get_color() == PALETTE[1]
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts == ["level of the window", r"$\Gamma$", r"$\Delta$ b"]
    assert ax.get_ylim() == pytest.approx((-3.24, 3.24))


def test_only_what_is_given_is_drawn(ax):
    display = ResidualDisplay([0.5, -0.5]).plot(ax=ax)
    assert (
        display.level_line_ is None
        and not display.threshold_lines_
        and len(ax.lines) == 1
    )
    assert display.line_.get_color() == ink() and ax.get_title(loc="left") == "residual"
    zeros = ResidualDisplay([0.0, 0.0], model="a").plot(ax=Figure().subplots())
    assert zeros.ax_.get_title(loc="left") == "residual, model of a"


@pytest.mark.slow
def test_repeated_plots(ax):
    display = ResidualDisplay([0.5, -0.5], condition=2).plot(ax=ax)
    assert ax.get_title(loc="left") == "residual, window of 2"
    other = Figure().subplots()
    assert display.plot(ax=other).ax_ is other and display.figure_ is other.figure


def test_what_cannot_be_shown_is_refused(bank, rig):
    with pytest.raises(
        ValueError, match=r"model == 'bent', expected a model .* \['good', 'worn'\]"
    ):
        ResidualDisplay.from_estimator(bank, rig.X[0], model="bent")
    with pytest.raises(ValueError, match="Step before the decision: ARXLaguerre"):
        ResidualDisplay.from_estimator(make_diagnoser().fit(rig.X, rig.y), rig.X[0])
    with pytest.raises(
        ValueError, match=r"conditions == \['good'\], .* \['good', 'worn'\]"
    ):
        ResidualDisplay.from_estimator(bank, rig.X[0], conditions=["good"])


def test_conditions_that_repeat_are_refused():
    with pytest.raises(
        ValueError, match=r"conditions == .*'a', 'a'.* each condition once"
    ):
        ResidualDisplay([1.0], conditions=["a", "a"])


def test_whiteness_has_no_trajectory(rig):
    white = make_pipeline(
        ARXLaguerre(), PIObserver(evaluation="whiteness"), ThresholdLadder()
    )
    with pytest.raises(ValueError, match="evaluation == 'whiteness'"):
        ResidualDisplay.from_estimator(white.fit(rig.X, rig.y), rig.X[0])


def test_thresholds_are_drawn_from_the_lowest_to_the_highest(ax):
    thresholds = {"a": 1.0, "d": 4.0, "b": 2.0, "c": 3.0}
    display = ResidualDisplay(
        [1.0, -2.0], level=2.5, isolation_thresholds=thresholds
    ).plot(ax=ax)
    assert list(heights(display).values()) == [1.0, 2.0, 3.0, 4.0]
