import numpy as np
import pytest
from matplotlib.colors import to_hex
from sklearn.utils import Bunch

from skarxlag import ExtendedStatePIObserver, make_single_observer_pio
from skarxlag.accuracy_tables import scored_windows
from skarxlag.commands import figures, paper_figures
from skarxlag.commands.diagnosers import make_single_ladder
from skarxlag.commands.rigs import TITLES, Part
from skarxlag.datasets import simulate_rig
from skarxlag.plotting._style import PALETTE

NAMES = ["Normal", "IR", "OR"]


@pytest.fixture(scope="module")
def rig():
    return simulate_rig(rpm=(300, 500), crack_mm=6, conditions=NAMES, n_samples=4800)


@pytest.fixture(scope="module")
def bank(rig):
    chosen = rig.rpm == 500
    return make_single_observer_pio(healthy="Normal").fit(rig.data[chosen], rig.target[chosen])


@pytest.fixture(scope="module")
def ladder(rig):
    chosen = rig.rpm == 500
    single = make_single_ladder(ExtendedStatePIObserver, healthy="Normal")
    return single.fit(rig.data[chosen], rig.target[chosen])


def verdicts_of(diagnoser, rig, rpm, crack_mm):
    constants = {"diagnoser": "ALPIO", "train_rpm": 500.0}
    if crack_mm is not None:
        constants["crack_mm"] = crack_mm
    return scored_windows(diagnoser, rig, np.flatnonzero(np.isin(rig.rpm, rpm)), constants)


@pytest.mark.parametrize("name", ["bank", "ladder"])
@pytest.mark.parametrize(
    ("title", "crack_mm", "prefixes"),
    [
        (TITLES["simulated"], 6.0, ("figure_07_", "figures_12-19_")),
        (TITLES["uestc"], None, ("", "")),
    ],
)
def test_files_say_which_figure_of_the_paper_they_are(
    name, title, crack_mm, prefixes, rig, request, tmp_path
):
    diagnoser = request.getfixturevalue(name)
    figures.save_figures(
        verdicts_of(diagnoser, rig, [300, 500], crack_mm),
        [Part(crack_mm, rig, source=None)],
        {(crack_mm, "ALPIO"): diagnoser},
        title,
        None,
        lambda stem, suffix: tmp_path / f"{stem}{suffix}",
    )
    first, last = prefixes
    crack = "" if crack_mm is None else "_6mm"
    expected = {
        "speeds",
        "confusion",
        f"{first}identification_healthy",
        f"{first.replace('7', '8')}identification_faulty",
        f"{first.replace('07', '10')}raw_signals",
        f"{first.replace('07', '11')}detection",
        f"{last}residuals",
    }
    assert {path.name for path in tmp_path.iterdir()} == {f"{e}{crack}.png" for e in expected}
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in tmp_path.iterdir())


@pytest.mark.parametrize(("rpm", "shown"), [([300, 500], 500), ([300], 300)])
def test_windows_are_those_tested_at_the_training_speed(rpm, shown, rig, bank):
    drawn = figures._figures_of_paper(verdicts_of(bank, rig, rpm, 6.0), rig, bank, "Simulated rig")
    detection = drawn["figure_11", "detection"]
    assert f"calibrated at 500, windows at {shown} rpm" in detection._suptitle.get_text()
    levels = bank[:-1].transform(rig.data[(rig.rpm == shown) & (rig.target == "OR")])
    lines = {line.get_color(): line.get_ydata() for line in detection.axes[0].lines}
    assert bank[-1].classes_.tolist() == ["IR", "Normal", "OR"]
    np.testing.assert_array_equal(lines[PALETTE[2]], levels[:, 1])


def test_all_figures_name_the_rig(rig, bank):
    drawn = figures._figures_of_paper(verdicts_of(bank, rig, 500, 6.0), rig, bank, "Simulated rig")
    assert all(each._suptitle.get_text().startswith("Simulated rig") for each in drawn.values())


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
    figure = paper_figures.raw_signal_figure(rig, 300, "t")
    (area,) = figure.axes[0].collections
    vertices = area.get_paths()[0].vertices
    assert vertices[:, 1].max() == 50 and vertices[:, 1].min() == -60
    at_peak = vertices[np.abs(vertices[:, 1]) > 40, 0]
    np.testing.assert_allclose(np.unique(at_peak.round()), [7, 90], atol=1)
    assert to_hex(area.get_facecolor()[0]) == PALETTE[0]
    assert figure.axes[0].get_xlim() == (0, 123.45)


def test_residuals_of_a_bank_stand_beside_those_of_the_healthy_model(rig, bank, ladder):
    windows = {name: rig.data[rig.target == name][0] for name in ("Normal", "OR")}
    beside = paper_figures.residual_figure(bank, rig, windows, "t")
    titles = [ax.get_title(loc="left") for ax in beside.axes]
    assert titles == [
        "residual, window of Normal, model of Normal",
        "",
        "residual, window of OR, model of Normal",
        "residual, window of OR, model of OR",
    ]
    alone = paper_figures.residual_figure(ladder, rig, windows, "t")
    assert [ax.get_title(loc="left") for ax in alone.axes] == titles[::2]


def test_isolation_draws_the_rungs(rig, ladder):
    chosen = np.flatnonzero(rig.rpm == 500)
    figure = paper_figures.isolation_figure(ladder, rig, chosen, "t")
    labels = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert sorted(labels) == sorted(
        [r"$\Gamma$", *(rf"$\Delta$ {name}" for name in ladder[-1].rungs_[1:-1])]
    )
