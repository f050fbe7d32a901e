"""Folders into which a logger drops recordings, in ``watch``."""

import json
import os
import sys
import time
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from scipy.io import wavfile

from skarxlag import load_monitor_state
from skarxlag.plant.commands.diagnosis import diagnose_file
from skarxlag.plant.commands.models import SavedModel
from skarxlag.plant.readers.entries import ListedRecording
from skarxlag.plant.watch import folders
from skarxlag.plant.watch.options import SensorOptions
from tests.plant.watch.watching import (
    IDLE,
    RATE,
    WINDOW,
    sound,
    verdicts_of,
)

pytestmark = pytest.mark.filterwarnings("ignore:rpm is not given:UserWarning")


@pytest.fixture
def folder(tmp_path):
    path = tmp_path / "logger"
    path.mkdir()
    return path


@pytest.fixture
def watched(run, model, folder):
    """Watch the folder until nothing comes: verdicts, and standard error."""

    def watch_folder(*options):
        code, out, err = run("watch", model, folder, *IDLE, *options)
        assert code == 0
        return verdicts_of(out), err

    return watch_folder


def drop(folder, name, signal, moment=None):
    np.save(folder / name, signal)
    if moment is not None:
        os.utime(folder / name, (moment, moment))


def changed(seed):
    """A signal that exceeds the healthy limits, and that the diagnoser takes for healthy."""
    return 50 * sound("good", 10 * WINDOW, seed)


def good(seed):
    return sound("good", 10 * WINDOW, seed)


def test_each_file_has_the_verdict_of_diagnose_in_the_order_of_times(
    watched, model, folder
):
    signals = {"b": good(3), "a": sound("worn", 1050, 4), "c": changed(5)}
    for number, (name, signal) in enumerate(signals.items()):
        drop(folder, f"{name}.npy", signal, 1.6e9 + 600 * number)
    found, err = watched()
    assert [line["source"] for line in found] == ["b.npy", "a.npy", "c.npy"]
    saved = SavedModel(model)
    for number, line in enumerate(found):
        path = folder / line["source"]
        recording = ListedRecording(None, path.name, path, sampling_rate=RATE)
        verdict = diagnose_file(recording, lambda: saved).verdict
        assert line["verdict"] == verdict["verdict"]
        assert line["windows"] == verdict["windows"]
        assert line["p_value"] == pytest.approx(verdict["p-value"])
        assert line["exceeds"] == (verdict["alarm"] == "yes")
        assert line["time"] == 1.6e9 + 600 * number
    assert err.splitlines()[-1] == "last: changed; alarm: on"


def test_the_first_snapshot_that_diagnose_would_call_an_alarm_is_one(watched, folder):
    for number, signal in enumerate([good(3), changed(4), good(5), good(6)]):
        drop(folder, f"{number}.npy", signal, 1.6e9 + number)
    lines, _ = watched()
    assert [line["exceeds"] for line in lines] == [False, True, False, False]
    assert [line["alarm"] for line in lines] == [False, True, True, True]
    verdicts = [line["verdict"] for line in lines]
    assert verdicts == ["good", "changed", "possibly changed", "possibly changed"]
    # A longer delay waits, and does not say healthy meanwhile.
    lines, _ = watched("--alarm-delay", 2)
    assert [line["alarm"] for line in lines] == [False] * 4
    assert lines[1]["verdict"] == "changed"
    assert lines[1]["alarm_state"] == "not yet an alarm"


def test_delay_and_false_alarms_are_printed_at_the_start(run, watched, model, folder):
    limits = "beyond the healthy limits. Expected false alarms: at most one in"
    assert (
        f"Alarm: after 1 consecutive snapshot {limits} 100 snapshots." in watched()[1]
    )
    err = watched("--alarm-delay", 3)[1]
    assert f"Alarm: after 3 consecutive snapshots {limits} " in err
    assert float(err.split(" one in ")[1].split()[0]) > 300
    for option, why in (
        ("--false-alarm-interval", "--alarm-delay counts the snapshots of a folder"),
        ("--rpm-column", "belongs to csv lines"),
    ):
        code, _, err = run("watch", model, folder, option, 9)
        assert code == 2 and f"{option}: " in err and why in err


