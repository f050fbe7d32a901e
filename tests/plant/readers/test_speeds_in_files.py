"""Shaft speeds that a file states: variables, attributes, properties and channels."""

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from skarxlag import list_channels, load_recordings, read_recording
from skarxlag.plant.readers.files import recording_speed
from skarxlag.plant.readers.listing import list_recordings

Y = np.random.default_rng(0).normal(size=50)


def h5(path, content):
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file["bearing/y"] = Y
        file["bearing/y"].attrs.update(content)


def tdms(path, content):
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(path) as writer:
        group = nptdms.GroupObject("g", content)
        writer.write_segment([group, nptdms.ChannelObject("g", "y", Y)])


WRITERS = {
    "mat": lambda path, content: savemat(path, {"y": Y, **content}),
    "npz": lambda path, content: np.savez(path, y=Y, **content),
    "h5": h5,
    "tdms": tdms,
}


@pytest.mark.parametrize("suffix", WRITERS)
@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ({"rpm": 1750.0}, 1750),
        ({"X105RPM": 1772.0}, 1772),
        ({"Drehzahl": 900.0}, 900),
        ({"Speed (rpm)": 1200.0}, 1200),
        ({"rpm": -5.0}, None),
        ({"rpm_setpoint": 900.0, "speed": 15.0}, None),
        ({"fan_rpm": 300.0, "shaft_rpm": 1800.0}, None),
    ],
)
def test_numbers(tmp_path, suffix, content, expected):
    if suffix == "mat" and "Speed (rpm)" in content:
        pytest.skip("MATLAB has no such names")
    path = tmp_path / f"run.{suffix}"
    WRITERS[suffix](path, content)
    assert recording_speed(path) == expected
    listed = list_channels(path)["rpm"]
    assert listed.tolist() == [expected] if expected else listed.isna().all()


def test_the_number_whose_name_begins_like_that_of_the_channel(tmp_path):
    content = {"X098_DE_time": Y, "X099_DE_time": Y, "X098RPM": 1772, "X099RPM": 1750}
    savemat(tmp_path / "99.mat", content)
    assert recording_speed(tmp_path / "99.mat", channel="X099*") == 1750
    channels = ["X098_DE_time", "X099_DE_time"]
    assert recording_speed(tmp_path / "99.mat", channel=channels) == 1772
    assert recording_speed(tmp_path / "99.mat") is None


@pytest.mark.parametrize("suffix", ["csv", "parquet", "npz"])
@pytest.mark.parametrize("name", ["rpm", "Speed [rpm]", "motor_rpm"])
def test_a_channel(tmp_path, suffix, name):
    path, speeds = tmp_path / f"run.{suffix}", 900 + np.arange(50.0)
    frame = pd.DataFrame({"y": Y, name: speeds})
    if suffix == "npz":
        np.savez(path, **{key: frame[key].to_numpy() for key in frame})
    else:
        getattr(frame, f"to_{suffix}")(path, index=False)
    assert recording_speed(path) == pytest.approx(924.5)
    # It is not a signal, unless it is asked for.
    np.testing.assert_allclose(read_recording(path)[0], Y, rtol=1e-13)
    np.testing.assert_array_equal(read_recording(path, channel=name)[0], speeds)


def test_a_channel_known_by_its_unit(tmp_path):
    (tmp_path / "run.csv").write_text("y;n\ng;1/min\n1.5;900\n2.5;902\n")
    assert recording_speed(tmp_path / "run.csv") == 901


def test_speeds_of_a_list(tmp_path):
    for name, rpm in (("a", 900), ("b", 1200)):
        np.savez(tmp_path / f"{name}.npz", y=Y, rpm=rpm, fs=1000)
    expected = [900, 900, 1200, 1200]
    assert load_recordings(tmp_path, window_length=25).rpm.tolist() == expected
    (tmp_path / "table.csv").write_text("path,rpm\na.npz,905\nb.npz,1205\n")
    rig = load_recordings(tmp_path / "table.csv", window_length=25)
    assert rig.rpm.tolist() == [905, 905, 1205, 1205]
    entry = list_recordings(tmp_path / "*.npz")[0]
    assert entry.rpm is None and entry.with_speed().rpm == 900
    np.savez(tmp_path / "c.npz", y=Y, fs=1000)
    assert load_recordings(tmp_path / "*.npz", window_length=25).rpm is None
