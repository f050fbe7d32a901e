"""Read files in another process, so that a crash, a hang or a lack of memory costs one file.

Compiled parsers of complicated formats can crash on a damaged file and take the whole run with
them. Therefore they run in a child process, which reads one file after another and sends the
samples through a pipe. A process that dies or does not reply is replaced. The first one starts with
the first such file, which takes some tenths of a second.

The child is no sandbox. It has the rights of its parent, which therefore trusts its replies.
"""

import atexit
import json
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

#: Seconds that a reply may take, and bytes of the file that allow one more second.
_PATIENCE = 60.0
_BYTES_PER_SECOND = 5e6
#: Bytes by which a process may grow, and bytes for each byte of its file.
_MEMORY, _MEMORY_PER_BYTE = 2**32, 200

_PROGRAM = "from skarxlag.recordings.formats._isolation import serve; serve()"
_PATHS = "import json, sys; sys.path[:] = json.loads(sys.argv[1]); "

#: One idle reader for each process that has started one: a fork must not use that of its parent.
_idle: dict[int, subprocess.Popen[bytes]] = {}
_lock = threading.Lock()


def isolated(function: Callable[..., Iterable[Any]], path: Path, *arguments: Any) -> Iterator[Any]:
    """Yield what a function yields for a file, computed by another process.

    Parameters
    ----------
    function : callable
        Called as ``function(path, *arguments)``. It must be importable, and reports all that is
        wrong with the file as an exception that can be sent.
    path : Path
        The file.
    *arguments
        Can be sent to another process, as must be what the function yields.

    Raises
    ------
    Exception
        As raised by the function; and ValueError if the process crashes or takes too long. The
        message begins with the path.
    """
    with _lock:
        process = _idle.pop(os.getpid(), None)
    if process is None or process.poll() is not None:
        process = _started()
    patience = _PATIENCE + path.stat().st_size / _BYTES_PER_SECOND
    is_free = False
    try:
        # A process that takes no request sends no reply either.
        with suppress(OSError):
            pickle.dump((function, path, *arguments), process.stdin)
            process.stdin.flush()
        while (reply := _received(process, path, patience)) is not None:
            if isinstance(reply, Exception):
                is_free = True
                raise reply
            yield reply
        is_free = True
    finally:
        with _lock:
            is_kept = is_free and os.getpid() not in _idle
            if is_kept:
                _idle[os.getpid()] = process
        if not is_kept:
            _end(process)


def _started():
    return subprocess.Popen(
        [sys.executable, "-P", "-c", _PATHS + _PROGRAM, json.dumps(sys.path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
        creationflags=subprocess.CREATE_NO_WINDOW if sys.platform == "win32" else 0,
    )


def _received(process, path, patience):
    timer, start = threading.Timer(patience, process.kill), time.monotonic()
    timer.daemon = True
    timer.start()
    try:
        return pickle.load(process.stdout)
    except (EOFError, pickle.UnpicklingError) as error:
        reason = f"crashed (exit status {process.wait()})"
        if time.monotonic() - start >= patience:
            reason = "was ended because it gave no answer in time"
        raise ValueError(f"{path}: its reader {reason}, damaged?") from error
    finally:
        timer.cancel()


def _end(process):
    # The pipe may hold a request that was never sent.
    with suppress(OSError), process:
        process.kill()


@atexit.register
def end_readers() -> None:
    """End the process that waits for a file."""
    process = _idle.pop(os.getpid(), None)
    if process is not None:
        _end(process)


def serve() -> None:
    """Read files in the child process until the parent ends."""
    # The parent handles Ctrl-C and ends this process.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    replies = os.fdopen(os.dup(1), "wb")
    # Text that a library prints must not get between the replies.
    os.dup2(2, 1)

    def send(reply):
        pickle.dump(reply, replies, pickle.HIGHEST_PROTOCOL)
        replies.flush()

    while True:
        try:
            function, path, *arguments = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        try:
            _limit_memory(path)
            for reply in function(path, *arguments):
                send(reply)
            send(None)
        except Exception as error:
            send(error)


def _limit_memory(path):
    """Limit the growth of this process to the needs of a file of this size, if possible."""
    try:
        import resource

        page = os.sysconf("SC_PAGE_SIZE")
        used = int(Path("/proc/self/statm").read_text().split()[0]) * page
        allowed = _MEMORY + _MEMORY_PER_BYTE * path.stat().st_size
        limit = used + min(allowed, os.sysconf("SC_PHYS_PAGES") * page)
        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        if hard != resource.RLIM_INFINITY:
            limit = min(limit, hard)
        resource.setrlimit(resource.RLIMIT_AS, (limit, hard))
    except (ImportError, OSError, ValueError):
        return
