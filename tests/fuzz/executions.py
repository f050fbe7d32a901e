"""Files, given to the readers that they are for, in a process that may die of them."""

import os
import select
import signal
import traceback
import warnings

import numpy as np

from skarxlag import load_diagnoser, read_recording
from skarxlag.recordings.formats._isolation import end_readers

#: Seconds that a file may take, and bytes that the process may grow by.
LONGEST = 100.0
MOST_BYTES = 2 * 2**30
#: Exit status of a child whose file was handled as promised, and of one that broke a
#: promise.
GOOD = 0
BAD = 9
#: What a child writes for each file that was handled as promised.
_HANDLED = b"\0"


def handle(path):
    """Read a recording, or load a model and use it, and return "read" or "refused".

    Any other end than promised is an AssertionError: arrays of finite shape, or an
    error of one of the stated types whose message names the file.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            if path.suffix != ".skops":
                signal, _ = read_recording(path, channel=0)
                assert signal.ndim in (1, 2) and signal.dtype == np.float64
                return "read"
            diagnoser, _ = load_diagnoser(path)
    except (ValueError, OSError) as error:
        assert path.name in str(error), f"{error!r} does not name the file"
        return "refused"
    _predict(diagnoser)
    return "read"


def _predict(diagnoser):
    shape = tuple(diagnoser[0].window_shape_.tolist())
    if np.prod(shape) > 1e6:
        return
    X = np.random.default_rng(1).normal(size=(20, *shape))
    try:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            verdict = diagnoser.predict(X)
        assert len(verdict) == len(X)
    except ValueError:
        # What is consistent may still be too large or too small for these windows.
        return


def run_apart(path):
    """Handle a file in a process of its own, and return the problem, None without one."""
    _, problem = run_until_failure([path])
    return problem


def run_until_failure(paths):
    """Handle files in one process that may die of any of them.

    Returns the number of files that were handled as promised before one that was not,
    and the problem with that one, None without one.
    """
    report, write = os.pipe()
    child = os.fork()
    if child == 0:
        status = BAD
        try:
            _bound_memory(MOST_BYTES)
            for path in paths:
                handle(path)
                os.write(write, _HANDLED)
            status = GOOD
        except BaseException:
            os.write(write, traceback.format_exc()[-2000:].encode())
        finally:
            end_readers()
            os._exit(status)
    os.close(write)
    output = b""
    is_late = False
    while True:
        ready, _, _ = select.select([report], [], [], LONGEST)
        if not ready:
            os.kill(child, signal.SIGKILL)
            is_late = True
            break
        part = os.read(report, 4096)
        if not part:
            break
        output += part
    os.close(report)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    n_handled = len(output) - len(output.lstrip(_HANDLED))
    if status == GOOD:
        return n_handled, None
    if is_late:
        return n_handled, f"took more than {LONGEST:g} s"
    problem = output[n_handled:].decode(errors="replace")
    return n_handled, problem or f"it died: status {status}"


def _bound_memory(n_bytes):
    """Address space is what can be bounded; it is larger than memory by a constant."""
    # Not every system on which the suite is collected has it.
    import resource

    with open("/proc/self/statm") as file:
        mapped = int(file.read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (mapped + n_bytes, mapped + n_bytes))
