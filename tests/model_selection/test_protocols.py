"""Rows that train and rows that test, by protocol."""

import numpy as np
import pandas as pd
import pytest

from skarxlag.model_selection import PROTOCOLS, protocol_splits

CONDITIONS = ["good", "IR2", "IR5", "OR2", "OR5"]
N_ROWS = 6


@pytest.fixture
def rig():
    """Five conditions at two speeds, each at a load of its own; six rows a recording."""
    recordings = [(name, rpm) for name in CONDITIONS for rpm in (900.0, 1500.0)]
    rows = [(name, rpm, i) for name, rpm in recordings for i in range(N_ROWS)]
    table = pd.DataFrame(rows, columns=["condition", "rpm", "start"])
    table["recording"] = table["condition"] + table["rpm"].astype(str)
    table["specimen"] = "bearing " + table["condition"]
    table["load"] = np.where(table["rpm"] == 900, 0.0, 1.0)
    return table.pop("condition").to_numpy(), table


def splits_of(rig, *protocols, **options):
    return protocol_splits(*rig, protocols=protocols, **options)


def test_one_speed_trains_and_the_others_test(rig):
    y, facts = rig
    splits, sentences = splits_of(rig, "speed", "speeds")
    assert sentences == [] and [split.train_rpm for split in splits] == [900, 1500]
    for train, test, protocol, rpm in splits:
        # Of two speeds, leaving one out is the same as training at the other.
        assert protocol == "speed" and set(facts["rpm"][train]) == {rpm}
        assert sorted([*train, *test]) == [*range(len(y))]


def test_all_speeds_but_one_train(rig):
    _, facts = rig
    facts["rpm"] = np.tile(np.repeat([900.0, 1200.0, 1500.0], 2), 2 * len(CONDITIONS))
    splits, _ = splits_of(rig, "speeds")
    assert len(splits) == 3
    for train, test, _, rpm in splits:
        assert np.isnan(rpm) and len(set(facts["rpm"][test])) == 1
        assert not set(facts["rpm"][test]) & set(facts["rpm"][train])


def test_speeds_that_differ_by_one_percent_are_one(rig):
    _, facts = rig
    facts.loc[facts["start"] > 2, "rpm"] *= 1.01
    assert len(splits_of(rig, "speed")[0]) == 2


def test_halves_share_no_recording_half(rig):
    _, facts = rig
    for protocol in PROTOCOLS:
        for train, test, *_ in splits_of(rig, protocol, halves=True)[0]:
            assert set(facts["start"][train]) == {0, 1, 2}
            starts = set(facts["start"][test])
            is_of_bearings = protocol.startswith("bearing")
            assert starts == ({*range(6)} if is_of_bearings else {3, 4, 5})


def test_campaigns_are_not_split(rig):
    _, facts = rig
    facts["campaign"] = np.where(facts["start"] < 2, "spring", "autumn")
    splits, _ = splits_of(rig, "speed")
    assert len(splits) == 4
    for train, test, *_ in splits:
        assert not set(facts["campaign"][train]) & set(facts["campaign"][test])


def test_bearings_of_several_locations_are_left_out_together(rig):
    y, facts = rig
    splits, (sentence,) = splits_of(rig, "bearing", "bearing and speed")
    assert "not measured for healthy, because too few" in sentence
    tested = [{"IR2", "OR2"}] * 2 + [{"IR5", "OR5"}] * 2
    for name in ("bearing", "bearing and speed"):
        of_protocol = [split for split in splits if split.protocol == name]
        assert [set(y[split.test]) for split in of_protocol] == tested
        for train, test, _, rpm in of_protocol:
            assert set(facts["rpm"][train]) == {rpm}
            assert (set(facts["rpm"][test]) == {rpm}) == (name == "bearing")
            assert not set(facts["specimen"][train]) & set(facts["specimen"][test])


def test_conditions_count_as_bearings_if_none_are_stated(rig):
    del rig[1]["specimen"]
    splits, sentences = splits_of(rig, "bearing")
    assert len(splits) == 4
    assert sentences[0] == "Another bearing: each condition counts as one bearing."


def test_each_load_is_left_out_in_turn(rig):
    _, facts = rig
    facts.loc[facts["recording"] == "OR5900.0", "load"] = np.nan
    splits, (sentence,) = splits_of(rig, "load")
    assert sentence == "Another load: 6 rows without a load were left out."
    # Without that recording, no training at the load 0 has all conditions.
    (split,) = splits
    assert set(facts["load"][split.test]) == {0.0}
    assert set(facts["load"][split.train]) == {1.0}


@pytest.mark.parametrize(
    ("protocol", "change", "reason"),
    [
        ("speed", {"rpm": 900.0}, "one speed is stated at most"),
        ("speed", {"rpm": None}, "one speed is stated at most"),
        ("speed", {"rpm": "by condition"}, "no training has all conditions"),
        ("bearing", {"specimen": "one"}, "each location has one specimen"),
        ("bearing", {"rpm": "by condition"}, "no speed has all locations"),
        ("load", {"load": None}, "no load is stated"),
        ("load", {"load": ""}, "no load is stated"),
        ("load", {"load": 2.0}, "only one load is stated"),
        ("load", {"load": "by condition"}, "at one load only"),
    ],
)
def test_what_cannot_be_measured_is_said(rig, protocol, change, reason):
    y, facts = rig
    (name, value), *_ = change.items()
    by_condition = 100.0 * (1 + np.unique(y, return_inverse=True)[1])
    facts[name] = by_condition if value == "by condition" else value
    splits, (sentence,) = splits_of(rig, protocol)
    assert splits == [] and "not measured, because" in sentence and reason in sentence


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"protocols": ["speed", "moon"]}, "protocols == 'moon', expected among"),
        ({"halves": True}, "recording, for halves"),
    ],
)
def test_bad_choices(options, message):
    with pytest.raises(ValueError, match=message):
        protocol_splits(["a", "b"], pd.DataFrame({"rpm": [1, 2]}), **options)
    with pytest.raises(ValueError, match="Length of facts"):
        protocol_splits(["a", "b"], pd.DataFrame({"rpm": [1]}))