def test_files_that_arrive_while_it_is_down_are_diagnosed_whatever_their_times(
    watched, folder, tmp_path
):
    """One file is dated into the future, and later ones into the past."""
    state = tmp_path / "state.json"
    drop(folder, "a.npy", good(3), 1.6e9)
    drop(folder, "b.npy", good(3), 1.7e9)
    drop(folder, "future.npy", changed(4), 4e9)
    assert len(watched("--state", state)[0]) == 3
    (folder / "a.npy").unlink()
    drop(folder, "older.npy", good(5), 1.5e9)
    drop(folder, "now.npy", good(6))
    found, _ = watched("--state", state)
    assert [line["source"] for line in found] == ["older.npy", "now.npy"]
    # The alarm continues, too.
    assert [line["alarm"] for line in found] == [True, True]
    # Names of files that are gone are forgotten.
    names = load_monitor_state(state)[1]["names"]
    assert names == sorted(path.name for path in folder.iterdir())


@pytest.fixture
def follower(model, folder):
    """Follower of the folder."""
    options = SensorOptions(model, str(folder), sampling_rate=RATE, settle=0.05)
    return folders.FolderFollower(options, SavedModel(model), lambda text: None)


def test_looks_at_a_large_folder_take_little_time(follower, folder, monkeypatch):
    clock = SimpleNamespace(now=0.0, monotonic=lambda: clock.now)
    monkeypatch.setattr(folders, "time", clock)
    listed = []
    listdir = os.listdir

    def slow(path):
        listed.append(clock.now)
        clock.now += 0.1
        return listdir(path)

    monkeypatch.setattr(os, "listdir", slow)
    for _ in range(1000):
        follower.step()
        clock.now += 0.01
    assert 4 <= len(listed) <= 7


def test_a_file_that_may_still_grow_waits(follower, folder, capsys):
    np.save(folder / "a.npy", good(3))
    whole = (folder / "a.npy").read_bytes()
    (folder / "a.npy").write_bytes(whole[:-30])
    drop(folder, "b.npy", good(4))
    assert follower.step() is None
    time.sleep(0.03)
    (folder / "a.npy").write_bytes(whole)
    end = time.monotonic() + 10
    found = []
    while len(found) < 2 and time.monotonic() < end:
        found += follower.step() or []
    # The file that is finished does not wait for the other.
    assert [fields["source"] for fields in found] == ["b.npy", "a.npy"]
    assert "skipped" not in capsys.readouterr().err


def test_a_command_does_not_end_while_a_file_waits(run, model, folder):
    drop(folder, "a.npy", good(3))
    options = ["--sampling-rate", RATE, "--idle", 0.01, "--settle", 0.2]
    code, out, _ = run("watch", model, folder, *options)
    assert code == 0 and '"a.npy"' in out


def test_files_that_cannot_be_diagnosed_are_skipped(watched, folder):
    signal = sound("good", 450, 3)
    wavfile.write(folder / "a.wav", 1001, signal.astype(np.float32))
    wavfile.write(folder / "b.wav", 1100, signal.astype(np.float32))
    two = np.stack([signal, signal], axis=1)
    wavfile.write(folder / "c.wav", 1000, two.astype(np.float32))
    (folder / "d.npy").write_bytes(b"no array")
    drop(folder, "short.npy", signal[:150])
    (folder / ".hidden.npy").write_bytes(b"")
    found, err = watched()
    assert [v["source"] for v in found] == ["a.wav"]
    assert "b.wav: sampling_rate is 1000 Hz but the file states 1100 Hz" in err
    assert "c.wav: several channels and none chosen" in err
    assert "d.npy: " in err
    assert "short.npy: recording has 150 samples, fewer than window_length=200" in err
    assert "last: good; alarm: off" in err


@pytest.mark.skipif(sys.platform == "win32", reason="names that the system lacks")
def test_odd_entries_of_a_folder(watched, folder):
    np.save(folder / "a:b\n.npy", good(3))
    (folder / "c\n.npy").write_bytes(b"junk")
    (folder / "loop.npy").symlink_to("loop.npy")
    (folder / "folder.npy").mkdir()
    os.mkfifo(folder / "pipe.npy")
    found, err = watched()
    assert [v["source"] for v in found] == ["a:b\\n.npy"]
    assert "c\\n.npy: holds pickled objects" in err and err.count("skipped") == 1


def test_a_file_that_states_a_date(run, model, folder):
    """It counts more than the time at which the file was copied."""
    start = pd.Timestamp("2026-11-22T07:00:00Z")
    times = start + pd.to_timedelta(np.arange(1000) / RATE, unit="s")
    table = pd.DataFrame({"time": times, "acc": good(3)[:1000]})
    table.to_parquet(folder / "a.parquet")
    line = json.loads(run("watch", model, folder, *IDLE, "--channel", "acc")[1])
    assert line["time"] == "2026-11-22T07:00:00.000+00:00"
    assert line["seconds"] == start.timestamp()
