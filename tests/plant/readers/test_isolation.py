"""A reader that crashes, hangs or asks for too much memory costs one file."""

import contextlib
import os
import struct
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from skarxlag import list_channels, read_recording
from skarxlag.plant.readers.formats import isolation
from tests.plant.readers.blocks import recording_blocks

Y = np.arange(50.0)
DAMAGED = sorted((Path(__file__).parent / "damaged").iterdir())


@pytest.fixture
def run(tmp_path):
    path = tmp_path / "run.mat"
    savemat(path, {"y": Y})
    return path


class Fatal:
    """Object that cannot be sent: the process ends after a part of the reply."""

    def __reduce__(self):
        os.abort()


def crash_within_a_reply(path):
    yield [0.5] * 50
    yield [bytes(2**20), Fatal()]


@pytest.mark.slow
def test_a_crash_is_reported_and_the_next_file_is_read(run):
    message = r"run.mat: its reader crashed \(exit status .*damaged"
    with pytest.raises(ValueError, match=message):
        list(isolation.isolated(crash_within_a_reply, run))
    np.testing.assert_array_equal(read_recording(run)[0], Y)


@pytest.mark.skipif(sys.platform == "win32", reason="a program that fails at once")
def test_a_reader_that_does_not_start_is_reported(run, monkeypatch):
    isolation.end_readers()
    monkeypatch.setattr(sys, "executable", "/bin/false")
    with pytest.raises(ValueError, match=r"run.mat: its reader crashed \(exit status"):
        read_recording(run)


def endless(path):
    """Compute for ever."""
    while True:
        pass
    yield


@pytest.mark.slow
def test_a_reader_that_computes_for_ever_is_ended(run, monkeypatch):
    monkeypatch.setattr(isolation, "_PATIENCE", 0.5)
    message = (
        r"run.mat: its reader took more than 1 s, damaged\? Or is the machine busy"
    )
    with pytest.raises(ValueError, match=message):
        list(isolation.isolated(endless, run))


@pytest.mark.slow
def test_a_caller_that_takes_its_time_is_no_hang(run, monkeypatch):
    blocks = recording_blocks(run, 20)
    next(blocks)
    monkeypatch.setattr(isolation, "_PATIENCE", 0)
    monkeypatch.setattr(isolation, "_BYTES_PER_SECOND", 1e3)
    assert [len(signal) for signal, _ in blocks] == [20, 10]


def test_one_process_reads_file_after_file(run, monkeypatch):
    read_recording(run)
    reader = isolation._idle[os.getpid()]
    with pytest.raises(ValueError, match="no channel 'z'"):
        read_recording(run, channel="z")
    list_channels(run)
    monkeypatch.chdir(run.parent)
    np.testing.assert_array_equal(read_recording(run.name)[0], Y)
    assert isolation._idle[os.getpid()] is reader


@pytest.mark.slow
def test_a_recording_that_is_not_read_to_its_end(run):
    blocks = recording_blocks(run, 10)
    next(blocks)
    blocks.close()
    assert os.getpid() not in isolation._idle
    np.testing.assert_array_equal(read_recording(run)[0], Y)


@pytest.mark.slow
def test_several_files_at_a_time(tmp_path):
    paths = [tmp_path / f"{i}.mat" for i in range(4)]
    for i, path in enumerate(paths):
        savemat(path, {"y": Y + i})
    with ThreadPoolExecutor(2) as pool:
        signals = list(pool.map(lambda path: read_recording(path)[0], paths))
    np.testing.assert_array_equal(signals, [Y + i for i in range(4)])
    one, other = recording_blocks(paths[0], 30), recording_blocks(paths[1], 30)
    for first, second in zip(one, other, strict=True):
        np.testing.assert_array_equal(first[0] + 1, second[0])
    assert isolation._idle[os.getpid()].poll() is None


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="processes are forked as on POSIX")
def test_a_fork_has_a_reader_of_its_own(run):
    read_recording(run)
    child = os.fork()
    if child == 0:
        os._exit(0 if np.array_equal(read_recording(run)[0], Y) else 1)
    assert os.waitpid(child, 0)[1] == 0
    np.testing.assert_array_equal(read_recording(run)[0], Y)


def element(kind, content):
    return struct.pack("<II", kind, len(content)) + content


def matlab_file(*elements):
    head = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    return head + b"".join(elements)


def test_memory_is_bounded(tmp_path):
    """A struct array of two thousand million elements, in a file of a few hundred bytes."""
    flags = element(6, struct.pack("<II", 2, 0))
    dims = element(5, struct.pack("<ii", 2**16, 2**15))
    name = element(1, b"structed")
    fields = struct.pack("<HHI", 5, 4, 32) + element(1, b"field".ljust(32, b"\0"))
    structs = element(14, flags + dims + name + fields + element(14, flags))
    (tmp_path / "run.mat").write_bytes(matlab_file(structs))
    message = "damaged"
    if os.path.exists("/proc/self/statm"):
        message = "needs more memory than a file of its size may"
    with pytest.raises(ValueError, match=rf"run.mat: .*{message}"):
        read_recording(tmp_path / "run.mat")


@pytest.mark.slow
@pytest.mark.parametrize("path", DAMAGED, ids=lambda path: path.name)
def test_files_that_have_crashed_the_reader_or_never_ended(path, run, monkeypatch):
    """Found by altering some bytes of a good file; with some versions of SciPy they are read."""
    read_recording(run)
    monkeypatch.setattr(isolation, "_PATIENCE", 0.3)
    with contextlib.suppress(ValueError):
        read_recording(path, channel="y")
    monkeypatch.undo()
    np.testing.assert_array_equal(read_recording(run)[0], Y)
