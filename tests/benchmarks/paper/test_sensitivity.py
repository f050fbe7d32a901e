from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from sklearn.base import BaseEstimator

from benchmarks.paper.sensitivity import command as sensitivity
from benchmarks.paper.sensitivity import compound as sensitivity_compound
from benchmarks.paper.sensitivity import gains as sensitivity_gains
from benchmarks.paper.sensitivity import studies
from benchmarks.paper.sensitivity import tables as sensitivity_tables
from benchmarks.paper.sensitivity.protocol import (
    CRACKS,
    accuracy,
    calibrated,
    is_refused,
    standard_rig,
)
from skarxlag import (
    ExtendedStatePIObserver,
    PIObserver,
    make_alpio,
    make_extended_state_pio,
)

ROOT = Path(__file__).parents[3]
N_SAMPLES = 2400


class Remembers(BaseEstimator):
    """Keeps what it is fitted on, and says of every window that it is normal."""

    def fit(self, X, y):
        self.seen, self.labels = X, y
        return self

    def predict(self, X):
        self.asked = X
        return np.full(len(X), "Normal")


@pytest.fixture
def small(monkeypatch):
    """Grids of two values, two diagnosers, and models of few terms, whose pole is found soon."""
    makers = {
        name: lambda healthy, make=make: make(healthy=healthy).set_params(
            identify__order=4
        )
        for name, make in studies.DIAGNOSERS.items()
        if make is not make_extended_state_pio
    }
    monkeypatch.setattr(studies, "DIAGNOSERS", makers)
    monkeypatch.setattr(studies, "NOISE_MV", (0.5, 5.0))
    monkeypatch.setattr(studies, "WINDOW_LENGTHS", (600, 1000))
    monkeypatch.setattr(studies, "ORDERS", (4, 8))
    monkeypatch.setattr(studies, "POLES", (0.3, "optimise"))
    monkeypatch.setattr(studies, "TEST_RPM", (400, 550))
    monkeypatch.setattr(sensitivity_gains, "KP", (0.1, 1.2))
    monkeypatch.setattr(sensitivity_gains, "KI", (0.05, 1.2))
    monkeypatch.setattr(sensitivity_gains, "KI_A", (0.025, 0.2))
    monkeypatch.setattr(sensitivity_gains, "SATURATION", (0.0, 4.0))
    monkeypatch.setattr(sensitivity_gains, "GAIN", (2.0, 8.0))


def test_protocol_calibrates_at_500_rpm_and_scores_the_rest():
    rig = standard_rig(1, N_SAMPLES)
    diagnoser = calibrated(Remembers(), rig, 3.0)
    known = (rig.rpm == 500) & np.isin(rig.crack_mm, [0, 3])
    np.testing.assert_array_equal(diagnoser.seen, rig.data[known])
    np.testing.assert_array_equal(diagnoser.labels, rig.target[known])
    # One of eight conditions is normal.
    assert accuracy(diagnoser, rig, 6.0) == 12.5
    scored = (rig.rpm < 500) & np.isin(rig.crack_mm, [0, 6])
    np.testing.assert_array_equal(diagnoser.asked, rig.data[scored])


def test_refused_is_unstable_by_jury():
    for kp in (-0.9, -0.3, 0.1, 0.6, 1.2):
        for ki in (0.01, 0.2, 0.6, 1.2):
            a = 0.3 - kp
            stable = a + ki < 1 and 2 * (1 + a) + ki > 0
            assert is_refused(PIObserver(kp=kp, ki=ki)) == (not stable)
    assert is_refused(ExtendedStatePIObserver(saturation=16.0))
    assert not is_refused(ExtendedStatePIObserver())
    with pytest.raises(ValueError, match="pole"):
        is_refused(PIObserver(pole=2.0))


