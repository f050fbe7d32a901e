"""Read files in another process, so that a crash, a hang or a lack of memory costs one file.

Compiled parsers of complicated formats can crash on a damaged file and take the whole
run with them: two damaged .mat files of the tests end SciPy 1.17.1 with a segmentation
fault. Therefore they run in a child process, which reads one file after another and
sends the samples through a pipe. A process that dies or does not reply is replaced. The
first one starts with the first such file, which takes some tenths of a second.

The child is no sandbox. It has the rights of its parent, which therefore trusts its
replies.
"""

import atexit
import json
import os
import pickle
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

#: Seconds that a reply may take, and bytes of the file that allow one more. On a busy
#: machine, a good file takes ten times as long as on an idle one.
_PATIENCE = 200.0
_BYTES_PER_SECOND = 1e6
#: Bytes that a process may take, and more for each byte of its file.
_MEMORY = 2**32
_MEMORY_PER_BYTE = 200

_PROGRAM = "from skarxlag.plant.readers.formats.isolation import serve; serve()"
_PATHS = "import json, sys; sys.path[:] = json.loads(sys.argv[1]); "

#: One idle reader for each process that has started one: a fork must not use that of
#: its parent.
_idle: dict[int, subprocess.Popen[bytes]] = {}


def isolated(
    function: Callable[..., Iterable[Any]], path: Path, *arguments: Any
) -> Iterator[Any]:
    """Yield what a function yields for a file, computed by another process.

    Parameters
    ----------
    function : callable
        Called as ``function(path, *arguments)``. It must be importable, and reports all
        that is wrong with the file as an exception that can be sent.
    path : Path
        The file.
    *arguments
        Can be sent to another process, as must be what the function yields.

    Raises
    ------
    Exception
        As raised by the function; and ValueError if the process crashes, or takes too
        long. The message begins with the path.
    """
    process = _idle.pop(os.getpid(), None)
    if process is None or process.poll() is not None:
        process = _started()
    patience = _PATIENCE + path.stat().st_size / _BYTES_PER_SECOND
    is_free = False
    try:
        # A process that takes no request sends no reply either.
        with suppress(OSError):
            request = (os.getcwd(), function, path, *arguments)
            pickle.dump(request, process.stdin)
            process.stdin.flush()
        while (reply := _received(process, path, patience)) is not None:
            if isinstance(reply, Exception):
                is_free = True
                raise reply
            yield reply
        is_free = True
    finally:
        if not is_free or _idle.setdefault(os.getpid(), process) is not process:
            _end(process)


def _started():
    command = [sys.executable, "-P", "-c", _PATHS + _PROGRAM, json.dumps(sys.path)]
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    options = {
        "stdin": subprocess.PIPE,
        "stdout": subprocess.PIPE,
        "stderr": subprocess.DEVNULL,
    }
    if sys.platform == "win32":
        options["creationflags"] = subprocess.CREATE_NO_WINDOW
    return subprocess.Popen(command, env=environment, **options)


def _received(process, path, patience):
    timer = threading.Timer(patience, process.kill)
    timer.daemon = True
    timer.start()
    try:
        return pickle.load(process.stdout)
    except (EOFError, pickle.UnpicklingError) as error:
        reason = f"crashed (exit status {process.wait()}), damaged?"
        if timer.finished.is_set():
            reason = (
                f"took more than {patience:.0f} s, damaged? Or is the machine busy?"
            )
        raise ValueError(f"{path}: its reader {reason}") from error
    finally:
        timer.cancel()


def _end(process):
    process.kill()
    # It closes the pipes, also one that holds a request that was never sent.
    process.communicate()


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
            folder, function, path, *arguments = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        try:
            # The parent may have changed its folder.
            os.chdir(folder)
            _limit_memory(path)
            for reply in function(path, *arguments):
                send(reply)
            send(None)
        except Exception as error:
            send(error)


def _limit_memory(path):
    """Limit the memory of this process to the needs of a file of this size, on Linux."""
    if sys.platform != "linux":
        return
    import resource

    limit = _MEMORY + _MEMORY_PER_BYTE * path.stat().st_size
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    # Whoever started this process may have limited it to less.
    limit = limit if hard == resource.RLIM_INFINITY else min(limit, hard)
    resource.setrlimit(resource.RLIMIT_AS, (limit, hard))
