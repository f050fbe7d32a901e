"""Folders into which a logger drops recordings, in ``watch``."""

import json
import os
import sys
import threading
import time

import numpy as np
import pandas as pd
import pytest
from scipy.io import wavfile

from skarxlag import load_monitor_state, make_detector, make_windows, save_diagnoser
from skarxlag.plant.commands.diagnosis import diagnose_file
from skarxlag.plant.commands.models import SavedModel
from skarxlag.plant.readers.entries import ListedRecording
from skarxlag.plant.watch import folders
from tests.plant.watch.watching import IDLE, RATE, WINDOW, sound, verdicts_of

pytestmark = pytest.mark.filterwarnings("ignore:rpm is not given:UserWarning")
YEAR = 365.25 * 24 * 3600


@pytest.fixture(scope="module")
def models(fitted, tmp_path_factory):
    """A file of the diagnoser, with healthy limits that take the level, too."""
    path = tmp_path_factory.mktemp("models") / "diagnoser.skops"
    healthy = make_windows(sound("good", 100 * WINDOW, 2), WINDOW)
    facts = {"conditions": ["good", "worn"], "n_channels": 1, "sampling_rate": RATE}
    detector = make_detector(fixed_gain=True).fit(healthy)
    save_diagnoser(fitted[0], path, window_length=WINDOW, detector=detector, **facts)
    return [path]


@pytest.fixture
def folder(tmp_path):
    path = tmp_path / "logger"
    path.mkdir()
    return path


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
    run, models, folder
):
    signals = {"b": good(3), "a": sound("worn", 1050, 4), "c": changed(5)}
    for number, (name, signal) in enumerate(signals.items()):
        drop(folder, f"{name}.npy", signal, 1.6e9 + 600 * number)
    code, out, err = run("watch", models[0], folder, *IDLE)
    found = verdicts_of(out)
    assert code == 0
    assert [line["source"] for line in found] == ["b.npy", "a.npy", "c.npy"]
    model = SavedModel(models[0])
    for line, number in zip(found, range(3), strict=True):
        path = folder / line["source"]
        recording = ListedRecording(None, path.name, path, sampling_rate=RATE)
        verdict = diagnose_file(recording, lambda: model).verdict
        assert line["verdict"] == verdict["verdict"]
        assert line["windows"] == verdict["windows"]
        assert line["p_value"] == pytest.approx(verdict["p-value"])
        assert line["exceeds"] == (verdict["alarm"] == "yes")
        assert line["time"] == 1.6e9 + 600 * number
    assert err.splitlines()[-1].startswith("3 snapshots; 1 alarm; last: c.npy, ")


def test_the_first_snapshot_that_diagnose_would_call_an_alarm_is_one(
    run, models, folder
):
    for number, signal in enumerate([good(3), changed(4), good(5), good(6)]):
        drop(folder, f"{number}.npy", signal, 1.6e9 + number)
    lines = verdicts_of(run("watch", models[0], folder, *IDLE)[1])
    assert [line["exceeds"] for line in lines] == [False, True, False, False]
    assert [line["alarm"] for line in lines] == [False, True, True, True]
    verdicts = [line["verdict"] for line in lines]
    assert verdicts == ["good", "changed", "possibly changed", "possibly changed"]
    # A longer delay waits, and does not say healthy meanwhile.
    lines = verdicts_of(run("watch", models[0], folder, *IDLE, "--alarm-delay", 2)[1])
    assert [line["alarm"] for line in lines] == [False] * 4
    assert lines[1]["verdict"] == "changed"
    assert lines[1]["alarm_state"] == "not yet an alarm"


def test_delay_and_false_alarms_are_printed_at_the_start(run, models, folder):
    err = run("watch", models[0], folder, *IDLE)[2]
    start = "Alarm: at the first snapshot that exceeds the healthy limits."
    # Nothing is known of the time between snapshots.
    assert f"{start} Expected false alarms: at most one in 100 snapshots." in err
    for number in range(4):
        drop(folder, f"{number}.npy", good(number), 1.6e9 + 600 * number)
    err = run("watch", models[0], folder, *IDLE)[2]
    a_year = YEAR / 600 / 100
    assert (
        f"at most {a_year / 8766:.2g} an hour and {a_year:.2g} a year, with a snapshot "
        "every 600 s." in err
    )
    err = run("watch", models[0], folder, *IDLE, "--alarm-delay", 3)[2]
    assert "Alarm: at the last of 3 snapshots in a row that exceed" in err
    assert float(err.split(" an hour")[0].split()[-1]) < a_year / 8766
    code, _, err = run("watch", models[0], folder, "--false-alarm-interval", 9)
    assert code == 2 and "--alarm-delay counts the snapshots of a folder" in err


def test_files_that_arrive_while_it_is_down_are_diagnosed_whatever_their_times(
    run, models, folder, tmp_path
):
    """One file is dated into the future, and later ones into the past."""
    options = (*IDLE, "--state", tmp_path / "state.json")
    drop(folder, "a.npy", good(3), 1.6e9)
    drop(folder, "future.npy", changed(4), 4e9)
    assert len(verdicts_of(run("watch", models[0], folder, *options)[1])) == 2
    drop(folder, "older.npy", good(5), 1.5e9)
    drop(folder, "now.npy", good(6))
    code, out, _ = run("watch", models[0], folder, *options)
    found = verdicts_of(out)
    assert code == 0
    assert [line["source"] for line in found] == ["older.npy", "now.npy"]
    # The alarm continues, too.
    assert [line["alarm"] for line in found] == [True, True]
    names = load_monitor_state(tmp_path / "state.json")[1]["names"]
    assert names == sorted(path.name for path in folder.iterdir())


