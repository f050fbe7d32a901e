import numpy as np
import pytest
from matplotlib.figure import Figure

from skarxlag import ExtendedStatePIObserver, make_alpio
from skarxlag.accuracy_tables import scored_windows
from skarxlag.commands.evaluation_cases import Case, Split
from skarxlag.commands.evaluation_figures import save_figures
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


def test_windows_are_those_tested_at_the_training_speed(rig, bank, tmp_path, monkeypatch):
    found = {}
    monkeypatch.setattr(
        Figure, "savefig", lambda figure, path, **options: found.update({path.stem: figure})
    )
    tested = np.arange(len(rig.rpm))
    verdicts = scored_windows(bank, rig, tested, {"diagnoser": "ALPIO", "train_rpm": 500.0})
    split = Split(tested, tested, "calibrated at 500 rpm", {"train_rpm": 500.0})
    save_figures(Case("Simulated rig", "rig", rig, [split], {}), verdicts, bank, tmp_path)
    assert all(each._suptitle.get_text().startswith("Simulated rig") for each in found.values())
    detection = found["rig_detection"]
    assert "calibrated at 500 rpm, windows at the same" in detection._suptitle.get_text()
    levels = bank[:-1].transform(rig.data[(rig.rpm == 500) & (rig.target == "OR")])
    lines = {line.get_color(): line.get_ydata() for line in detection.axes[0].lines}
    assert bank[-1].classes_.tolist() == ["IR", "Normal", "OR"]
    np.testing.assert_array_equal(lines[PALETTE[2]], levels[:, 1])
