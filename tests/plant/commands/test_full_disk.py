"""Writers on a disk that is full: the system itself refuses bytes beyond a limit."""

import os
import signal
import subprocess
import sys
from contextlib import contextmanager

import numpy as np
import pytest

from tests.plant.watch.watching import RATE, WINDOW, sound

resource = pytest.importorskip("resource")
pytestmark = pytest.mark.filterwarnings("ignore:rpm is not given")


@contextmanager
def room_for(n_bytes):
    """Let no file of this process grow beyond a number of bytes."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (int(n_bytes), hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, ignored)


def listing(folder):
    return {
        path.name: path.read_bytes() for path in folder.rglob("*") if path.is_file()
    }


@pytest.mark.parametrize(
    ("suffix", "share"),
    [("csv", 0.001), ("json", 0.5), ("json", 0.999)],
)
def test_results_are_written_whole_or_not_at_all(run, tmp_path, models, suffix, share):
    np.save(tmp_path / "one.npy", sound("worn", 5 * WINDOW, 4))
    output = tmp_path / f"found.{suffix}"
    command = ("diagnose", models[0], tmp_path / "one.npy", "-o", output)
    command += ("--sampling-rate", RATE)
    assert run(*command)[0] == 0
    size = output.stat().st_size
    output.write_bytes(old := output.read_bytes())
    with room_for(share * size):
        code, _, err = run(*command)
    assert code == 1 and "Traceback" not in err
    # The journal is full before the results are.
    assert "File too large" in err or "results cannot be saved there" in err
    assert output.read_bytes() == old
    assert not [name for name in listing(tmp_path) if name.endswith(".tmp")]
    code, out, _ = run(*command)
    assert code == 0 and "worn" in out


#: Compiles a loop while no file can grow, and computes with it.
COMPILES = """
import resource, signal
import numpy as np
from skarxlag.kernels.residual_levels import switching_gain
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, ({room}, resource.RLIM_INFINITY))
print(switching_gain(np.ones((1, 4)), 0.1).shape)
"""


@pytest.mark.slow
def test_machine_code_that_cannot_be_stored_is_used_all_the_same(tmp_path):
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    # Half of a file must not mislead the next process, which has room enough.
    for allowed in (2000, 10**9):
        program = COMPILES.format(room=allowed)
        found = subprocess.run(
            [sys.executable, "-c", program],
            capture_output=True,
            text=True,
            env=environment,
        )
        assert (found.returncode, found.stdout) == (0, "(1, 4)\n"), found.stderr
