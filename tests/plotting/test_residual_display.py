import numpy as np
import pytest
from matplotlib.figure import Figure

from skarxlag import (
    make_alpio,
    make_diagnoser,
)
from skarxlag.plotting import ResidualDisplay

from .conftest import COLORS, assert_same_lines, heights

DRAW = ResidualDisplay.from_estimator


def test_residual_of_a_bank_and_its_thresholds(ax, bank, rig):
    window = rig.X[15]
    display = DRAW(bank, window, ax=ax)
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
    worn = DRAW(bank, window, model="worn", ax=Figure().subplots())
    np.testing.assert_array_equal(worn.line_.get_ydata(), trajectories.residual[0, 1])
    expected = {r"$\Delta$ worn": bank[2].isolation_thresholds_[1] * scale}
    assert heights(worn) == pytest.approx(expected, rel=1e-12)
    # A level exceeds the drawn threshold exactly where the ladder says so.
    exceeds = display.level > heights(display)[r"$\Gamma$"]
    assert exceeds == bank[2].detect(levels[np.newaxis])[0]


def test_power_shows_the_error(ax, rig):
    alpio = make_alpio(healthy="good").fit(rig.X, rig.y)
    display = DRAW(alpio, rig.X[0], model="worn", ax=ax)
    error = alpio[1].observe(alpio[0].transform(rig.X[:1])).error[0, 1]
    np.testing.assert_array_equal(display.residual, error)
    assert display.level == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-12)


def test_one_residual_has_all_rungs(ax, ladder, rig):
    display = DRAW(ladder, rig.X[0], ax=ax)
    decide = ladder[-1]
    assert display.model == "good"
    assert decide.rungs_.tolist() == ["good", "worn"]
    (threshold,) = decide.isolation_thresholds_
    assert display.isolation_thresholds == {"good": threshold, "worn": np.inf}
    # The healthy rung ends at Gamma, the highest nowhere: neither is drawn twice.
    assert heights(display) == {r"$\Gamma$": decide.detection_threshold_}
    assert decide.isolation_thresholds_[0] == decide.detection_threshold_


def test_estimator_and_predictions_draw_the_same(bank, rig, ax):
    options = {"condition": "worn", "conditions": ["worn", "good", "bent"]}
    one = DRAW(bank, rig.X[15], model="good", ax=ax, **options)
    other = ResidualDisplay(
        one.residual,
        level=one.level,
        detection_threshold=one.detection_threshold,
        isolation_thresholds=one.isolation_thresholds,
        model="good",
        **options,
    ).plot(ax=Figure().subplots())
    assert len(one.ax_.lines) == 7
    assert_same_lines(one.ax_, other.ax_)


def test_thresholds_stand_on_both_sides_in_the_colours_of_their_conditions(ax):
    display = ResidualDisplay(
        [1.0, -2.0],
        level=1.5,
        detection_threshold=1.2,
        isolation_thresholds={"a": 1.2, "b": 3.0, "c": np.inf},
        condition="b",
    ).plot(ax=ax)
    drawn = sorted(line.get_ydata()[0] for line in ax.lines[1:])
    assert drawn == [-3, -1.5, -1.2, 1.2, 1.5, 3]
    assert heights(display) == {r"$\Gamma$": 1.2, r"$\Delta$ b": 3.0}
    assert display.threshold_lines_[r"$\Delta$ b"].get_color() == COLORS[1]
    assert display.threshold_lines_[r"$\Gamma$"].get_color() == "black"
    assert display.line_.get_color() == COLORS[1]
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts == ["level of the window", r"$\Gamma$", r"$\Delta$ b"]
    assert ax.get_ylim() == pytest.approx((-3.24, 3.24))


def test_only_what_is_given_is_drawn(ax):
    display = ResidualDisplay([0.5, -0.5]).plot(ax=ax)
    assert display.level_line_ is None and not display.threshold_lines_
    assert len(ax.lines) == 1
    assert (
        display.line_.get_color() == "black" and ax.get_title(loc="left") == "residual"
    )
    zeros = ResidualDisplay([0.0, 0.0], model="a").plot(ax=Figure().subplots())
    assert zeros.ax_.get_title(loc="left") == "residual, model of a"


def test_what_cannot_be_shown_is_refused(bank, rig):
    message = r"model == 'bent', expected a model .* \['good', 'worn'\]"
    with pytest.raises(ValueError, match=message):
        DRAW(bank, rig.X[0], model="bent")
    with pytest.raises(ValueError, match="Step before the decision: ARXLaguerre"):
        DRAW(make_diagnoser().fit(rig.X, rig.y), rig.X[0])
    message = r"conditions == \['good'\], .* \['good', 'worn'\]"
    with pytest.raises(ValueError, match=message):
        DRAW(bank, rig.X[0], conditions=["good"])
    message = r"conditions == .*'a', 'a'.* each condition once"
    with pytest.raises(ValueError, match=message):
        ResidualDisplay([1.0], conditions=["a", "a"])
