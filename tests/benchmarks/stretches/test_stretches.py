import numpy as np
import pandas as pd
import pytest
from sklearn.utils import Bunch

from benchmarks.stretches import command
from benchmarks.stretches.methods import LargestPeak, OrdersAlone, PyBearing, Stretches, WindowsVote
from benchmarks.stretches.rigs import places
from skarxlag import fault_orders, make_alpio
from skarxlag.bearings import SKF_6205

from ...test_orders import RATE, strikes

ORDERS = fault_orders(SKF_6205)


@pytest.fixture(scope="module")
def rig():
    """Six stretches of each of three conditions at two speeds."""
    data, target, rpm, recording, start = [], [], [], [], []
    for speed in (700.0, 900.0):
        for n, name in enumerate(["Normal", "IR", "OR"]):
            order = {"IR": ORDERS["inner"], "OR": ORDERS["outer"]}.get(name)
            length = 6 * RATE
            noise = np.random.default_rng([n, int(speed)]).normal(size=length)
            whole = noise if order is None else strikes(order, speed, [n, int(speed)], length)
            data.append(whole.reshape(6, RATE))
            target += 6 * [name]
            rpm += 6 * [speed]
            recording += 6 * [f"{name}_{speed:g}"]
            start += range(0, length, RATE)
    return Bunch(
        data=np.concatenate(data), target=np.array(target), rpm=np.array(rpm),
        recording=np.array(recording), start=np.array(start), sampling_rate=float(RATE),
        target_names=["Normal", "IR", "OR"],
    )  # fmt: skip


@pytest.mark.parametrize(
    "make",
    [
        lambda: Stretches(RATE),
        lambda: Stretches(RATE, 0.05),
        lambda: Stretches(RATE, None),
        lambda: OrdersAlone(RATE),
        lambda: WindowsVote(make_alpio, 1000),
    ],
)
def test_methods_tell_conditions_at_the_other_speed(rig, make):
    pairs = pd.DataFrame(command.speed_pairs(make, rig))
    assert pairs[["train_rpm", "test_rpm"]].to_numpy().tolist() == [[700, 900], [900, 700]]
    assert pairs["accuracy"].min() >= 6 / 9 and (pairs["place"] >= pairs["accuracy"]).all()


@pytest.mark.parametrize("make", [LargestPeak, PyBearing])
def test_rules_tell_the_place_by_the_geometry(rig, make):
    if make is PyBearing:
        pytest.importorskip("pybearing.analysis.envelope_analysis")
    pairs = pd.DataFrame(command.speed_pairs(lambda: make(RATE, ORDERS), rig, of_place=True))
    assert pairs["accuracy"].isna().all() and pairs["place"].min() >= 5 / 9


def test_wrong_speeds_alternate(rig, monkeypatch):
    method = Stretches(RATE, 0.1).fit(rig.data[:18], rig.target[:18], rig.rpm[:18])
    seen = []
    monkeypatch.setattr(
        type(method.diagnoser), "predict", lambda self, X, rpm: seen.append(rpm) or X
    )
    method.predict(rig.data[:3], np.full(3, 1000.0))
    np.testing.assert_allclose(seen[0], [1100, 900, 1100])


def test_places_of_compound_faults_are_unknown():
    expected = ["inner", "outer", "ball", "healthy", None]
    assert places(["IR5", "O", "B", "N", "IR-OR"]).tolist() == expected


def test_command_writes_results_and_the_block_of_a_page(rig, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(command, "rig_of_stretches", lambda *args: rig)
    page = tmp_path / "page.md"
    page.write_text("<!-- stretches overview: begin -->\n<!-- stretches overview: end -->\n")
    arguments = ["--rig", "hit_sm", "--seconds", "1", "--output", str(tmp_path), "--write"]
    methods = ["orders alone", "largest peak at the orders"]
    command.main([*arguments, str(page), "--method", *methods])
    out, err = capsys.readouterr()
    assert "| hit_sm | orders alone |" in out and "hit_sm | 1 s | orders alone: " in err
    assert "Made by `python -m benchmarks.stretches --rig hit_sm --seconds 1.0" in page.read_text()
    pairs = pd.read_csv(tmp_path / "pairs.csv")
    assert len(pairs) == 4
    command.main([*arguments, str(page), "--method", "orders alone"])
    assert len(pd.read_csv(tmp_path / "pairs.csv")) == 4
