"""The same recording twice, and conditions that look alike."""

import os
import shutil
import unicodedata

import numpy as np
import pytest

from skarxlag import load_recordings, read_recording_table
from skarxlag.plant.readers.listing import list_recordings


@pytest.fixture
def folder(tmp_path):
    rng = np.random.default_rng(0)
    for name in ("a", "b"):
        x, y = rng.normal(size=(2, 500))
        np.savez(tmp_path / f"{name}.npz", x=x, y=y, fs=1000)
    # More than the ends that are compared first, which are equal.
    long = np.zeros(60_000)
    long[::7] = 1.0
    np.save(tmp_path / "c.npy", long)
    long[30_000] = 2.0
    np.save(tmp_path / "d.npy", long)
    return tmp_path


def table(folder, *lines):
    path = folder / "table.csv"
    text = "\n".join(["path,condition,channel,sampling_rate", *lines])
    path.write_text(text, encoding="utf-8")
    return path


def check_refused(path, message):
    with pytest.raises(ValueError, match=message):
        read_recording_table(path)
    with pytest.raises(ValueError, match=message):
        load_recordings(path, window_length=100)


@pytest.mark.parametrize("condition", ["worn", "good"])
@pytest.mark.parametrize(
    "name", ["./a.npz", "sub/../a.npz", "copy.npz", "link.npz", "hard.npz"]
)
def test_the_same_recording(folder, name, condition):
    (folder / "sub").mkdir()
    shutil.copy(folder / "a.npz", folder / "copy.npz")
    if hasattr(os, "symlink"):
        os.symlink(folder / "a.npz", folder / "link.npz")
    os.link(folder / "a.npz", folder / "hard.npz")
    path = table(folder, "a.npz,good,x,", "b.npz,worn,x,", f"{name},{condition},x,")
    check_refused(
        path, r"table.csv, line 4: .*npz is the same recording as .*a.npz of .*, line 2"
    )


@pytest.mark.parametrize("channels", [("x", "0"), ("1", "*y"), ("x;y", "0;1")])
def test_the_same_channel_by_two_names(folder, channels):
    shutil.copy(folder / "a.npz", folder / "copy.npz")
    path = table(folder, f"a.npz,good,{channels[0]},", f"copy.npz,worn,{channels[1]},")
    check_refused(
        path, r"line 3: .*copy.npz is the same recording as .*a.npz of .*, line 2"
    )


def test_two_channels_of_a_file_are_two_recordings(folder):
    shutil.copy(folder / "a.npz", folder / "copy.npz")
    path = table(folder, "a.npz,good,x,", "a.npz,worn,y,", "b.npz,good,x,")
    assert len(read_recording_table(path).recordings) == 3
    path = table(folder, "a.npz,good,x,", "copy.npz,worn,y,")
    assert len(read_recording_table(path).recordings) == 2


def test_recordings_that_differ_in_one_sample(folder):
    path = table(folder, "c.npy,good,,1000", "d.npy,worn,,1000")
    assert len(read_recording_table(path).recordings) == 2


def test_copies_in_a_folder(folder):
    (folder / "worn").mkdir()
    shutil.copy(folder / "a.npz", folder / "worn" / "new.npz")
    with pytest.raises(ValueError, match="is the same recording as") as refusal:
        load_recordings(folder / "**" / "*.npz", channel="x")
    # Each file is named once.
    first, _, second = str(refusal.value).partition(" is the same recording as ")
    assert {first, second} == {str(folder / "a.npz"), str(folder / "worn" / "new.npz")}


@pytest.mark.parametrize(
    "text", ["outer\u00a0race", "outer  race", "ou\u00adter race\u200b"]
)
def test_conditions_that_look_alike_are_one(folder, text):
    path = table(folder, "a.npz,outer race,x,", f"b.npz,{text},x,", "c.npy,1,,1000")
    rig = load_recordings(path, window_length=100)
    assert rig.target_names == ["outer race", "1"]
    assert {*rig.specimen} == {"outer race", "1"}


def test_accents_of_one_and_of_two_characters(folder):
    one = unicodedata.normalize("NFC", "schadhaft-größer é")
    two = unicodedata.normalize("NFD", one)
    assert one != two
    path = table(folder, f"a.npz,{one},x,", f"b.npz,{two},x,")
    assert load_recordings(path, window_length=100).target_names == [one]
    (folder / two).mkdir()
    shutil.copy(folder / "a.npz", folder / two / "1.npz")
    pattern = r"(?P<condition>[^/]+)/1\.npz"
    (entry,) = list_recordings(folder / "*" / "*.npz", pattern=pattern)
    assert entry.condition == one
