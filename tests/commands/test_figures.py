import numpy as np
import pytest
from matplotlib.colors import to_hex
from sklearn.utils import Bunch

from skarxlag import ExtendedStatePIObserver, make_alpio
from skarxlag.accuracy_tables import scored_windows
from skarxlag.commands import figures
from skarxlag.datasets import simulate_rig
from skarxlag.plotting._style import PALETTE

NAMES = ["Normal", "IR", "OR"]


@pytest.fixture(scope="module")
def rig():
    return simulate_rig(rpm=(300, 500), crack_mm=6, conditions=NAMES, n_samples=4800)


@pytest.fixture(scope="module")
def bank(rig):
    chosen = rig.rpm == 500
    diagnoser = make_alpio(healthy="Normal").set_params(observe=ExtendedStatePIObserver())
    return diagnoser.fit(rig.data[chosen], rig.target[chosen])


@pytest.fixture
def drawn(rig, bank, tmp_path, monkeypatch):
    """Draw all figures of windows that were tested at some speeds."""
    from matplotlib.figure import Figure

    def draw(rpm):
        found = {}
        monkeypatch.setattr(
            Figure, "savefig", lambda figure, path, **options: found.update({path.stem: figure})
        )
        constants = {"diagnoser": "ALPIO", "train_rpm": 500.0}
        tested = np.flatnonzero(np.isin(rig.rpm, rpm))
        verdicts = scored_windows(bank, rig, tested, constants)
        figures.save_figures(verdicts, rig, bank, "Simulated rig", tmp_path / "rig")
        return found

    return draw


@pytest.mark.parametrize(("rpm", "shown"), [([300, 500], 500), ([300], 300)])
def test_windows_are_those_tested_at_the_training_speed(rpm, shown, rig, bank, drawn):
    found = drawn(rpm)
    assert all(each._suptitle.get_text().startswith("Simulated rig") for each in found.values())
    detection = found["rig_detection"]
    assert f"calibrated at 500, windows at {shown} rpm" in detection._suptitle.get_text()
    levels = bank[:-1].transform(rig.data[(rig.rpm == shown) & (rig.target == "OR")])
    lines = {line.get_color(): line.get_ydata() for line in detection.axes[0].lines}
    assert bank[-1].classes_.tolist() == ["IR", "Normal", "OR"]
    np.testing.assert_array_equal(lines[PALETTE[2]], levels[:, 1])


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
    figure = figures.raw_signal_figure(rig, 300, "t")
    (area,) = figure.axes[0].collections
    vertices = area.get_paths()[0].vertices
    assert vertices[:, 1].max() == 50 and vertices[:, 1].min() == -60
    at_peak = vertices[np.abs(vertices[:, 1]) > 40, 0]
    np.testing.assert_allclose(np.unique(at_peak.round()), [7, 90], atol=1)
    assert to_hex(area.get_facecolor()[0]) == PALETTE[0]
    assert figure.axes[0].get_xlim() == (0, 123.45)


def test_residuals_of_a_bank_stand_next_to_those_of_the_healthy_model(rig, bank):
    windows = {name: rig.data[rig.target == name][0] for name in ("Normal", "OR")}
    figure = figures.residual_figure(bank, rig, windows, "t")
    assert [ax.get_title(loc="left") for ax in figure.axes] == [
        "residual, window of Normal, model of Normal",
        "",
        "residual, window of OR, model of Normal",
        "residual, window of OR, model of OR",
    ]
