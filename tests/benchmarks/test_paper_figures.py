import numpy as np
from matplotlib.colors import to_hex
from sklearn.utils import Bunch

from benchmarks.figures.paper_figures import raw_signal_figure
from skarxlag.plotting._style import PALETTE


def test_raw_signals_keep_every_peak():
    rng = np.random.default_rng(0)
    signal = rng.normal(size=12_345)
    signal[[700, 9000]] = 50, -60
    rig = Bunch(
        data=signal.reshape(5, -1)[::-1],
        target=np.repeat("a", 5),
        target_names=["a"],
        rpm=np.repeat(300.0, 5),
        recording=np.repeat("r", 5),
        start=np.arange(0, 12_345, 2469)[::-1],
        sampling_rate=100.0,
    )
    figure = raw_signal_figure(rig, 300, "t")
    (area,) = figure.axes[0].collections
    vertices = area.get_paths()[0].vertices
    assert vertices[:, 1].max() == 50 and vertices[:, 1].min() == -60
    at_peak = vertices[np.abs(vertices[:, 1]) > 40, 0]
    np.testing.assert_allclose(np.unique(at_peak.round()), [7, 90], atol=1)
    assert to_hex(area.get_facecolor()[0]) == PALETTE[0]
    assert figure.axes[0].get_xlim() == (0, 123.45)
