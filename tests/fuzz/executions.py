"""One file, given to the reader that it is for, in a process that may die of it."""

import os
import resource
import signal
import time
import traceback
import warnings

import numpy as np

from skarxlag import load_diagnoser, read_recording

#: Seconds that a file may take, and bytes that the process may grow by.
LONGEST, MOST_BYTES = 100.0, 2 * 2**30
_WINDOWS = np.random.default_rng(1).normal(size=(20, 80))
#: Exit status of a child whose file was handled as promised, and of one that broke a promise.
GOOD, BAD = 0, 9


def handle(path):
    """Read a recording, or load a model and ask it.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    str
        "read" or "refused".

    Raises
    ------
    AssertionError
        If it ends otherwise than promised: arrays of finite shape, or an error of one of the
        stated types whose message names the file.
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
    _ask(diagnoser)
    return "read"


def _ask(diagnoser):
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
    """`handle` in a process of its own.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    str or None
        What went wrong; None if nothing did.
    """
    report, write = os.pipe()
    child = os.fork()
    if child == 0:
        status = BAD
        try:
            used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
            _bound_memory(used + MOST_BYTES)
            handle(path)
            status = GOOD
        except BaseException:
            os.write(write, traceback.format_exc()[-2000:].encode())
        finally:
            os._exit(status)
    os.close(write)
    end, status = time.monotonic() + LONGEST, None
    while status is None and time.monotonic() < end:
        done, code = os.waitpid(child, os.WNOHANG)
        status = os.waitstatus_to_exitcode(code) if done else None
        time.sleep(0.002)
    if status is None:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
    with os.fdopen(report) as file:
        text = file.read()
    if status is None:
        return f"took more than {LONGEST:g} s"
    if status == GOOD:
        return None
    return text or f"the process died: status {status}"


def _bound_memory(n_bytes):
    """Address space is what can be bounded; it is larger than memory by a constant."""
    with open("/proc/self/statm") as file:
        mapped = int(file.read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (mapped + n_bytes, mapped + n_bytes))
