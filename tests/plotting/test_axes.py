import sys

import matplotlib
import pytest
from matplotlib import pyplot
from matplotlib.figure import Figure

from skarxlag.plotting import (
    IdentificationDisplay,
    ResidualDisplay,
    ThresholdLadderDisplay,
)

DISPLAYS = {
    "identification": IdentificationDisplay([1, 2], [1, 1]),
    "residual": ResidualDisplay([1, 2], level=1),
    "ladder": ThresholdLadderDisplay(["a"], [1.0]),
}
every_display = pytest.mark.parametrize("display", DISPLAYS.values(), ids=DISPLAYS)


@every_display
def test_new_axes_come_from_pyplot(display):
    before = matplotlib.get_backend()
    pyplot.switch_backend("agg")
    try:
        assert display.plot().figure_ is pyplot.gcf()
        assert display.plot().figure_ is pyplot.gcf() and len(pyplot.get_fignums()) == 2
    finally:
        pyplot.close("all")
        pyplot.switch_backend(before)


@every_display
def test_given_axes_are_drawn_into_each_time(display):
    n_axes = 2 if isinstance(display, IdentificationDisplay) else 1
    for _ in range(2):
        axes = Figure().subplots(n_axes, squeeze=False)[:, 0]
        assert display.plot(axes if n_axes > 1 else axes[0]).axes_.tolist() == [*axes]
        assert display.ax_ is axes[0] and display.figure_ is axes[0].figure
        assert all(ax.lines for ax in axes)


@every_display
def test_missing_matplotlib_is_named_with_its_command(monkeypatch, display):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.delitem(sys.modules, "matplotlib.pyplot", raising=False)
    with pytest.raises(ImportError, match=r"pip install 'skarxlag\[plot\]'"):
        display.plot()
