import numpy as np
import pytest

from skarxlag import speed_splits


def as_lists(splits):
    return [(train.tolist(), test.tolist()) for train, test in splits]


def test_every_ordered_pair_of_speeds_in_ascending_order():
    assert as_lists(speed_splits([500, 300, 400, 300])) == [
        ([1, 3], [2]),
        ([1, 3], [0]),
        ([2], [1, 3]),
        ([2], [0]),
        ([0], [1, 3]),
        ([0], [2]),
    ]


def test_train_rpm_chooses_the_training_speed():
    assert as_lists(speed_splits([500, 300, 400, 300], train_rpm=500)) == [
        ([0], [1, 3]),
        ([0], [2]),
    ]


def test_halves_are_taken_in_time_within_each_recording():
    rpm = [1, 1, 1, 2, 2, 1, 1, 2, 2, 2, 2]
    recording = list("aaabbccdddd")
    # a: 0 | (1) | 2; b: 3 | 4; c: 5 | 6; d: 7 8 | 9 10
    assert as_lists(speed_splits(rpm, recording=recording)) == [
        ([0, 5], [4, 9, 10]),
        ([3, 7, 8], [2, 6]),
    ]
    assert as_lists(speed_splits(rpm, recording=recording, same_speed=True)) == [
        ([0, 5], [2, 6]),
        ([0, 5], [4, 9, 10]),
        ([3, 7, 8], [2, 6]),
        ([3, 7, 8], [4, 9, 10]),
    ]


def test_recordings_need_not_lie_in_one_piece():
    splits = speed_splits([1, 2, 1, 2], recording=["a", "b", "a", "b"])
    assert as_lists(splits) == [([0], [3]), ([1], [2])]


def test_one_speed_against_itself():
    assert as_lists(speed_splits([5, 5], recording=[0, 0], same_speed=True)) == [([0], [1])]


def test_nothing_is_on_both_sides():
    rng = np.random.default_rng(0)
    rpm, recording = rng.integers(3, size=90), rng.integers(9, size=90)
    for train, test in speed_splits(rpm, recording=rpm * 10 + recording, same_speed=True):
        assert len(train) and len(test)
        assert not set(train) & set(test)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"rpm": [1, 1]}, r"one speed, \[1\]"),
        ({"rpm": [1, 2], "train_rpm": 3}, r"train_rpm=3 .* \[1, 2\]"),
        ({"rpm": [1, 2], "same_speed": True}, "recording"),
        ({"rpm": [1, 2], "recording": ["a"]}, "inconsistent numbers"),
        ({"rpm": [1, 2, np.nan]}, "rpm contains NaN"),
        ({"rpm": [[1, 2], [3, 4]]}, "1d array"),
    ],
)
def test_errors_name_what_is_wrong(arguments, message):
    with pytest.raises(ValueError, match=message):
        speed_splits(**arguments)


def test_recordings_of_one_window_are_refused_where_they_leave_nothing():
    with pytest.raises(ValueError, match="recording"):
        speed_splits([1, 1, 2], recording=["a", "a", "b"])