def test_noise_and_its_ratio_to_the_signal(monkeypatch):
    monkeypatch.setattr(studies, "NOISE_MV", (0.5, 5.0))
    monkeypatch.setattr(studies, "DIAGNOSERS", {"ALPIO": make_alpio})
    frame = studies.noise((1,), N_SAMPLES)
    ratio = frame.groupby("noise (mV)")["SNR (dB)"].first()
    assert ratio[0.5] - ratio[5.0] == pytest.approx(20)
    assert (
        frame[frame["noise (mV)"] == 0.5].accuracy.tolist()
        == np.repeat(alpio(), 2).tolist()
    )
    loud = frame[frame["noise (mV)"] == 5.0].groupby("calibrated with").accuracy.mean()
    assert loud["the same"] > loud["0.5 mV"]


def alpio():
    """Accuracy of the paper's baseline on each crack size, by hand."""
    rig = standard_rig(1, N_SAMPLES)
    found = []
    for crack_mm in CRACKS:
        kept = np.isin(rig.crack_mm, [0, crack_mm])
        train = kept & (rig.rpm == 500)
        test = kept & (rig.rpm != 500)
        diagnoser = make_alpio(healthy="Normal").fit(rig.data[train], rig.target[train])
        found.append(100 * diagnoser.score(rig.data[test], rig.target[test]))
    return found


def test_pole_and_order_reach_the_diagnoser(monkeypatch):
    monkeypatch.setattr(studies, "DIAGNOSERS", {"ALPIO": make_alpio})
    monkeypatch.setattr(studies, "ORDERS", (2, 32))
    monkeypatch.setattr(studies, "POLES", (0.3, 0.99))
    orders = studies.order((1,), N_SAMPLES)
    assert orders[orders.order == 32].accuracy.tolist() == pytest.approx(alpio())
    assert (
        orders[orders.order == 2].accuracy < orders[orders.order == 32].accuracy.min()
    ).all()
    poles = studies.pole((1,), N_SAMPLES)
    assert poles[poles.pole == 0.3].accuracy.tolist() == pytest.approx(alpio())
    assert poles[poles.pole == 0.99].accuracy.max() < min(alpio())


def test_default_gains_are_those_of_the_diagnoser(monkeypatch):
    monkeypatch.setattr(sensitivity_gains, "KP", (0.1,))
    monkeypatch.setattr(sensitivity_gains, "KI", (0.05,))
    monkeypatch.setattr(sensitivity_gains, "SATURATION", ())
    frame = sensitivity_gains.gains((1,), N_SAMPLES)
    assert frame[frame.grid == "linear"].accuracy.tolist() == pytest.approx(alpio())


def test_crack_size_scores_faulty_windows_of_other_recordings(monkeypatch):
    made = []

    def make(healthy):
        made.append(Remembers())
        return made[-1]

    monkeypatch.setattr(studies, "DIAGNOSERS", {"constant": make})
    frame = studies.crack_size((1,), N_SAMPLES)
    assert len(frame) == 3 * 2 * 2
    assert (frame.accuracy == 0).all()  # no window that is scored is normal
    rig = standard_rig(1, N_SAMPLES)
    fresh = standard_rig(1001, N_SAMPLES)
    for diagnoser, sizes in zip(made, ([0, 3], [0, 6], [0, 3, 6]), strict=True):
        known = (rig.rpm == 500) & np.isin(rig.crack_mm, sizes)
        np.testing.assert_array_equal(diagnoser.seen, rig.data[known])
        last = (fresh.rpm != 500) & (fresh.crack_mm == 6)
        np.testing.assert_array_equal(diagnoser.asked, fresh.data[last])


