"""TDMS files as npTDMS's own writer makes them."""

import numpy as np
import pytest

from skarxlag import list_channels, read_recording
from skarxlag.plant.readers.files import recording_start

from .reading import in_blocks, truncate

nptdms = pytest.importorskip("nptdms")

Y, U = np.random.default_rng(0).normal(size=(2, 103))


@pytest.fixture
def path(tmp_path):
    return tmp_path / "run.tdms"


def write(path, *segments):
    """Write segments, each a list of channels (group, name, values, properties) or objects."""
    with nptdms.TdmsWriter(path) as writer:
        for segment in segments:
            objects = [
                nptdms.ChannelObject(*part) if isinstance(part, tuple) else part
                for part in segment
            ]
            writer.write_segment(objects)


@pytest.fixture
def bearing(path):
    step = {"wf_increment": 1 / 25600, "unit_string": "g"}
    slow = {"wf_increment": 0.1, "NI_UnitDescription": "Nm"}
    segments = [
        [
            ("bearing", "vibration", Y[part], step),
            ("bearing", "torque", U[part].astype("f4"), slow),
            ("bearing", "note", ["a text"]),
        ]
        for part in (slice(0, 60), slice(60, None))
    ]
    write(path, *segments)
    return path


def test_names_rates_and_units(bearing):
    channels = list_channels(bearing)
    assert channels["channel"].tolist() == ["vibration", "torque"]
    assert channels["sampling_rate"].tolist() == [25600, 10]
    assert channels["unit"].tolist() == ["g", "Nm"]


@pytest.mark.parametrize(
    ("n_samples", "longest"), [(None, 103), (7, 7), (60, 60), (1000, 103)]
)
def test_samples(bearing, n_samples, longest):
    read = in_blocks(bearing, n_samples, channel="vibration")
    np.testing.assert_array_equal(read[0], Y)
    assert read[1:] == (25600, longest)
    np.testing.assert_array_equal(read_recording(bearing, channel=1)[0], U.astype("f4"))


def test_channels_of_different_rates_are_not_read_together(bearing):
    message = r"different sampling rates, in Hz: vibration 25600, torque 10"
    with pytest.raises(ValueError, match=message):
        read_recording(bearing, channel=["vibration", "torque"])


@pytest.mark.parametrize("level", ["file", "group"])
def test_a_rate_among_the_properties_of_a_group_or_of_the_file(path, level):
    rate = {"SampleRate": 51200.0}
    parents = {"file": nptdms.RootObject(rate), "group": nptdms.GroupObject("a", rate)}
    write(path, [parents[level], ("a", "y", Y)])
    assert read_recording(path)[1] == 51200


def test_one_name_in_two_groups(path):
    write(path, [("a", "y", Y), ("b", "y", U)])
    np.testing.assert_array_equal(
        read_recording(path, channel=["b/y", "a/y"])[0], [U, Y]
    )


def test_integers_with_a_scale(path):
    """A linear scale as DAQ drivers write it beside raw integers."""
    raw = np.arange(50, dtype="i2")
    scale = {
        "NI_Number_Of_Scales": 1,
        "NI_Scale[0]_Scale_Type": "Linear",
        "NI_Scale[0]_Linear_Slope": 0.5,
        "NI_Scale[0]_Linear_Y_Intercept": 10.0,
        "NI_Scale[0]_Linear_Input_Source": 0xFFFFFFFF,
    }
    write(path, [("a", "y", raw, scale)])
    np.testing.assert_array_equal(read_recording(path)[0], 10 + raw / 2)


@pytest.mark.parametrize("kept", [0, 10, 100, 900])
def test_truncated_files(bearing, kept):
    truncate(bearing, kept)
    with pytest.raises(ValueError, match=r"run.tdms: "):
        read_recording(bearing, channel="vibration")


def test_channels_without_samples(path):
    write(path, [("a", "y", np.zeros(0))])
    with pytest.raises(ValueError, match=r"run.tdms: (channel 'y' is empty|holds no)"):
        read_recording(path)


SEVEN = np.datetime64("2026-11-22T07:00:00.25", "us")


@pytest.mark.parametrize(
    ("properties", "start"),
    [
        ({"wf_start_time": SEVEN}, 1795330800.25),
        ({"wf_start_time": SEVEN, "wf_start_offset": 0.5}, 1795330800.75),
        ({"wf_start_time": np.datetime64("1904-01-01", "us")}, None),
        ({}, None),
    ],
)
def test_date_of_the_first_sample(path, properties, start):
    properties = {"wf_increment": 1e-3} | properties
    write(path, [("g", "y", np.arange(9.0), properties)])
    assert recording_start(path) == recording_start(path, channel=["y"]) == start
