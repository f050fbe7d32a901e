"""Bearings and loads that `evaluate` leaves out of the training."""

import io
from contextlib import redirect_stdout

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer
from sklearn.utils import Bunch

from skarxlag import SpecimenSplit, load_recordings
from skarxlag.datasets import FETCHERS
from skarxlag.plant.commands import evaluation_summary, main, protocols
from skarxlag.plant.commands.evaluation_cases import log_spectrum

WINDOW, N_WINDOWS, RATE = 1200, 6, 8_000
FAULT_LOCATIONS = {
    "good": "healthy",
    "IR2": "inner",
    "IR5": "inner",
    "OR2": "outer",
    "OR5": "outer",
}
POLES = {"good": 0.0, "IR2": 0.8, "IR5": 0.6, "OR2": -0.8, "OR5": -0.2}


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    """One bearing of each condition at two speeds, each of them at a load of its own."""
    folder, rows = tmp_path_factory.mktemp("bearings"), []
    for seed, (condition, pole) in enumerate(POLES.items()):
        for load, rpm in enumerate([900, 1500]):
            noise = np.random.default_rng([seed, rpm]).normal(size=WINDOW * N_WINDOWS)
            name = f"{condition}_{rpm}.npy"
            np.save(folder / name, lfilter([1], [1, -pole], noise))
            rows.append((name, condition, f"bearing {seed}", load, rpm, RATE))
    columns = ["path", "condition", "specimen", "load", "rpm", "sampling_rate"]
    pd.DataFrame(rows, columns=columns).to_csv(folder / "table.csv", index=False)
    return folder / "table.csv"


@pytest.fixture
def rig(table):
    return load_recordings(table, window_length=WINDOW)


def every(rig):
    return np.ones(len(rig.target), dtype=bool)


@pytest.fixture(scope="module")
def evaluated(table):
    """Return the output of `evaluate`, and the summary that it writes."""
    output = table.parent / "out"
    options = ["--window-length", str(WINDOW), "-q", "-o", str(output)]
    printed = io.StringIO()
    with redirect_stdout(printed):
        main(["evaluate", str(table), *options])
    summary = pd.read_csv(output / "table_protocols.csv")
    return printed.getvalue(), summary.set_index(["test", "diagnoser"])


def test_another_bearing_is_summarized_beside_another_speed(evaluated):
    out, summary = evaluated
    tests = [
        "another speed",
        "another bearing",
        "another bearing and speed",
        "another load",
    ]
    assert summary.index.get_level_values("test").unique().tolist() == tests
    shown = [line for line in out.splitlines() if line.startswith("another ")]
    assert [line.split("make_diagnoser")[0].strip() for line in shown] == tests
    of_speed, of_bearing, *_ = (summary.loc[test, "make_diagnoser"] for test in tests)
    assert (of_speed["bearings"], of_bearing["bearings"]) == (5, 4)
    assert of_speed["condition"] > 60 and np.isnan(of_bearing["condition"])
    assert f"{of_bearing['location']:.0f} % (another bearing)" in out
    sentence = "Another bearing: not measured for healthy, because too few such"
    assert sentence in out


