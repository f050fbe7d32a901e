"""Files read in another process, in which a crash, a hang or a lack of memory costs one file.

Compiled parsers of complicated formats can crash on a damaged file, and the whole run with them. So
they work in a child process, which reads one file after another, sends the samples through a pipe,
and is replaced if it dies or does not reply. It starts with the first such file, which takes some
tenths of a second.
"""

import atexit
import json
import os
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: A reply may take so many seconds, and one more for so many bytes of the file.
_PATIENCE = 60.0
_BYTES_PER_SECOND = 5e6

_PROGRAM = Path(__file__).with_name("_worker.py")
_START = "import json, runpy, sys; sys.path[:] = json.loads(sys.argv[2]); "
_START += "runpy.run_path(sys.argv[1], run_name='__main__')"
_ERRORS = {error.__name__: error for error in (ValueError, FileNotFoundError, ImportError)}

#: One idle reader for each process that has started one: a fork must not use that of its parent.
_idle: dict[int, "_Reader"] = {}
_lock = threading.Lock()


def isolated_blocks(
    path: Path, channel: str | int | Sequence[str | int] | None, n_samples: int | None
) -> Iterator[tuple[NDArray[Any], float | None]]:
    """Yield blocks of a file like `signal_blocks`, read in another process.

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
    for head, signal in _replies(path, channel=channel, n_samples=n_samples):
        yield signal, head["rate"]


def isolated_description(path: Path) -> list[dict[str, Any]]:
    """Return the result of `describe_channels`, computed by another process."""
    ((head, _),) = _replies(path, n_samples="describe")
    return head["channels"]


def _replies(path, **request):
    with _lock:
        reader = _idle.pop(os.getpid(), None)
    if reader is None or not reader.is_alive():
        reader = _Reader()
    try:
        yield from reader.replies(path, request)
    finally:
        with _lock:
            is_kept = reader.is_free and os.getpid() not in _idle
            if is_kept:
                _idle[os.getpid()] = reader
        if not is_kept:
            reader.end()


class _Reader:
    """A process that reads files, one at a time.

    Attributes
    ----------
    is_free : bool
        Whether it has replied to the last request to the end.
    """

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", _START, str(_PROGRAM), json.dumps(sys.path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
            creationflags=subprocess.CREATE_NO_WINDOW if sys.platform == "win32" else 0,
        )
        self._is_late = self.is_free = False

    def replies(
        self, path: Path, request: dict[str, Any]
    ) -> Iterator[tuple[dict[str, Any], NDArray[Any] | None]]:
        """Yield what the process sends about a file: a head, and the samples that it announces."""
        self.is_free = False
        patience = _PATIENCE + path.stat().st_size / _BYTES_PER_SECOND
        # A process that takes no request sends no reply either.
        with suppress(OSError):
            self._process.stdin.write(json.dumps({"path": str(path), **request}).encode() + b"\n")
            self._process.stdin.flush()
        while True:
            line = self._within(patience, self._process.stdout.readline)
            if not line.endswith(b"\n"):
                raise ValueError(self._crash_message(path))
            head = json.loads(line)
            if "error" in head:
                self.is_free = True
                raise _ERRORS[head["error"]](head["message"])
            if "end" in head:
                self.is_free = True
                return
            samples = np.empty(head["shape"])
            if samples.size:
                n_read = self._within(patience, partial(self._process.stdout.readinto, samples))
                if n_read != samples.nbytes:
                    raise ValueError(self._crash_message(path))
            yield head, samples

    def end(self) -> None:
        self._process.kill()
        self._process.wait()
        # The pipe may hold a line that was never sent.
        with suppress(OSError):
            self._process.stdin.close()
        self._process.stdout.close()

    def is_alive(self) -> bool:
        return self._process.poll() is None

    def _within(self, patience, receive):
        timer = threading.Timer(patience, self._interrupt)
        timer.daemon = True
        timer.start()
        try:
            return receive()
        finally:
            timer.cancel()

    def _interrupt(self):
        self._is_late = True
        self._process.kill()

    def _crash_message(self, path):
        code = self._process.wait()
        if self._is_late:
            return f"{path}: its reader was ended because it gave no answer in time, damaged?"
        return f"{path}: its reader crashed (exit status {code}), damaged?"


@atexit.register
def end_readers() -> None:
    """End the process that waits for a file."""
    reader = _idle.pop(os.getpid(), None)
    if reader is not None:
        reader.end()
