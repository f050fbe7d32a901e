"""Files read in another process, where a crash, a hang or a hunger for memory costs one file.

Compiled parsers of complicated formats can crash on a damaged file, and with them the whole run. So
they work in a child process, which takes one file after another, sends the samples through a pipe,
and is replaced when it dies or does not answer. It is started at the first such file, which takes
some tenths of a second.
"""

import atexit
import json
import os
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Time that a reader has to answer: so much, and a second for so many bytes of the file.
_PATIENCE = 60.0
_BYTES_PER_SECOND = 5e6

_PROGRAM = Path(__file__).with_name("_worker.py")
_ERRORS = {error.__name__: error for error in (ValueError, FileNotFoundError, ImportError)}

#: Readers that wait for a file, by the process that has started them: a fork must not use those
#: of its parent.
_idle: dict[str, Any] = {}
_lock = threading.Lock()


def isolated_blocks(
    path: Path, channel: str | int | Sequence[str | int] | None, n_samples: int | None
) -> Iterator[tuple[NDArray[Any], float | None]]:
    """Blocks of a file as `signal_blocks` yields them, read in another process.

    Parameters
    ----------
    path : Path
        The file.
    channel, n_samples
        As in `signal_blocks`.

    Yields
    ------
    signal : ndarray of float64
        The next samples.
    sampling_rate : float or None
        In Hz, if the file states it.

    Raises
    ------
    FileNotFoundError, ImportError, ValueError
        As without isolation; and ValueError if the reader crashes or takes too long. The message
        begins with the path.
    """
    reader = _take_reader()
    try:
        reader.ask(path, channel=channel, n_samples=n_samples)
        while "end" not in (head := reader.reply(path)):
            signal = np.empty(head["shape"])
            reader.fill(path, signal)
            reader.is_waiting = True
            yield signal, head["rate"]
            reader.say(b"next\n")
            reader.is_waiting = False
        reader.is_free = True
    finally:
        _put_back(reader)


def isolated_description(path: Path) -> list[dict[str, Any]]:
    """What `describe_channels` tells of a file, told by another process."""
    reader = _take_reader()
    try:
        reader.ask(path, n_samples="describe")
        channels = reader.reply(path)["channels"]
        reader.is_free = True
        return channels
    finally:
        _put_back(reader)


class _Reader:
    """A process that reads files, one at a time."""

    is_free: Any
    is_waiting: Any

    def __init__(self) -> None:
        environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
        start = "import json, runpy, sys; sys.path[:] = json.loads(sys.argv[2]); "
        start += "runpy.run_path(sys.argv[1], run_name='__main__')"
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", start, str(_PROGRAM), json.dumps(sys.path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=environment,
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
        self._is_late = False
        self.is_free, self.is_waiting = True, False

    def ask(self, path: Path, **request: Any) -> None:
        self.is_free = False
        self._patience = _PATIENCE + path.stat().st_size / _BYTES_PER_SECOND
        self.say(json.dumps({"path": str(path), **request}).encode() + b"\n")

    def say(self, line: bytes) -> None:
        # What is wrong with a reader that cannot be spoken to is found out by its reply.
        with suppress(OSError):
            self._process.stdin.write(line)
            self._process.stdin.flush()

    def reply(self, path: Path) -> dict[str, Any]:
        """The next line that the reader sends, or the error that it reports."""
        head = json.loads(self._within_time(self._process.stdout.readline) or "{}")
        if "error" in head:
            self.is_free = True
            raise _ERRORS[head["error"]](head["message"])
        if not head:
            raise ValueError(self._obituary(path))
        return head

    def fill(self, path: Path, signal: np.ndarray) -> None:
        """Receive the samples that the last reply has announced."""
        if (
            signal.size
            and self._within_time(
                lambda: self._process.stdout.readinto(memoryview(signal).cast("B"))
            )
            != signal.nbytes
        ):
            raise ValueError(self._obituary(path))

    def end(self) -> None:
        self._process.kill()
        self._process.wait()
        # The pipe may hold a line that was never sent.
        with suppress(OSError):
            self._process.stdin.close()
        self._process.stdout.close()

    def is_alive(self) -> bool:
        return self._process.poll() is None

    def _within_time(self, receive):
        timer = threading.Timer(self._patience, self._interrupt)
        timer.daemon = True
        timer.start()
        try:
            return receive()
        finally:
            timer.cancel()

    def _interrupt(self):
        self._is_late = True
        self._process.kill()

    def _obituary(self, path):
        code = self._process.wait()
        if self._is_late:
            return f"{path}: its reader was ended because it gave no answer in time, damaged?"
        return f"{path}: its reader crashed (exit status {code}), damaged?"


def _take_reader():
    with _lock:
        waiting = _idle.setdefault(os.getpid(), [])
        while waiting:
            reader = waiting.pop()
            if reader.is_alive():
                return reader
            reader.end()
    return _Reader()


def _put_back(reader):
    if reader.is_waiting:
        # The caller wants no more of the file.
        reader.say(b"stop\n")
        reader.is_free, reader.is_waiting = True, False
    with _lock:
        waiting = _idle.setdefault(os.getpid(), [])
        if reader.is_free and not waiting:
            waiting.append(reader)
            return
    reader.end()


@atexit.register
def end_readers() -> None:
    """End the processes that wait for a file."""
    for reader in _idle.pop(os.getpid(), []):
        reader.end()