@pytest.mark.parametrize(
    ("test_speed", "test"),
    [("same", "another bearing"), ("other", "another bearing and speed")],
)
def test_the_summary_of_another_bearing_is_that_of_the_splitter(
    evaluated, rig, test_speed, test
):
    right = []
    probability = []
    groups = pd.DataFrame({"specimen": rig.specimen, "rpm": rig.rpm})
    locations = np.array([FAULT_LOCATIONS[condition] for condition in rig.target])
    splitter = SpecimenSplit(test_speed=test_speed)
    for train_rows, test_rows in splitter.split(rig.data, locations, groups):
        spectrum = FunctionTransformer(log_spectrum, kw_args={"nperseg": 256})
        peer = make_pipeline(spectrum, LinearDiscriminantAnalysis())
        peer.fit(rig.data[train_rows], rig.target[train_rows])
        shares = pd.DataFrame(
            peer.predict_proba(rig.data[test_rows]), columns=peer.classes_
        )
        of_locations = shares.T.groupby(FAULT_LOCATIONS).sum()
        right += (of_locations.idxmax() == locations[test_rows]).tolist()
        probability += of_locations.max().tolist()
    is_stated = np.array(probability) >= 0.9
    row = evaluated[1].loc[test, "log spectrum + LDA"]
    assert row["location"] == pytest.approx(100 * np.mean(right), rel=1e-5)
    assert row["stated"] == pytest.approx(100 * is_stated.mean(), rel=1e-5)
    share = np.nan
    if is_stated.sum() >= 30:
        share = 100 * np.mean(np.array(right)[is_stated])
    assert row["of these"] == pytest.approx(share, rel=1e-5, nan_ok=True)


def test_bearings_of_several_places_are_left_out_together(rig):
    splits, (sentence,) = protocols.bearing_splits(rig, every(rig), halves=False)
    assert "not measured for healthy" in sentence
    pairs = [{"IR2", "OR2"}] * 2 + [{"IR5", "OR5"}] * 2
    assert [set(rig.target[test]) for _, test, *_ in splits] == pairs
    assert [rpm for *_, rpm in splits] == [900, 1500] * 2
    for train, test, protocol, rpm in splits:
        assert protocol == "bearing" and set(rig.rpm[train]) == {rpm}
        assert set(rig.rpm[test]) == {900, 1500} and len(train) == 3 * N_WINDOWS
        assert not set(rig.specimen[train]) & set(rig.specimen[test])


@pytest.mark.parametrize("is_there", [True, False])
def test_conditions_that_count_as_bearings_are_named_as_such(rig, is_there):
    if is_there:
        rig.specimen = rig.target
    else:
        del rig["specimen"]
    splits, sentences = protocols.bearing_splits(rig, every(rig), halves=False)
    assert len(splits) == 4
    assert sentences[0] == "Another bearing: each condition counts as one bearing."


def test_first_halves_train_on_a_rig(rig):
    splits, _ = protocols.bearing_splits(rig, every(rig), halves=True)
    for train, test, *_ in splits:
        assert len(train) == 3 * N_WINDOWS / 2
        assert set(rig.start[train]) == {0, 1200, 2400}
        assert len(test) == 4 * N_WINDOWS


def test_rows_that_cannot_be_used_are_in_no_split(rig):
    usable = rig.start > 0
    splits, _ = protocols.splits_at_any_speed(rig, usable, halves=False)
    assert {split.protocol for split in splits} == {"bearing", "load"}
    for split in splits:
        assert usable[split.train].all() and usable[split.test].all()


def test_what_cannot_be_measured_of_bearings_is_said(rig):
    one = Bunch(**rig | {"target": np.where(rig.target == "good", "good", "worn")})
    del one["specimen"]
    splits, (sentence,) = protocols.bearing_splits(one, every(rig), halves=False)
    assert splits == []
    reason = "because each location has one specimen."
    assert sentence == f"Another bearing: not measured, {reason}"
    # The races were recorded at different speeds.
    usable = (rig.rpm == 900) == np.isin(rig.target, ["IR2", "IR5"])
    splits, (sentence,) = protocols.bearing_splits(rig, usable, halves=False)
    assert splits == []
    assert "without one bearing of each location, no speed has all" in sentence


def test_each_load_is_left_out_in_turn(rig):
    splits, sentences = protocols.load_splits(rig, every(rig))
    assert sentences == [] and len(splits) == 2
    for train, test, protocol, rpm in splits:
        assert protocol == "load" and np.isnan(rpm)
        assert not set(rig.load[train]) & set(rig.load[test])
    tested = np.concatenate([split.test for split in splits])
    assert sorted(tested) == [*range(len(rig.target))]


