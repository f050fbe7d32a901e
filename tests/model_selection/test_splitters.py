import numpy as np
import pandas as pd
import pytest
import sklearn
from sklearn.base import clone
from sklearn.model_selection import GridSearchCV, cross_validate

from skarxlag import (
    SpecimenSplit,
    SpeedSplit,
    ThresholdLadder,
)
from skarxlag.model_selection import first_and_second_half


def as_lists(splits):
    return [(train.tolist(), test.tolist()) for train, test in splits]


def speed_splits(rpm, *columns, **settings):
    groups = pd.DataFrame(dict(enumerate([rpm, *columns])))
    return list(SpeedSplit(**settings).split(None, groups=groups))


HALVES = [[1, 1, 1, 2, 2, 1, 1, 2, 2, 2, 2], list("aaabbccdddd")]


@pytest.mark.parametrize(
    ("columns", "settings", "expected"),
    [
        # Every ordered pair of speeds, in ascending order.
        (
            [[500, 300, 400, 300]],
            {},
            [
                ([1, 3], [2]),
                ([1, 3], [0]),
                ([2], [1, 3]),
                ([2], [0]),
                ([0], [1, 3]),
                ([0], [2]),
            ],
        ),
        ([[500, 300, 400, 300]], {"train_rpm": 500}, [([0], [1, 3]), ([0], [2])]),
        # Halves within each recording. a: 0 | (1) | 2; b: 3 | 4; c: 5 | 6; d: 7 8 | 9 10
        (HALVES, {}, [([0, 5], [4, 9, 10]), ([3, 7, 8], [2, 6])]),
        (
            HALVES,
            {"same_speed": True},
            [
                ([0, 5], [2, 6]),
                ([0, 5], [4, 9, 10]),
                ([3, 7, 8], [2, 6]),
                ([3, 7, 8], [4, 9, 10]),
            ],
        ),
        (HALVES, {"leave_out": True}, [([3, 7, 8], [2, 6]), ([0, 5], [4, 9, 10])]),
        # Recordings need not lie in one piece.
        ([[1, 2, 1, 2], list("abab")], {}, [([0], [3]), ([1], [2])]),
        ([[5, 5], [0, 0]], {"same_speed": True}, [([0], [1])]),
        # A group of speeds begins at its lowest.
        (
            [[300, 305, 310, 315, 320]],
            {"leave_out": True},
            [([2, 3, 4], [0, 1]), ([0, 1, 4], [2, 3]), ([0, 1, 2, 3], [4])],
        ),
    ],
)
def test_splits_of_speeds(columns, settings, expected):
    assert as_lists(speed_splits(*columns, **settings)) == expected


def test_overlapping_windows_of_different_halves_share_no_sample():
    start = np.tile(np.arange(0, 5000, 250), 2)
    rpm = np.repeat([300, 500], 20)
    ((train, test),) = speed_splits(
        rpm, rpm, start, train_rpm=300, window_length=1000, same_speed=True
    )[:1]
    assert start[train].max() + 1000 <= start[test].min()
    assert len(train) == len(test) == 8
    # Without the starts windows are taken to follow one another.
    ((train, test),) = speed_splits(rpm, rpm, train_rpm=300, same_speed=True)[:1]
    assert start[train].max() + 1000 > start[test].min()


def test_order_of_windows_does_not_matter_where_starts_are_known():
    start = np.array([30, 0, 20, 10])
    first, second = first_and_second_half(["a"] * 4, start, 10)
    assert sorted(start[first]) == [0, 10] and sorted(start[second]) == [20, 30]


SPEED = np.repeat([300, 400, 500], 20)
RUN = np.arange(60) // 10
START = np.tile(np.arange(0, 1000, 100), 6)
LABELS = np.where(RUN % 2, "worn", "good")
NOISE = np.random.default_rng(0).normal(size=(60, 1))
LEVELS = (1 + RUN % 2)[:, np.newaxis] * np.exp(0.1 * NOISE)
GROUPS = pd.DataFrame({"rpm": SPEED, "recording": RUN, "start": START})


@pytest.mark.parametrize("same_speed", [False, True])
@pytest.mark.parametrize("train_rpm", [None, 400])
def test_groups_are_a_table_an_array_or_rows(train_rpm, same_speed):
    splitter = SpeedSplit(window_length=200, train_rpm=train_rpm, same_speed=same_speed)
    expected = as_lists(splitter.split(LEVELS, groups=GROUPS))
    assert len(expected) == (1 if train_rpm else 3) * (3 if same_speed else 2)
    for groups in (
        GROUPS.to_numpy(),
        GROUPS.to_numpy().astype(str),
        GROUPS.to_numpy().tolist(),
    ):
        assert as_lists(splitter.split(LEVELS, groups=groups)) == expected
        assert splitter.get_n_splits(LEVELS, groups=groups) == len(expected)
    assert clone(splitter, safe=False).train_rpm == train_rpm
    assert repr(SpeedSplit(train_rpm=4)).startswith("SpeedSplit(")


