"""Folders and globs in place of a table, and facts in the names of files."""

import os

import numpy as np
import pytest

from skarxlag import load_recordings, read_recording_table
from skarxlag.plant.readers.listing import list_files, list_recordings

PATTERN = r"(?P<condition>[A-Z]+)_(?P<rpm>\d+)_(?P<sensor>\w+)"


@pytest.fixture
def folder(tmp_path):
    for i, name in enumerate(["OR_900_a", "sub/N_300_a", "sub/N_900_b"]):
        path = tmp_path / f"{name}.npy"
        path.parent.mkdir(exist_ok=True)
        np.save(path, np.full(10, float(i)))
    (tmp_path / "readme.md").write_text("no recording")
    return tmp_path


@pytest.mark.parametrize("source", ["", "**/*.npy"])
def test_facts_in_the_names_of_files(folder, source):
    rig = load_recordings(
        str(folder / source),
        window_length=5,
        pattern=PATTERN,
        sampling_rate=1000,
        healthy="N",
    )
    assert rig.target_names == ["N", "OR"]
    assert rig.target.tolist() == ["OR"] * 2 + ["N"] * 4
    assert rig.rpm.tolist() == [900, 900, 300, 300, 900, 900]
    assert rig.further["sensor"].tolist() == ["a", "a", "b"]
    assert rig.data[:, 0].tolist() == [0, 0, 1, 1, 2, 2]
    assert rig.sampling_rate == 1000


def test_a_folder_without_a_pattern(folder):
    table = read_recording_table(folder, sampling_rate=5)
    assert table.condition is None and table.rpm is None
    assert table.recording == ["OR_900_a.npy", "sub/N_300_a.npy", "sub/N_900_b.npy"]


def test_channel_and_type_of_all_files(tmp_path):
    np.arange(12, dtype="<i2").tofile(tmp_path / "a.bin")
    options = {"channel": "1", "dtype": "(2,)<i2", "sampling_rate": 10}
    table = read_recording_table(tmp_path, **options)
    np.testing.assert_array_equal(table.recordings[0], np.arange(1, 12, 2))


def test_a_pattern_may_state_channel_and_rate(tmp_path):
    np.savez(tmp_path / "y@8000.npz", x=np.zeros(3), y=np.ones(3))
    pattern = r"(?P<channel>\w)@(?P<sampling_rate>\d+)"
    table = read_recording_table(tmp_path, pattern=pattern)
    assert table.sampling_rate == 8000
    assert table.recordings[0].tolist() == [1, 1, 1]


def test_one_file_is_listed_and_its_rate_may_be_unknown(folder):
    (entry,) = list_files(folder / "OR_900_a.npy")
    opened = entry.open()
    assert opened.sampling_rate is None
    assert [len(signal) for signal in opened.blocks] == [10]


@pytest.mark.parametrize(
    ("source", "options", "message"),
    [
        ("", {"pattern": "("}, r"pattern is '\(': missing \)"),
        ("", {"pattern": "x"}, r"pattern is 'x': expected named groups"),
        ("", {"pattern": "(?P<rpm>x)"}, r"OR_900_a.npy: does not fit the pattern"),
        (
            "",
            {"pattern": "(?P<rpm>[A-Z]+)"},
            r"OR_900_a.npy: rpm is 'OR', expected a positive",
        ),
        ("*.mat", {}, r"\*.mat: no such file, expected a recording"),
        ("none", {}, r"none: no such file"),
        ("", {}, r"OR_900_a.npy: sampling_rate is missing"),
        ("", {"sampling_rate": 5, "channel": "x"}, r"OR_900_a.npy: no channel 'x'"),
    ],
)
def test_errors(folder, source, options, message):
    with pytest.raises((ValueError, FileNotFoundError), match=message):
        read_recording_table(folder / source, **options)


@pytest.mark.parametrize("name", ["run_30Hz.npy", "30_hz_a.npy"])
def test_a_number_in_hertz_is_no_speed(tmp_path, name):
    np.save(tmp_path / name, np.zeros(9))
    message = f"{name}: the pattern takes rpm 30 from a number in Hz; .* 60 times"
    with pytest.raises(ValueError, match=message):
        list_files(tmp_path, pattern=r"(?P<rpm>\d+)")


def test_a_pattern_does_not_go_with_a_table(tmp_path):
    (tmp_path / "table.csv").write_text("path\na.npy\n")
    message = r"pattern is for a folder or a glob; .*table.csv is"
    with pytest.raises(ValueError, match=message):
        list_recordings(tmp_path / "table.csv", pattern="y")


def test_facts_fill_what_a_table_does_not_state(tmp_path):
    table = tmp_path / "table.csv"
    table.write_text("path,channel,sampling_rate,rpm\na.npy,x,,900\nb.npy,,50e3,\n")
    first, second = list_recordings(table, channel="y", sampling_rate=2e4, rpm=600.0)
    assert (first.channel, first.sampling_rate, first.rpm) == ("x", 2e4, 900.0)
    assert (second.channel, second.sampling_rate, second.rpm) == ("y", 5e4, 600.0)


def test_a_speed_in_a_table_comes_before_a_stated_source(tmp_path):
    table = tmp_path / "table.csv"
    table.write_text(
        "path,rpm,pulses_per_revolution\na.npy,900,\nb.npy,tacho:k,\nc.npy,,\n"
    )
    tacho = {"speed_source": "tacho:key", "pulses_per_revolution": 2}
    found = list_recordings(table, **tacho)
    expected = [(900.0, None, 1), (None, "tacho:k", 1), (None, "tacho:key", 2)]
    assert [(e.rpm, e.speed_source, e.pulses_per_revolution) for e in found] == expected


@pytest.mark.parametrize(("name", "value"), [("channel", "y"), ("sampling_rate", 1e3)])
def test_a_fact_that_each_line_states_has_no_effect(tmp_path, name, value):
    table = tmp_path / "table.csv"
    table.write_text("path,channel,sampling_rate\na.npy,x,5e3\nb.npy,x,5e3\n")
    with pytest.raises(
        ValueError,
        match=rf"{name} {value!r} has no effect, because each line of .*table",
    ):
        list_recordings(table, **{name: value})


def test_the_unit_of_a_stated_rate(tmp_path):
    table = tmp_path / "table.csv"
    lines = "path,sampling_rate,Sampling rate unit\na.npy,25.6,kHz\nb.npy,25600,Hz\nc.npy,5,\n"
    table.write_text(lines)
    assert [each.sampling_rate for each in list_recordings(table)] == [
        25_600,
        25_600,
        5,
    ]
    table.write_text("path,sampling_rate,sampling_rate_unit\na.npy,25.6,kV\n")
    message = r"line 2: sampling_rate_unit is 'kV', expected Hz or kHz"
    with pytest.raises(ValueError, match=message):
        list_recordings(table)


@pytest.mark.skipif(not hasattr(os, "symlink"), reason="links")
def test_folders_behind_links_are_left_out(folder):
    (folder / "sub" / "up").symlink_to(folder)
    assert [each.name for each in list_files(folder)] == [
        *("OR_900_a.npy", "sub/N_300_a.npy", "sub/N_900_b.npy")
    ]


def test_recordings_shorter_than_a_window_name_the_option(folder):
    message = r"has 10 samples, .*shorter window \(--window-length\)"
    with pytest.raises(ValueError, match=message):
        load_recordings(folder, window_length=11, sampling_rate=1000)