def test_compound_is_calibrated_without_compound_faults(monkeypatch):
    seen = []
    fit = sensitivity_compound.calibrated

    def spy(diagnoser, rig, crack_mm, **options):
        fitted = fit(diagnoser, rig, crack_mm, **options)
        seen.append(fitted.classes_.tolist())
        return fitted

    monkeypatch.setattr(sensitivity_compound, "calibrated", spy)
    frame = sensitivity_compound.compound((1,), N_SAMPLES)
    assert seen == [["Ball", "IR", "Normal", "OR"]] * 6
    assert len(frame) == 2 * (3 + 1) * 2 * 8
    diagnosed = frame[frame.diagnoser != "Detector"]
    shares = diagnosed[["as Normal", "as IR", "as OR", "as Ball"]].sum(axis=1)
    np.testing.assert_allclose(shares, 100)
    pair = diagnosed[diagnosed.condition == "IR-OR"]
    np.testing.assert_allclose(pair.named, pair["as IR"] + pair["as OR"])
    unseen = diagnosed.condition.isin(sensitivity_compound.COMPOUND)
    np.testing.assert_array_equal(diagnosed.AUC.notna(), unseen)
    assert frame.alarm.between(0, 100).all()
    text = sensitivity_tables.compound_table(frame)
    assert "| 300 to 450 rpm | 6 mm | Detector |" in text
    assert "| 6 mm | Diagnoser | IR-OR-Ball |" in text


def test_rates_of_one_condition():
    verdicts = {
        "verdict": np.array(["IR", "Normal", "Ball", "Normal"]),
        "alarm": np.array([True, False, False, True]),
        "confidence": np.array([0.9, 0.5, 0.7, 0.6]),
    }
    target = np.array(["IR-Ball", "IR-Ball", "Ball", "Normal"])
    rates = sensitivity_compound._rates(
        verdicts, target, "IR-Ball", np.ones(4, dtype=bool)
    )
    assert (rates["as IR"], rates["as Normal"], rates["named"]) == (50, 50, 50)
    assert (rates["alarm"], rates["confidence"]) == (50, 70)
    # Of the four pairs (0.9, 0.5) x (0.7, 0.6) two have the lower confidence first.
    assert rates["AUC"] == 0.5


def test_pivot_averages_within_a_draw_first():
    frame = pd.DataFrame(
        {
            "seed": [1, 1, 2, 2],
            "crack_mm": [3.0, 6.0, 3.0, 6.0],
            "diagnoser": "A",
            "order": 4,
            "accuracy": [10.0, 30.0, 40.0, 60.0],
        }
    )
    table = sensitivity_tables.pivot(frame, ["order"], ["diagnoser"])
    assert table.to_dict("records") == [{"order": 4, "A": "35.0 ± 21.2"}]
    table = sensitivity_tables.pivot(frame, ["order"], ["crack_mm", "diagnoser"])
    assert table["3 mm, A"].tolist() == ["25.0 ± 21.2"]


# Rows of the CSV for one draw, of studies that differ in kind: settings, crack sizes,
# diagnosers.
ROWS = {
    "noise": 2 * 2 * 2 * 2,
    "gains": (4 + 4 + 4 + 9) * 2,
    "crack size": 2 * 3 * 2 * 2,
    "compound": 2 * 8 * 2 * (3 + 1),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", ROWS)
def test_command(name, small, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    page = tmp_path / "page.md"
    marks = f"<!-- sensitivity {name}: begin -->\n<!-- sensitivity {name}: end -->\n"
    page.write_text(marks, encoding="utf-8")
    arguments = ["--seed", "1", "--n-samples", str(N_SAMPLES), "--write", str(page)]
    sensitivity.main([*arguments, "--output", str(tmp_path / "out"), "--only", name])
    stem = name.replace(" ", "_")
    written = page.read_text("utf-8")
    assert (
        written.split("\n", 1)[1].rsplit("<!--", 1)[0].strip()
        in capsys.readouterr().out
    )
    frame = pd.read_csv(tmp_path / "out" / f"{stem}.csv")
    assert len(frame) == ROWS[name]
    scores = frame["alarm" if name == "compound" else "accuracy"]
    assert scores.dropna().between(0, 100).all()
    assert scores.isna().any() == (name == "gains")
    assert scores.nunique() > 3
    picture = (tmp_path / "images" / f"sensitivity_{stem}.svg").read_text("utf-8")
    assert "#7f7f7f" in picture
