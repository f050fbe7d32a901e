"""The share of refused rows, on a rig of noise."""

import numpy as np
import pandas as pd

from benchmarks.quality import __main__ as command
from benchmarks.quality import treatments
from benchmarks.recipe.rigs import Recording, Rig

NOISE = np.random.default_rng(0).normal(size=(3, 12_000))
RIG = Rig("noise", 8000.0, [Recording(each, "healthy", 900.0) for each in NOISE])
LENGTHS = {0.5: 2, 2.0: 1, None: 1}


def test_rows_are_of_all_lengths_that_a_recording_has():
    treat = {"as recorded": lambda samples, rate: (samples, rate)}
    rows = pd.DataFrame(command.good_rows(RIG, LENGTHS, treat, most=2))
    assert rows.groupby("length").size().to_dict() == {"0.5 s": 4, "whole": 2}
    assert rows["seconds"].unique().tolist() == [0.5, 1.5]
    assert set(rows["quality"]) == {"good"}


def test_every_damage_is_refused_in_every_row():
    rows = pd.DataFrame(command.damaged_rows(RIG, LENGTHS, treatments.DAMAGED))
    assert (rows["quality"] != "good").all()
    assert rows.groupby("treatment").size().tolist() == [9] * len(treatments.DAMAGED)


def test_no_ordinary_treatment_of_noise_is_refused():
    for group in treatments.ORDINARY.values():
        rows = pd.DataFrame(command.good_rows(RIG, LENGTHS, group, most=1))
        assert (rows["quality"] == "good").all()


def test_shares_are_in_percent():
    facts = {"rig": "a", "group": "filter", "length": "whole"}
    rows = pd.DataFrame([facts | {"quality": each} for each in ("good", "good", "hum")])
    table = command.refused(rows, "rig", "group")
    assert table.to_numpy().tolist() == [["a", "33.4", "33.4"]]
    table = command.refused(rows[:2], "rig", "group")
    assert table.to_numpy().tolist() == [["a", "0", "0"]]
