"""The journal of `diagnose`: what it keeps, what it refuses, and who may read it."""

import os
import sqlite3
import stat
import sys
import time
from contextlib import closing
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from skarxlag.plant.commands.diagnosis import Diagnosis, file_state
from skarxlag.plant.commands.journal import Journal
from skarxlag.plant.commands.messages import CommandError
from skarxlag.plant.readers.listing import ListedRecording
from tests.plant.watch.watching import WINDOW, sound

WINDOWS = pd.DataFrame({"verdict": ["good", "worn"], "probability": [0.5, 0.7]})
VERDICT = {"verdict": "good", "probability": 0.7, "alarm": "no", "windows": 2}


@pytest.fixture
def recording(tmp_path):
    path = tmp_path / "a.npy"
    path.write_bytes(b"samples")
    return ListedRecording(None, "a", path, channel=["x", "y"], rpm=600.0)


@pytest.fixture
def journal(tmp_path):
    return Journal(tmp_path / "out.csv", ["model", "0.1"])


def interrupted(journal, *recordings):
    """Add the result of each recording and stop as Ctrl-C does."""
    with pytest.raises(KeyboardInterrupt), journal:
        for each in recordings:
            file = file_state(each)
            journal.add(each, Diagnosis(VERDICT, WINDOWS, ["short"], file=file))
        raise KeyboardInterrupt


def result(journal, recording):
    """The result that the next run finds, which is interrupted, too."""
    with pytest.raises(KeyboardInterrupt), journal:
        found = journal.result(recording)
        raise KeyboardInterrupt
    return found


def test_an_interrupted_run_leaves_its_results(journal, recording, capsys):
    interrupted(journal, recording)
    assert journal.path.name == "out.csv.skarxlag-journal"
    err = capsys.readouterr().err
    assert err.startswith(f"{journal.path}: The results so far are saved.")
    found = result(journal, recording)
    assert (found.verdict, found.remarks) == (VERDICT, ["short"])
    pd.testing.assert_frame_equal(found.windows, WINDOWS)


def test_a_finished_run_leaves_nothing(journal, recording, capsys):
    interrupted(journal, recording)
    capsys.readouterr()
    with journal:
        assert journal.result(recording).verdict == VERDICT
    assert not journal.path.exists() and not capsys.readouterr().err


@pytest.mark.skipif(os.name == "nt", reason="Windows has other permissions")
def test_nobody_else_may_read_a_journal(journal, recording):
    before = os.umask(0)
    try:
        interrupted(journal, recording)
    finally:
        os.umask(before)
    assert stat.S_IMODE(journal.path.stat().st_mode) == 0o600


def test_a_recording_that_failed_is_not_kept(journal, recording, capsys):
    with pytest.raises(KeyboardInterrupt), journal:
        journal.add(recording, Diagnosis.failed(recording, "damaged"))
        raise KeyboardInterrupt
    assert not journal.path.exists() and not capsys.readouterr().err


def test_a_result_of_another_input_is_not_used(tmp_path, journal, recording):
    interrupted(journal, recording)
    changes = [{"rpm": 300.0}, {"rpm": None}, {"channel": "x"}, {"sampling_rate": 1.0}]
    changes += [{"dtype": "<i2"}, {"name": "b"}]
    with pytest.raises(KeyboardInterrupt), journal:
        assert journal.result(recording).verdict == VERDICT
        for change in changes:
            assert journal.result(replace(recording, **change)) is None
        raise KeyboardInterrupt
    assert result(Journal(tmp_path / "out.csv", ["other", "0.1"]), recording) is None


@pytest.mark.skipif(os.name == "nt", reason="Windows keeps no time of the entry")
def test_a_file_that_changed_is_diagnosed_once_more(journal, recording):
    interrupted(journal, recording)
    status = recording.path.stat()
    times = status.st_atime_ns, status.st_mtime_ns
    time.sleep(0.02)  # more than a tick of the clock of files
    for content, later in ((b"SAMPLES", 0), (b"samples", 1_000_000)):
        recording.path.write_bytes(content)
        os.utime(recording.path, ns=(times[0], times[1] + later))
        assert result(journal, recording) is None
    recording.path.unlink()
    assert result(journal, recording) is None


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
@pytest.mark.filterwarnings("ignore:This process .* is multi-threaded")
def test_results_of_a_killed_process_are_kept(journal, recording):
    child = os.fork()
    if child == 0:
        with journal:
            file = file_state(recording)
            journal.add(recording, Diagnosis(VERDICT, WINDOWS, [], file=file))
            os._exit(9)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 9
    assert result(journal, recording).verdict == VERDICT


def test_two_runs_do_not_share_a_journal(tmp_path, journal):
    with journal:
        other = Journal(tmp_path / "out.csv", ["model", "0.1"])
        with (
            pytest.raises(CommandError, match="another run is writing these results"),
            other,
        ):
            pass
        assert journal.path.exists()
    with other:
        pass


@pytest.mark.parametrize("content", [b"notes\n", b"x" * 5000, None])
def test_a_file_that_is_no_journal_is_kept(journal, content):
    if content is None:
        with closing(sqlite3.connect(journal.path)) as foreign:
            foreign.execute("CREATE TABLE notes (note TEXT)")
        content = journal.path.read_bytes()
    journal.path.write_bytes(content)
    with (
        pytest.raises(CommandError, match="exists and is no journal of this command"),
        journal,
    ):
        pass
    assert journal.path.read_bytes() == content


@pytest.mark.skipif(os.name == "nt", reason="links need rights on Windows")
def test_a_link_is_not_followed(tmp_path, journal):
    for target in ("precious.txt", "not-there.txt"):
        journal.path.symlink_to(tmp_path / target)
        with pytest.raises(CommandError, match="is no journal"), journal:
            pass
        assert journal.path.is_symlink() and not (tmp_path / target).exists()
        journal.path.unlink()
    journal.path.mkdir()
    with pytest.raises(CommandError, match="is no journal"), journal:
        pass


@pytest.mark.filterwarnings("ignore:rpm is not given:UserWarning")
def test_a_missing_library_leaves_no_journal(run, models, tmp_path, monkeypatch):
    np.save(tmp_path / "a.npy", sound("good", 2 * WINDOW, 3))
    for name in ("pyarrow", "fastparquet"):
        monkeypatch.setitem(sys.modules, name, None)
    command = ("diagnose", models[0], tmp_path / "a.npy")
    code, out, err = run(*command, "-o", tmp_path / "out.parquet")
    assert code == 1 and not out and "skarxlag diagnose: error" in err
    assert "Run the same command again" not in err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.npy"]
