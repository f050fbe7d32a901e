from itertools import product

import numpy as np
import pandas as pd
import pytest

from skarxlag import make_windows


@pytest.mark.parametrize("channels", [(), (1,), (3,)])
@pytest.mark.parametrize("window_length", [1, 5, 6])
def test_windows_are_slices_of_the_recording(channels, window_length):
    for n_samples, hop in product([6, 7, 11, 12], [None, 1, 2, 5, 9]):
        recording = np.random.default_rng(0).normal(size=(*channels, n_samples))
        starts = range(0, n_samples - window_length + 1, hop or window_length)
        expected = np.stack([recording[..., s : s + window_length] for s in starts])
        np.testing.assert_array_equal(
            make_windows(recording, window_length, hop=hop), expected
        )


def test_default_length_is_1200_and_the_tail_is_left_out():
    windows = make_windows(np.arange(2 * 1200 + 1199))
    assert windows.shape == (2, 1200)
    assert windows[-1, -1] == 2399


@pytest.mark.parametrize("shape", [(12,), (2, 12)])
@pytest.mark.parametrize(
    ("dtype", "expected"),
    [
        ("f4", "f4"),
        ("f8", "f8"),
        ("i2", "f8"),
        ("u1", "f8"),
        ("f2", "f8"),
        (">f8", "f8"),
    ],
)
def test_windows_are_fresh_contiguous_and_writable(shape, dtype, expected):
    recording = np.arange(np.prod(shape)).reshape(shape).astype(dtype)
    before = recording.copy()
    recording.flags.writeable = False
    windows = make_windows(recording, 4)
    assert windows.dtype == np.dtype(expected)
    assert windows.flags.c_contiguous
    windows[:] = -1
    np.testing.assert_array_equal(recording, before)


def test_memory_mapped_recording(tmp_path):
    np.save(tmp_path / "signal.npy", np.arange(10.0))
    mapped = np.load(tmp_path / "signal.npy", mmap_mode="r")
    windows = make_windows(mapped, 5)
    assert type(windows) is np.ndarray
    np.testing.assert_array_equal(windows, np.arange(10.0).reshape(2, 5))


@pytest.mark.parametrize(
    ("recording", "message"),
    [
        (np.zeros(4), r"recording has 4 samples, fewer than window_length=5"),
        (
            np.zeros((100, 2)),
            r"has 2 samples.*\(100, 2\), expected .*\(n_channels, n_samples\)",
        ),
        (np.zeros((2, 3, 10)), "dim 3"),
        (np.zeros(10, dtype=complex), "[Cc]omplex"),
        (["a"] * 10, "could not convert string"),
        (np.array([np.nan] * 10), "recording contains NaN"),
        (np.array([np.inf] * 10), "recording contains infinity"),
        (np.zeros(0), "0 sample"),
    ],
)
def test_bad_recordings_are_refused(recording, message):
    with pytest.raises(ValueError, match=message):
        make_windows(recording, 5)


def test_a_single_number_is_no_recording():
    with pytest.raises(TypeError, match="got scalar"):
        make_windows(3.0, 5)


@pytest.mark.parametrize("name", ["window_length", "hop"])
@pytest.mark.parametrize(
    ("value", "error"),
    [(0, ValueError), (-3, ValueError), (2.0, TypeError), ("2", TypeError)],
)
def test_bad_lengths_are_refused_by_name(name, value, error):
    with pytest.raises(error, match=name):
        make_windows(np.zeros(10), **{"window_length": 2, name: value})


def test_recordings_of_different_lengths_and_their_facts():
    recordings = [np.arange(7.0), np.arange(3.0), 10 + np.arange(5.0)]
    facts = {"rpm": [300, 500, 500], "condition": ["good", "worn", "good"]}
    windows, table = make_windows(recordings, 3, hop=2, facts=facts)
    np.testing.assert_array_equal(windows[:, 0], [0, 2, 4, 0, 10, 12])
    assert table["rpm"].tolist() == [300, 300, 300, 500, 500, 500]
    assert table["condition"].tolist() == ["good"] * 3 + ["worn"] + ["good"] * 2
    assert table["recording"].tolist() == [0, 0, 0, 1, 2, 2]
    assert table["start"].tolist() == [0, 2, 4, 0, 0, 2]
    named = pd.DataFrame({"recording": ["a", "b", "c"]}, index=[7, 8, 9])
    _, table = make_windows(recordings, 3, facts=named)
    assert table["recording"].tolist() == ["a", "a", "b", "c"]


@pytest.mark.parametrize(
    ("facts", "message"),
    [
        (None, "different lengths; to cut several recordings, state facts of each"),
        ({"rpm": [300]}, "facts are those of 1 recordings, expected 2"),
        ({"rpm": [300, 500]}, "recording 1: recording has 2 samples, fewer than"),
    ],
)
def test_recordings_and_facts_that_do_not_fit(facts, message):
    with pytest.raises(ValueError, match=message):
        make_windows([np.arange(7), np.arange(2)], 3, facts=facts)