@pytest.mark.parametrize("routing", [False, True])
def test_splitter_within_a_search_within_a_cross_validation(routing):
    inner, outer = (SpeedSplit(leave_out=b, window_length=100) for b in (False, True))
    grid = {"false_alarm_rate": [0.1, 0.2]}
    search = GridSearchCV(ThresholdLadder(), grid, cv=inner, error_score="raise")
    settings = {"cv": outer, "error_score": "raise", "params": {"groups": GROUPS}}
    if not routing:
        settings["groups"] = GROUPS
    with sklearn.config_context(enable_metadata_routing=routing):
        scores = cross_validate(search, LEVELS, LABELS, **settings)
    assert len(scores["test_score"]) == 3 and scores["test_score"].min() > 0.5


@pytest.mark.parametrize(
    ("settings", "groups", "message"),
    [
        ({}, None, "groups is missing, expected the speed of each window"),
        ({}, SPEED[:5], "groups.shape =="),
        ({}, np.ones((60, 4)), "groups.shape =="),
        ({}, ["fast"] * 60, "rpm must hold numbers"),
        ({}, SPEED - 300, "rpm of row 0: 0.0, expected .* above 0"),
        ({}, np.where(SPEED > 400, np.nan, SPEED), "rpm of row 40: nan"),
        ({}, np.ones(60), "Speeds in groups: .* at least two"),
        ({}, GROUPS[["rpm"]].assign(recording=range(60)), "halves of the recordings"),
        ({"leave_out": True}, np.ones(60), "Speeds in groups: .* at least two"),
        ({"leave_out": True, "train_rpm": 300}, SPEED, "leave_out == True, expected F"),
        ({"train_rpm": 3}, SPEED, r"train_rpm == 3, expected .* \[300.0"),
        ({"train_rpm": -5}, SPEED, "train_rpm == -5, must be > 0"),
        ({"train_rpm": np.nan}, SPEED, "train_rpm == nan, must be finite"),
        ({"same_speed": True}, SPEED, "same_speed == True, .* second column"),
        ({"leave_out": "no"}, SPEED, "leave_out"),
        ({"same_speed": "no"}, SPEED, "same_speed"),
        ({"train_rpm": "300"}, SPEED, "train_rpm"),
        ({}, GROUPS, "window_length for the starts in groups"),
        ({"window_length": 0}, GROUPS, "window_length for the starts in groups == 0"),
        ({"window_length": 1}, GROUPS.assign(start=0.5), r"Starts in groups: \[0.5"),
        ({"window_length": 1}, GROUPS.assign(start=np.nan), r"Starts in groups: \[nan"),
        ({"window_length": 1}, GROUPS.assign(start="a"), r"Starts in groups: \['a'"),
    ],
)
def test_splitter_of_speeds_names_what_is_wrong(settings, groups, message):
    with pytest.raises((TypeError, ValueError), match=message):
        list(SpeedSplit(**settings).split(LEVELS, groups=groups))


def test_training_speed_may_have_jitter():
    assert as_lists(speed_splits([600, 605, 700], train_rpm=610)) == [([0, 1], [2])]
    assert len(speed_splits([600, 613, 700])) == 6
    with pytest.raises(
        ValueError, match=r"train_rpm == 650, expected .* \[602.495, 700.0\]"
    ):
        speed_splits([600, 605, 700], train_rpm=650)


def specimen_splits(y, specimen, *columns, **settings):
    groups = pd.DataFrame(dict(enumerate([specimen, *columns])))
    return as_lists(SpecimenSplit(**settings).split(None, y, groups))


AGEING = ["good", "inner", "good", "outer", "good", "inner", "good", "outer"]
BALLS = [["ball"] * 8, list("AAAABBBB"), [900] * 8, list("AAAABBBB")]
SIZES = [["minor", "severe", "IR2", "IR5"], list("abcd")]