def test_rows_without_a_stated_load_are_left_out(rig):
    rig.load = np.where(
        rig.recording == "OR5_900.npy", "", np.where(rig.load == 0, "low", "high")
    )
    splits, (sentence,) = protocols.load_splits(rig, every(rig))
    assert sentence == "Another load: 1 recordings without a stated load were left out."
    used = {row for split in splits for rows in split[:2] for row in rows}
    assert used == set(np.flatnonzero(rig.load != ""))


@pytest.mark.parametrize(
    ("load", "reason"),
    [
        (None, "no load is stated"),
        (lambda rig: np.full(len(rig.target), np.nan), "no load is stated"),
        (lambda rig: np.where(rig.rpm == 900, 2.0, np.nan), "only one load is stated"),
        (
            lambda rig: np.unique(rig.target, return_inverse=True)[1] * 1.0,
            "at one load only",
        ),
    ],
)
def test_what_cannot_be_measured_of_loads_is_said(rig, load, reason):
    if load is None:
        del rig["load"]
    else:
        rig.load = load(rig)
    splits, (sentence,) = protocols.load_splits(rig, every(rig))
    assert splits == [] and sentence.startswith("Another load: not measured, because")
    assert reason in sentence


def verdicts(n_stated):
    rows = 40
    return pd.DataFrame(
        {
            "protocol": "bearing",
            "specimen": np.tile(["A", "B"], rows),
            "diagnoser": "D",
            "train_rpm": 900.0,
            # A speed that differs by 1 % is the same one.
            "test_rpm": np.repeat([909.0, 1500.0], rows),
            "true": "IR5",
            "predicted": "IR2",
            "is_known": False,
            "is_location": np.tile([True, True, True, False], rows // 2),
            "location_probability": np.tile(
                np.where(np.arange(rows) < n_stated, 0.9, 0.89), 2
            ),
        }
    )


def test_a_share_of_few_stated_verdicts_is_not_given():
    table = evaluation_summary.summary(verdicts(32))
    for test in ("another bearing", "another bearing and speed"):
        row = table.loc[test, "D"]
        assert np.isnan(row["condition"]) and row["location"] == row["of these"] == 75
        assert row["stated"] == 80 and row["bearings"] == 2
    few = evaluation_summary.summary(verdicts(29))
    assert few["of these"].isna().all() and few["location"].eq(75).all()
    assert "probability" not in evaluation_summary.reading(few, "D")


def test_better_diagnosers_are_named_where_they_are_better():
    tests = pd.MultiIndex.from_product(
        [["another speed", "another bearing"], ["A", "B", "D"]]
    )
    shares = [80.0, 92.0, 90.0, 60.0, 40.9, 60.5]
    table = pd.DataFrame({"condition": shares}, tests)
    (sentence,) = evaluation_summary.better_ones(table, "D")
    assert sentence.startswith("Another speed: B names") and "92 %" in sentence
    assert evaluation_summary.better_ones(table.assign(condition=np.nan), "D") == []


def test_a_rig_leaves_bearings_out_at_the_chosen_training_speed(
    run, rig, tmp_path, monkeypatch, no_figures
):
    monkeypatch.setitem(FETCHERS, "uestc", lambda **options: rig)
    options = ("--rig", "uestc", "--train-rpm", 900, "-q", "-o", tmp_path)
    assert run("evaluate", *options)[0] == 0
    found = pd.read_csv(tmp_path / "uestc_verdicts.csv")
    bearings = found[found["protocol"] == "bearing"]
    assert set(bearings["train_rpm"]) == {900}
    assert set(bearings["test_rpm"]) == {900, 1500}
    assert set(bearings["true"]) == {"IR2", "IR5", "OR2", "OR5"}
    assert "load" in set(found["protocol"])
    # Tables and figures across speeds are of the same bearings.
    matrix = pd.read_csv(tmp_path / "uestc_confusion_diagnoser.csv", index_col="true")
    assert matrix.iloc[:5, :5].to_numpy().sum() == 5 * N_WINDOWS / 2
