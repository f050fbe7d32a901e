import numpy as np
import pandas as pd
import pytest

from benchmarks.cross_speed.protocol import first_and_second_half
from benchmarks.recipe import random_rigs, stretches
from benchmarks.recipe.stretches import IN_USE, SETTINGS
from skarxlag import OrderResidual, make_diagnoser


@pytest.fixture(scope="module")
def rig():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stretches, "_SECONDS", 0.5)
        yield stretches.stretches_of("strikes", 1)


@pytest.mark.slow
def test_nominal_speeds_are_wrong_at_every_recording_by_another_share(rig):
    assert rig.data.shape[-1] == int(0.5 * rig.sampling_rate / 1200) * 1200
    by_recording = pd.DataFrame({"error": rig.nominal / rig.rpm - 1}).groupby(rig.recording)
    assert (by_recording.size() == 4).all()
    assert (by_recording["error"].nunique() == 1).all()
    errors = by_recording["error"].first()
    assert errors.nunique() == len(errors) and 0.03 < errors.abs().max() < 0.06
    assert errors.min() < 0 < errors.max()


def test_severities_of_a_place_strike_at_one_order(monkeypatch):
    seen = []
    monkeypatch.setattr(
        random_rigs, "_strikes", lambda rng, fault, turns, n: seen.append(fault) or np.zeros(n)
    )
    for one_order_a_place, n_orders in ((False, 5), (True, 1)):
        seen.clear()
        random_rigs.random_rig("severity", 3, 100, 1, one_order_a_place=one_order_a_place)
        assert len(seen) >= 3 * 4
        found = len({fault["order"] for fault in seen})
        assert found == n_orders if one_order_a_place else found >= 4


@pytest.mark.slow
def test_what_is_in_use_scores_as_the_diagnoser_does(rig):
    unknown = "no rpm, exponent", "0.5 (in use)"
    known = next(name for name in SETTINGS if name[0] == IN_USE)
    found = stretches.accuracy(rig, {name: SETTINGS[name] for name in (known, unknown)})
    first, second = first_and_second_half(rig.recording, rig.start, rig.data.shape[-1])
    scores = {known: [], unknown: []}
    for rpm in np.unique(rig.rpm):
        train, test = first & (rig.rpm == rpm), second & (rig.rpm != rpm)
        diagnoser = make_diagnoser(sampling_rate=rig.sampling_rate)
        diagnoser.fit(rig.data[train], rig.target[train], rpm=rig.nominal[train])
        right = diagnoser.predict(rig.data[test], rpm=rig.nominal[test]) == rig.target[test]
        scores[known].append(right.mean())
        right = diagnoser.predict(rig.data[test]) == rig.target[test]
        scores[unknown].append(right.mean())
    assert found == pytest.approx({name: np.mean(each) for name, each in scores.items()})


def test_every_setting_changes_something(rig):
    """Each constant of the list reaches what it names."""
    train = rig.rpm == rig.rpm.min()
    few = {name: setting for name, setting in SETTINGS.items() if name[0] == "independent values"}
    with stretches._worth(few["independent values", "10"].independent_values):
        assert stretches.order_spectra._INDEPENDENT_VALUES == 10
    assert stretches.order_spectra._INDEPENDENT_VALUES == 50
    assert train.any()
    for _, setting in SETTINGS.items():
        residual = OrderResidual(**dict(setting.orders))
        for name, value in setting.orders:
            assert getattr(residual, name) == value != getattr(OrderResidual(), name)


def test_report_names_what_is_better_on_both(tmp_path, monkeypatch, capsys):
    names = [(IN_USE, "x"), ("a", "1"), ("a", "2"), ("no rpm, b", "1"), ("no rpm, b", "2 (in use)")]
    index = pd.MultiIndex.from_product([["strikes"], range(4)], names=["family", "seed"])
    choosing = pd.DataFrame(
        [[0.5, 0.6, 0.6, 0.4, 0.3]] * 4, columns=pd.MultiIndex.from_tuples(names), index=index
    )
    confirming = choosing.add([0, 0, -0.1, 0, 0])
    assert stretches.better(choosing, confirming) == [("a", "1"), ("no rpm, b", "1")]
    same = stretches.report(choosing[[names[0]]], confirming[[names[0]]])
    assert "No value is better than the one in use by more than 0.01 on both sets" in same
    runs = iter([choosing, confirming])

    def battery(seeds, settings):
        known = next(runs, None)
        if known is None:
            # What is better, and what it is compared with, on further seeds.
            assert seeds == stretches.FURTHER and set(settings) == {names[i] for i in (0, 1, 3, 4)}
            known = choosing[list(settings)] - 0.2
        return known

    monkeypatch.setattr(stretches, "SETTINGS", dict.fromkeys(names))
    monkeypatch.setattr(stretches, "battery", battery)
    for _ in range(2):  # The second time the results of the first are there.
        stretches.main(["--output", str(tmp_path)])
        text = capsys.readouterr().out
        assert text.endswith("choosing and confirming: a 1; no rpm, b 1.\n")
        expected = "| a | 2 | 0.600 | +0.100 ± 0.000 | 0.500 | +0.000 ± 0.000 |  |  |"
        assert expected in text
        assert "| no rpm, b | 1 | 0.400 | +0.100 ± 0.000 | 0.400 | +0.100 ± 0.000 | 0.200 |" in text
        assert "4 choosing (seeds 200 to 203), 4 confirming (seeds 300 to 303), 4 further" in text