def test_names_of_files_that_are_gone_are_bounded(
    run, models, folder, tmp_path, monkeypatch
):
    monkeypatch.setattr(folders, "_MOST_NAMES", 3)
    state = tmp_path / "state.json"
    options = (*IDLE, "--state", state)
    for number in range(4):
        drop(folder, f"{number}.npy", good(number))
    run("watch", models[0], folder, *options)
    (folder / "0.npy").unlink()
    drop(folder, "5.npy", good(5))
    assert len(verdicts_of(run("watch", models[0], folder, *options)[1])) == 1
    names = load_monitor_state(state)[1]["names"]
    assert names == ["1.npy", "2.npy", "3.npy", "5.npy"]


@pytest.fixture
def follower(models, folder):
    """Follower of the folder, the sources of its lines, and what it says."""
    sources, said = [], []
    names = ("channel", "dtype", "sampling_rate", "pulses_per_revolution", "latch")
    names += ("alarm_delay", "false_alarm_interval", "time_column", "rpm_column")
    args = dict.fromkeys(names) | {"rpm": {}, "settle": 1e-6, "retry": 60.0}
    args = type("Arguments", (), args | {"source": str(folder), "latch": False})
    model = SavedModel(models[0])
    return (
        folders.FolderFollower(
            args, model, said.append, lambda fields: sources.append(fields["source"])
        ),
        sources,
        said,
    )


def test_an_idle_folder_is_not_listed_again_and_again(follower, folder, monkeypatch):
    one, sources, _ = follower
    drop(folder, "a.npy", good(3))
    os.utime(folder, (1e9, 1e9))
    while not one.step():
        pass
    one.step()
    calls = []
    listdir = os.listdir
    monkeypatch.setattr(os, "listdir", lambda path: calls.append(path) or listdir(path))
    monkeypatch.setattr(folders, "_file_state", calls.append)
    assert not any(one.step() for _ in range(100))
    assert calls == []
    monkeypatch.undo()
    # A new file changes the time of the folder.
    drop(folder, "b.npy", good(4))
    for _ in range(3):
        one.step()
    assert sources == ["a.npy", "b.npy"]


def test_a_file_that_may_still_grow_waits(follower, folder):
    one, sources, said = follower
    one._args.settle = 0.05
    np.save(folder / "a.npy", good(3))
    whole = (folder / "a.npy").read_bytes()
    (folder / "a.npy").write_bytes(whole[:-30])
    drop(folder, "b.npy", good(4))
    assert not one.step()
    time.sleep(0.03)
    (folder / "a.npy").write_bytes(whole)
    end = time.monotonic() + 10
    while len(sources) < 2 and time.monotonic() < end:
        one.step()
    # The file that is finished does not wait for the other.
    assert sources == ["b.npy", "a.npy"]
    assert not any("skipped" in text for text in said)


def test_files_that_cannot_be_diagnosed_are_skipped(run, models, folder):
    signal = sound("good", 450, 3)
    wavfile.write(folder / "a.wav", 1001, signal.astype(np.float32))
    wavfile.write(folder / "b.wav", 1100, signal.astype(np.float32))
    two = np.stack([signal, signal], axis=1)
    wavfile.write(folder / "c.wav", 1000, two.astype(np.float32))
    (folder / "d.npy").write_bytes(b"no array")
    drop(folder, "short.npy", signal[:150])
    (folder / ".hidden.npy").write_bytes(b"")
    code, out, err = run("watch", models[0], folder, *IDLE)
    assert code == 0 and [v["source"] for v in verdicts_of(out)] == ["a.wav"]
    assert "b.wav: sampling_rate is 1000 Hz but the file states 1100 Hz" in err
    assert "c.wav: several channels and none chosen" in err
    assert "d.npy: " in err
    assert "short.npy: recording has 150 samples, fewer than window_length=200" in err
    assert "1 snapshot; skipped: 4; 0 alarms; last: a.wav, good" in err


@pytest.mark.skipif(sys.platform == "win32", reason="names that the system lacks")
def test_odd_entries_of_a_folder(run, models, folder):
    np.save(folder / "a:b\n.npy", good(3))
    (folder / "c\n.npy").write_bytes(b"junk")
    (folder / "loop.npy").symlink_to("loop.npy")
    (folder / "folder.npy").mkdir()
    os.mkfifo(folder / "pipe.npy")
    code, out, err = run("watch", models[0], folder, *IDLE)
    assert code == 0 and [v["source"] for v in verdicts_of(out)] == ["a:b\\n.npy"]
    assert "c\\n.npy: holds pickled objects" in err and "skipped: 1" in err


def test_a_folder_that_vanishes_ends_the_command(run, models, folder):
    threading.Timer(0.05, folder.rmdir).start()
    code, _, err = run("watch", models[0], folder, "--poll", 0.01)
    assert code == 1 and str(folder) in err and "Traceback" not in err


def test_a_file_that_states_a_date(run, models, folder):
    """It counts more than the time at which the file was copied."""
    start = pd.Timestamp("2026-11-22T07:00:00Z")
    times = start + pd.to_timedelta(np.arange(1000) / RATE, unit="s")
    table = pd.DataFrame({"time": times, "acc": good(3)[:1000]})
    table.to_parquet(folder / "a.parquet")
    out = run("watch", models[0], folder, *IDLE, "--channel", "acc")[1]
    line = json.loads(out)
    assert line["time"] == "2026-11-22T07:00:00.000+00:00"
    assert line["seconds"] == start.timestamp()


def test_speeds_in_columns_are_those_of_a_pipe(run, models, folder):
    for option in ("--rpm-column", "--time-column"):
        code, _, err = run("watch", models[0], folder, option, "n")
        assert code == 2 and f"{option}: belongs to csv lines" in err