@pytest.mark.parametrize(
    ("columns", "settings", "expected"),
    [
        # Each fold leaves out one specimen of each fault location.
        (
            [["Normal", "Normal", "IR2", "IR5", "OR2", "OR5"], list("abcdef")],
            {},
            [([1, 3, 5], [0, 2, 4]), ([0, 2, 4], [1, 3, 5])],
        ),
        # The only specimen of a location always trains.
        (
            [["good", "good", "ball", "ball"], list("AABC")],
            {},
            [([0, 1, 3], [2]), ([0, 1, 2], [3])],
        ),
        # A location of few specimens is complete in the last folds.
        (
            [["inner"] * 3 + ["outer"] * 2, list("abcde")],
            {},
            [([1, 2, 4], [0, 3]), ([0, 2, 3], [1, 4]), ([0, 1, 3, 4], [2])],
        ),
        # A specimen that is healthy first and faulty later is left out with all rows.
        (
            [AGEING, list("AABBCCDD")],
            {},
            [([4, 5, 6, 7], [0, 1, 2, 3]), ([0, 1, 2, 3], [4, 5, 6, 7])],
        ),
        # B is the only specimen of the outer race.
        (
            [AGEING[:6], list("AABBCC")],
            {},
            [([2, 3, 4, 5], [0, 1]), ([0, 1, 2, 3], [4, 5])],
        ),
        # First halves of recordings train; those left out are tested as a whole.
        (BALLS, {}, [([4, 5], [0, 1, 2, 3]), ([0, 1], [4, 5, 6, 7])]),
        (
            [*BALLS, [0, 10, 20, 30] * 2],
            {"window_length": 25},
            [([4], [0, 1, 2, 3]), ([0], [4, 5, 6, 7])],
        ),
        # B was recorded at 900 rpm only, so no bearing with this fault trains at 1500
        # rpm without A.
        (
            [["ball"] * 3 + ["good"] * 2, list("AABNN"), [900, 1500, 900, 900, 1500]],
            {},
            [([2, 3], [0, 1]), ([0, 3], [2]), ([1, 4], [2])],
        ),
        # Locations are those of names, or given.
        (SIZES, {}, [([0, 1, 3], [2]), ([0, 1, 2], [3])]),
        (
            SIZES,
            {"locations": {"minor": "ball", "severe": "ball", "IR5": "cage"}},
            [([1, 2, 3], [0]), ([0, 2, 3], [1])],
        ),
    ],
)
def test_splits_of_specimens(columns, settings, expected):
    assert specimen_splits(*columns, **settings) == expected


def test_folds_do_not_depend_on_the_order_of_rows():
    rng = np.random.default_rng(0)
    y, specimen = np.array(["good", "inner"] * 6), np.arange(12) // 3
    order = rng.permutation(12)
    moved = specimen_splits(y[order], specimen[order])
    restored = [[sorted(order[rows].tolist()) for rows in split] for split in moved]
    assert restored == [list(split) for split in specimen_splits(y, specimen)]


@pytest.mark.parametrize(
    ("test_speed", "tests"),
    [("all", [[0, 1], [0, 1]]), ("same", [[0], [1]]), ("other", [[1], [0]])],
)
def test_a_fold_trains_at_each_speed_and_tests_at_the_chosen_ones(test_speed, tests):
    y, specimen, rpm = ["ball"] * 4, ["A", "A", "B", "B"], [900, 1500, 905, 1500]
    splits = specimen_splits(y, specimen, rpm, test_speed=test_speed)
    assert [train for train, _ in splits] == [[2], [3], [0], [1]]
    assert [test for _, test in splits[:2]] == tests


@pytest.mark.parametrize("routing", [False, True])
def test_places_of_other_specimens_are_cross_validated(routing):
    groups = pd.DataFrame({"specimen": RUN, "rpm": np.tile(SPEED[::20], 20)})
    cv = SpecimenSplit(test_speed="other")
    with sklearn.config_context(enable_metadata_routing=routing):
        settings = {"params": {"groups": groups}} if routing else {"groups": groups}
        scores = cross_validate(ThresholdLadder(), LEVELS, LABELS, cv=cv, **settings)
    assert len(scores["test_score"]) == cv.get_n_splits(LEVELS, LABELS, groups) == 9
    assert scores["test_score"].mean() > 0.8


@pytest.mark.parametrize(
    ("settings", "y", "groups", "message"),
    [
        ({}, LABELS, None, "groups is missing, expected the bearing of each window"),
        ({}, LABELS, np.ones((60, 5)), "columns specimen, rpm, recording, start"),
        ({}, None, RUN, "y is missing, expected the condition of each window"),
        ({}, LABELS[:5], RUN, "inconsistent numbers of samples"),
        ({}, LABELS, np.where(RUN == 5, np.nan, RUN), r"without a specimen: \[50"),
        ({}, LABELS, LABELS, r"'healthy': 1, 'worn': 1\}, expected at least two"),
        ({"test_speed": "next"}, LABELS, RUN, "test_speed == 'next', expected one of"),
    ],
)
def test_splitter_of_specimens_names_what_is_wrong(settings, y, groups, message):
    with pytest.raises(ValueError, match=message):
        list(SpecimenSplit(**settings).split(LEVELS, y, groups))
