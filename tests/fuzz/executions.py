"""Files, given to the readers that they are for, in a process that may die of them."""

import traceback
import warnings
from multiprocessing import get_context

import numpy as np

from skarxlag import load_diagnoser, read_recording
from skarxlag.plant.readers.formats.isolation import end_readers

#: Seconds that a file may take, and bytes that the process may grow by.
LONGEST = 100.0
MOST_BYTES = 2 * 2**30


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
    fork = get_context("fork")
    receiver, sender = fork.Pipe(duplex=False)
    child = fork.Process(target=_handle_all, args=(paths, sender))
    child.start()
    sender.close()
    n_handled = 0
    problem = None
    while problem is None:
        if not receiver.poll(LONGEST):
            child.kill()
            problem = f"took more than {LONGEST:g} s"
            continue
        try:
            problem = receiver.recv()
        except EOFError:
            break
        n_handled += problem is None
    child.join()
    receiver.close()
    if problem is None and child.exitcode:
        problem = f"it died: status {child.exitcode}"
    return n_handled, problem


def _handle_all(paths, sender):
    """Handle files, and send None for each, or the error of the first that fails."""
    _bound_memory(MOST_BYTES)
    try:
        for path in paths:
            handle(path)
            sender.send(None)
    except BaseException:
        sender.send(traceback.format_exc()[-2000:])
    finally:
        end_readers()


def _bound_memory(n_bytes):
    """Address space is what can be bounded; it is larger than memory by a constant."""
    # Not every system on which the suite is collected has it.
    import resource

    with open("/proc/self/statm") as file:
        mapped = int(file.read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (mapped + n_bytes, mapped + n_bytes))
