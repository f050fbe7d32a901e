from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.signal import lfilter
from sklearn.pipeline import make_pipeline

from skarxlag import (
    ARXLaguerre,
    ExtendedStatePIObserver,
    PIObserver,
    ThresholdLadder,
    make_alpio,
)
from skarxlag.plotting import condition_styles

#: Colours of the first conditions.
COLORS = [style["color"] for style in condition_styles(range(8)).values()]


def heights(display):
    """Heights of the thresholds by label."""
    return {
        label: line.get_ydata()[0] for label, line in display.threshold_lines_.items()
    }


def assert_same_lines(one, other):
    """Compare the lines of two axes."""
    for a, b in zip(one.lines, other.lines, strict=True):
        np.testing.assert_array_equal(a.get_xydata(), b.get_xydata())
        assert a.get_color() == b.get_color() and a.get_label() == b.get_label()


@pytest.fixture
def ax():
    return Figure().subplots()


@pytest.fixture
def axes():
    return Figure().subplots(2)


@pytest.fixture(scope="session")
def rig():
    """Windows of two colours and levels, at two speeds."""
    rng = np.random.default_rng(0)
    parts = [
        size * lfilter([1.0], [1.0, a], rng.normal(size=(12, 300)))
        for size, a in ((1, -0.9), (3, 0.9))
    ]
    return SimpleNamespace(
        X=np.concatenate(parts),
        y=np.repeat(["good", "worn"], 12),
        rpm=np.tile(np.repeat([300.0, 500.0], 6), 2),
        recording=np.repeat(["a", "b", "c", "d"], 6),
    )


@pytest.fixture(scope="session")
def bank(rig):
    diagnoser = make_alpio(healthy="good").set_params(
        observe=ExtendedStatePIObserver(n_observers=1)
    )
    return diagnoser.fit(rig.X, rig.y)


@pytest.fixture(scope="session")
def ladder(rig):
    return make_pipeline(
        ARXLaguerre(healthy="good", unit_rms=False),
        PIObserver(),
        ThresholdLadder(healthy="good"),
    ).fit(rig.X, rig.y)


@pytest.fixture(scope="session")
def detector(rig):
    healthy = make_pipeline(
        ARXLaguerre(unit_rms=False), PIObserver(), ThresholdLadder()
    )
    return healthy.fit(rig.X[:12], rig.y[:12])
