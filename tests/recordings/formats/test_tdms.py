"""TDMS files as npTDMS's own writer makes them."""

import numpy as np
import pytest

from skarxlag import list_channels, read_recording
from skarxlag.recordings.files import recording_start
from tests.recordings.blocks import recording_blocks

nptdms = pytest.importorskip("nptdms")

RNG = np.random.default_rng(0)
Y, U = RNG.normal(size=(2, 103))


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "run.tdms"
    with nptdms.TdmsWriter(path) as writer:
        for part in (slice(0, 60), slice(60, None)):
            step = {"wf_increment": 1 / 25600, "unit_string": "g"}
            slow = {"wf_increment": 0.1, "NI_UnitDescription": "Nm"}
            writer.write_segment(
                [
                    nptdms.ChannelObject("bearing", "vibration", Y[part], step),
                    nptdms.ChannelObject(
                        "bearing", "torque", U[part].astype("f4"), slow
                    ),
                    nptdms.ChannelObject("bearing", "note", ["a text"]),
                ]
            )
    return path


def test_names_rates_and_units(path):
    channels = list_channels(path)
    assert channels["channel"].tolist() == ["vibration", "torque"]
    assert channels["sampling_rate"].tolist() == [25600, 10]
    assert channels["unit"].tolist() == ["g", "Nm"]


@pytest.mark.parametrize("n_samples", [None, 7, 60, 1000])
def test_samples(path, n_samples):
    blocks, rates = zip(
        *recording_blocks(path, n_samples, channel="vibration"), strict=True
    )
    np.testing.assert_array_equal(np.concatenate(blocks), Y)
    assert set(rates) == {25600}
    assert max(map(len, blocks)) <= (n_samples or 103)
    np.testing.assert_array_equal(read_recording(path, channel=1)[0], U.astype("f4"))


def test_channels_of_different_rates_are_not_read_together(path):
    with pytest.raises(
        ValueError, match=r"different sampling rates, in Hz: vibration 25600, torque 10"
    ):
        read_recording(path, channel=["vibration", "torque"])


@pytest.mark.parametrize("level", [nptdms.RootObject, nptdms.GroupObject])
def test_a_rate_among_the_properties_of_a_group_or_of_the_file(tmp_path, level):
    properties = {"SampleRate": 51200.0}
    owner = level(properties) if level is nptdms.RootObject else level("a", properties)
    with nptdms.TdmsWriter(tmp_path / "run.tdms") as writer:
        writer.write_segment([owner, nptdms.ChannelObject("a", "y", Y)])
    assert read_recording(tmp_path / "run.tdms")[1] == 51200


def test_one_name_in_two_groups(tmp_path):
    with nptdms.TdmsWriter(tmp_path / "run.tdms") as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject(group, "y", values)
                for group, values in (("a", Y), ("b", U))
            ]
        )
    np.testing.assert_array_equal(
        read_recording(tmp_path / "run.tdms", channel="b/y")[0], U
    )


def test_integers_with_a_scale(tmp_path):
    """A linear scale as DAQ drivers write it beside raw integers."""
    raw = np.arange(50, dtype="i2")
    scale = {
        "NI_Number_Of_Scales": 1,
        "NI_Scale[0]_Scale_Type": "Linear",
        "NI_Scale[0]_Linear_Slope": 0.5,
        "NI_Scale[0]_Linear_Y_Intercept": 10.0,
        "NI_Scale[0]_Linear_Input_Source": 0xFFFFFFFF,
    }
    with nptdms.TdmsWriter(tmp_path / "run.tdms") as writer:
        writer.write_segment([nptdms.ChannelObject("a", "y", raw, scale)])
    np.testing.assert_array_equal(
        read_recording(tmp_path / "run.tdms")[0], 10 + raw / 2
    )


@pytest.mark.parametrize("kept", [0, 10, 100, 900])
def test_truncated_files(path, kept):
    path.write_bytes(path.read_bytes()[:kept])
    with pytest.raises(ValueError, match=r"run.tdms: "):
        read_recording(path, channel="vibration")


def test_channels_without_samples(tmp_path):
    with nptdms.TdmsWriter(tmp_path / "run.tdms") as writer:
        writer.write_segment([nptdms.ChannelObject("a", "y", np.zeros(0))])
    with pytest.raises(ValueError, match=r"run.tdms: (channel 'y' is empty|holds no)"):
        read_recording(tmp_path / "run.tdms")


def test_two_channels_block_by_block(path):
    with nptdms.TdmsWriter(path) as writer:
        for part in (slice(0, 60), slice(60, None)):
            channels = [
                nptdms.ChannelObject("a", n, v[part]) for n, v in (("y", Y), ("u", U))
            ]
            writer.write_segment(channels)
    blocks = [block for block, _ in recording_blocks(path, 25, channel=["u", "y"])]
    assert [block.shape for block in blocks] == [(2, 25)] * 4 + [(2, 3)]
    np.testing.assert_array_equal(np.concatenate(blocks, axis=1), [U, Y])


@pytest.mark.parametrize(
    ("properties", "start"),
    [
        (
            {"wf_start_time": np.datetime64("2026-11-22T07:00:00.25", "us")},
            1795330800.25,
        ),
        (
            {
                "wf_start_time": np.datetime64("2026-11-22T07:00", "us"),
                "wf_start_offset": 0.5,
            },
            1795330800.5,
        ),
        ({"wf_start_time": np.datetime64("1904-01-01", "us")}, None),
        ({}, None),
    ],
)
def test_date_of_the_first_sample(tmp_path, properties, start):
    path = tmp_path / "run.tdms"
    with nptdms.TdmsWriter(path) as writer:
        properties = {"wf_increment": 1e-3} | properties
        writer.write_segment(
            [nptdms.ChannelObject("g", "y", np.arange(9.0), properties)]
        )
    assert recording_start(path) == recording_start(path, channel=["y"]) == start
