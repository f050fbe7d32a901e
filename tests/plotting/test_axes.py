import sys

import matplotlib
import pytest

from skarxlag.plotting import (
    IdentificationDisplay,
    ResidualDisplay,
    SpeedAccuracyDisplay,
    ThresholdLadderDisplay,
)

#: How to draw each display on new axes.
DRAW = {
    "identification": lambda: IdentificationDisplay([1, 2], [1, 1]).plot(),
    "residual": lambda: ResidualDisplay([1, 2], level=1).plot(),
    "ladder": lambda: ThresholdLadderDisplay(["a"], [1.0]).plot(),
    "speeds": lambda: SpeedAccuracyDisplay(
        ["a"], ["a"], train_rpm=1, test_rpm=[2]
    ).plot(),
}


@pytest.mark.parametrize("draw", DRAW.values(), ids=DRAW)
def test_new_axes_come_from_pyplot(draw):
    from matplotlib import pyplot

    before = matplotlib.get_backend()
    pyplot.switch_backend("agg")
    try:
        assert draw().figure_ is pyplot.gcf()
        assert draw().figure_ is pyplot.gcf() and len(pyplot.get_fignums()) == 2
    finally:
        pyplot.close("all")
        pyplot.switch_backend(before)


@pytest.mark.parametrize("draw", DRAW.values(), ids=DRAW)
def test_missing_matplotlib_is_named_with_its_command(monkeypatch, draw):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.delitem(sys.modules, "matplotlib.pyplot", raising=False)
    with pytest.raises(ImportError, match=r"pip install 'skarxlag\[plot\]'"):
        draw()
