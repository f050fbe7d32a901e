"""Sensitivity studies score what they state, beside the paper's baseline by hand."""

import numpy as np
import pandas as pd
import pytest
from sklearn.base import BaseEstimator

from benchmarks.paper.sensitivity import compound, gains, studies, tables
from benchmarks.paper.sensitivity.protocol import CRACKS, is_refused, standard_rig
from skarxlag import ExtendedStatePIObserver, PIObserver, make_alpio

N_SAMPLES = 2400


class Remembers(BaseEstimator):
    """Diagnoser that keeps its rows and calls every window normal."""

    def fit(self, X, y):
        self.training = X
        return self

    def predict(self, X):
        self.tested = X
        return np.full(len(X), "Normal")


@pytest.fixture
def alpio_alone(monkeypatch):
    monkeypatch.setattr(studies, "DIAGNOSERS", {"ALPIO": make_alpio})


@pytest.fixture(scope="module")
def alpio():
    """Accuracy of the paper's baseline on each crack size, by hand."""
    rig = standard_rig(1, N_SAMPLES)
    accuracies = []
    for crack_mm in CRACKS:
        kept = np.isin(rig.crack_mm, [0, crack_mm])
        train = kept & (rig.rpm == 500)
        test = kept & (rig.rpm != 500)
        diagnoser = make_alpio(healthy="Normal").fit(rig.data[train], rig.target[train])
        accuracies.append(100 * diagnoser.score(rig.data[test], rig.target[test]))
    return pytest.approx(accuracies)


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


def test_noise_and_its_ratio_to_the_signal(monkeypatch, alpio_alone, alpio):
    monkeypatch.setattr(studies, "NOISE_MV", (0.5, 5.0))
    frame = studies.noise((1,), N_SAMPLES).set_index("noise (mV)")
    assert frame["SNR (dB)"][0.5].min() - frame["SNR (dB)"][5.0].max() == pytest.approx(
        20
    )
    assert (
        frame.accuracy[0.5].tolist()[::2] == frame.accuracy[0.5].tolist()[1::2] == alpio
    )
    loud = frame.loc[5.0].groupby("calibrated with").accuracy.mean()
    assert loud["the same"] > loud["0.5 mV"]


@pytest.mark.parametrize(
    ("study", "column", "grid", "default"),
    [
        (studies.order, "order", "ORDERS", 32),
        (studies.pole, "pole", "POLES", 0.3),
    ],
)
def test_pole_and_order_reach_the_diagnoser(
    study, column, grid, default, monkeypatch, alpio_alone, alpio
):
    poor = {"order": 2, "pole": 0.99}[column]
    monkeypatch.setattr(studies, grid, (poor, default))
    accuracy = study((1,), N_SAMPLES).set_index(column).accuracy
    assert accuracy[default].tolist() == alpio
    assert accuracy[poor].max() < accuracy[default].min()


def test_default_gains_are_those_of_the_diagnoser(monkeypatch, alpio):
    monkeypatch.setattr(gains, "KP", (0.1,))
    monkeypatch.setattr(gains, "KI", (0.05,))
    monkeypatch.setattr(gains, "SATURATION", ())
    frame = gains.gains((1,), N_SAMPLES)
    assert frame[frame.grid == "linear"].accuracy.tolist() == alpio


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
    last = (fresh.rpm != 500) & (fresh.crack_mm == 6)
    for diagnoser, sizes in zip(made, ([0, 3], [0, 6], [0, 3, 6]), strict=True):
        train = (rig.rpm == 500) & np.isin(rig.crack_mm, sizes)
        np.testing.assert_array_equal(diagnoser.training, rig.data[train])
        np.testing.assert_array_equal(diagnoser.tested, fresh.data[last])


def test_compound_faults_are_called_one_of_the_calibrated_conditions():
    frame = compound.compound((1,), N_SAMPLES)
    assert len(frame) == 2 * (3 + 1) * 2 * 8
    diagnosed = frame[frame.diagnoser != "Detector"]
    shares = diagnosed[["as Normal", "as IR", "as OR", "as Ball"]].sum(axis=1)
    np.testing.assert_allclose(shares, 100)
    pair = diagnosed[diagnosed.condition == "IR-OR"]
    np.testing.assert_allclose(pair.named, pair["as IR"] + pair["as OR"])
    unseen = diagnosed.condition.isin(compound.COMPOUND)
    np.testing.assert_array_equal(diagnosed.AUC.notna(), unseen)
    assert frame.alarm.between(0, 100).all()
    text = tables.compound_table(frame)
    assert "| 300 to 450 rpm | 6 mm | Detector |" in text
    assert "| 6 mm | Diagnoser | IR-OR-Ball |" in text


@pytest.mark.parametrize(
    ("columns", "name", "text"),
    [
        (["diagnoser"], "A", "35.0 ± 21.2"),
        (["crack_mm", "diagnoser"], "3 mm, A", "25.0 ± 21.2"),
    ],
)
def test_pivot_averages_within_a_draw_first(columns, name, text):
    rows = [(1, 3.0, 10.0), (1, 6.0, 30.0), (2, 3.0, 40.0), (2, 6.0, 60.0)]
    frame = pd.DataFrame(rows, columns=["seed", "crack_mm", "accuracy"])
    table = tables.pivot(frame.assign(diagnoser="A", order=4), ["order"], columns)
    assert table[name].tolist() == [text]
