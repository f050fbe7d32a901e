"""Structs, cells and sampling rates in MATLAB files up to version 7."""

import numpy as np
import pytest
from scipy.io import savemat

from skarxlag import list_channels, read_recording

Y, U = np.random.default_rng(0).normal(size=(2, 50))


@pytest.fixture
def path(tmp_path):
    return tmp_path / "run.mat"


def channels(path):
    return list_channels(path)["channel"].tolist()


def test_structs(path):
    inner = {"gs": Y, "sr": 97656, "load": 270, "name": "a text", "deep": {"u": U}}
    savemat(path, {"bearing": inner, "rate": 25})
    assert channels(path) == ["bearing.gs", "bearing.deep.u"]
    signal, rate = read_recording(path, channel="bearing.gs")
    np.testing.assert_array_equal(signal, Y)
    assert rate == 97656
    np.testing.assert_array_equal(read_recording(path, channel="bearing.deep.u")[0], U)


def test_arrays_of_structs_and_cells(path):
    cell = np.empty(2, dtype=object)
    cell[:] = [Y, "x"]
    structs = np.array([({"z": 1},), ({"z": 2},)], dtype=[("d", object)])
    savemat(path, {"cell": cell, "runs": [{"y": Y}, {"y": U}], "more": structs})
    assert channels(path) == ["cell[0]", "runs[0].y", "runs[1].y"]
    np.testing.assert_array_equal(read_recording(path, channel="runs[1].y")[0], U)


@pytest.mark.parametrize(
    "name", ["fs", "Fs", "FS", "sampling_rate", "SampleRate", "SampleFrequency", "fs_Hz", "sr"]
)
def test_names_of_the_sampling_rate(path, name):
    savemat(path, {"y": Y, name: 12_000})
    assert read_recording(path)[1] == 12_000


@pytest.mark.parametrize(
    "content", [{"rate": 5}, {"fs": np.nan}, {"fs": -1}, {"fs": 1 + 1j}, {"fs": 1, "sr": 2}]
)
def test_what_states_no_sampling_rate(path, content):
    savemat(path, {"y": Y, **content})
    assert read_recording(path)[1] is None


def test_two_names_that_agree(path):
    savemat(path, {"y": Y, "fs": 10, "SampleRate": 10})
    assert read_recording(path)[1] == 10


def test_a_shorter_channel_was_sampled_more_slowly(path):
    savemat(path, {"y": Y, "speed": U[:10], "fs": 12_000})
    assert read_recording(path, channel="y")[1] == 12_000
    assert read_recording(path, channel="speed")[1] is None
