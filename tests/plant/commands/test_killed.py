"""Writers that are killed: no half of a file has its name, and the same command goes on."""

import os
import signal
import sys
from functools import partial

import pytest

from skarxlag import (
    ConditionMonitor,
    load_diagnoser,
    load_monitor_state,
    save_monitor_state,
)
from skarxlag.persistence.models import save_diagnoser
from tests.plant.watch.watching import RATE, WINDOW, sound

resource = pytest.importorskip("resource")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("ignore:rpm is not given"),
    # Newer versions of Python warn of a fork beside threads.
    pytest.mark.filterwarnings(
        "ignore:This process .* is multi-threaded:DeprecationWarning"
    ),
]
EVENTS = ("open", "os.rename", "os.remove", "os.chmod")


def killed(work, folder, n_events=None, n_bytes=None, name=""):
    """Call `work` in a child that is killed: before an event in a folder, or within a write.

    The write is that of a file whose name holds `name`. Returns whether it was killed.
    """
    child = os.fork()
    if child == 0:
        seen = [0]

        def watch(event, arguments):
            if event in EVENTS and str(folder) in str(arguments[0]):
                seen[0] += 1
                if seen[0] == n_events:
                    os.kill(os.getpid(), signal.SIGKILL)
                if (
                    n_bytes is not None
                    and event == "open"
                    and name in str(arguments[0])
                ):
                    # The kernel writes as many bytes and ends the process.
                    resource.setrlimit(resource.RLIMIT_FSIZE, (n_bytes, n_bytes))

        silent = os.open(os.devnull, os.O_RDWR)
        os.dup2(silent, 1)
        os.dup2(silent, 2)
        sys.addaudithook(watch)
        # Python ignores this signal, and raises an error instead.
        signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        try:
            work()
        finally:
            os._exit(0)
    return os.WIFSIGNALED(os.waitpid(child, 0)[1])


def each_death(work, folder, size):
    """Kill the work at every event, then within writes, and yield how often it was killed."""
    n_events, deaths = 1, 0
    while killed(work, folder, n_events=n_events):
        yield f"before event {n_events}"
        n_events, deaths = n_events + 1, deaths + 1
    for name, n_bytes in [("", 0), (".tmp", size // 2)]:
        assert killed(work, folder, n_bytes=n_bytes, name=name)
        yield f"after {n_bytes} bytes of {name}"
    assert deaths >= 2


@pytest.mark.parametrize("is_there", [True, False])
def test_models_and_states_are_whole_or_not_there(tmp_path, fitted, is_there):
    monitor = ConditionMonitor(fitted[0], RATE, window_length=WINDOW)
    monitor.update(sound("good", 5 * WINDOW, 3))
    for path, write, read in [
        (
            tmp_path / "m.skops",
            lambda to: save_diagnoser(fitted[0], to),
            load_diagnoser,
        ),
        (
            tmp_path / "s.json",
            lambda to: save_monitor_state(monitor, to),
            load_monitor_state,
        ),
    ]:
        write(path)
        new, size = path.read_bytes(), path.stat().st_size
        for death in each_death(partial(write, path), tmp_path, size):
            if path.exists() and path.read_bytes() != b"old":
                # A model states the time at which it was saved.
                read(path)
                assert len(path.read_bytes()) >= 0.9 * len(new), death
            path.unlink(missing_ok=True)
            if is_there:
                path.write_bytes(b"old")
        write(path)
        read(path)
