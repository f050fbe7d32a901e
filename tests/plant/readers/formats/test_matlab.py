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


NAMES_OF_RATES = [
    *("fs", "Fs", "FS", "sampling_rate", "SampleRate", "SampleFrequency", "fs_Hz"),
    *("sr", "fs_in_Hz"),
]


@pytest.mark.parametrize(
    ("rate", "content"),
    [
        *((12_000, {name: 12_000}) for name in NAMES_OF_RATES),
        (10, {"fs": 10, "SampleRate": 10}),
        (25_600, {"sampling_rate": 25.6, "sampling_rate_unit": "kHz"}),
        (25_600, {"fs": 25.6, "fs_unit": " khz "}),
        (25_600, {"Fs": 25.6, "FsUnits": "kS/s"}),
        *((25_600, {"fs": 25600, "fs_unit": unit}) for unit in ("Hz", "1/s", "S/s")),
        *((25_600, {"fs": 0.0256, "fs_unit": unit}) for unit in ("MHz", "MS/s")),
        (25_600, {"fs_kHz": 25.6}),
        (25_600, {"dt": 39.0625, "dt_unit": "us"}),
        (25_600, {"dt_in_s": 1 / 25_600}),
        (None, {"rate": 5}),
        (None, {"fs": np.nan}),
        (None, {"fs": -1}),
        (None, {"fs": 1 + 1j}),
        (None, {"fs": 25.6, "fs_unit": "V"}),
    ],
)
@pytest.mark.parametrize("suffix", [".mat", ".npz"])
def test_what_states_the_sampling_rate(path, suffix, rate, content):
    path = path.with_suffix(suffix)
    if suffix == ".mat":
        savemat(path, {"y": Y, **content})
    else:
        np.savez(path, y=Y, **content)
    assert read_recording(path)[1] == rate


@pytest.mark.parametrize(
    "content", [{"fs": 12e3, "Fs": 48e3}, {"fs": 12e3, "dt": 1 / 48e3}]
)
def test_two_rates_that_disagree(path, content):
    savemat(path, {"y": Y, **content})
    names = "fs 12000 Hz, (Fs|dt) 48000 Hz"
    message = f"run.mat: states several sampling rates: {names}"
    with pytest.raises(ValueError, match=message):
        read_recording(path)
    with pytest.raises(ValueError, match=message):
        list_channels(path)


def test_a_shorter_channel_was_sampled_more_slowly(path):
    savemat(path, {"y": Y, "speed": U[:10], "fs": 12_000})
    assert read_recording(path, channel="y")[1] == 12_000
    assert read_recording(path, channel="speed")[1] is None
