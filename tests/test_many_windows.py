"""Many windows that are mapped from a file, in memory that does not grow with their number."""

import tracemalloc

import numpy as np
import pytest

from skarxlag import make_alpio, signal_quality

N_SAMPLES = 64
N_IN_A_BLOCK = 5_000
#: All windows take more memory than the tests allow.
N_BLOCKS = 16


@pytest.fixture(scope="module")
def block():
    rng = np.random.default_rng(0)
    windows = rng.normal(size=(N_IN_A_BLOCK, N_SAMPLES)).astype(np.float32)
    windows[::2] = windows[::2].cumsum(axis=1)
    windows[5] = 3.0
    return windows


@pytest.fixture(scope="module")
def mapped(block, tmp_path_factory):
    path = tmp_path_factory.mktemp("many") / "windows.bin"
    np.tile(block, (N_BLOCKS, 1)).tofile(path)
    yield np.memmap(path, np.float32, "r").reshape(-1, N_SAMPLES)
    path.unlink()


def peak_of(call):
    """Result of a call, and the bytes that it had allocated at most."""
    tracemalloc.start()
    try:
        result = call()
        return result, tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["diagnosis", "quality"])
def test_many_windows_take_the_memory_of_a_block(name, block, mapped):
    calls = {"quality": signal_quality}
    if name == "diagnosis":
        calls[name] = make_alpio().fit(block[:100], np.arange(100) % 2).predict
    expected, of_block = peak_of(lambda: calls[name](block))
    result, peak = peak_of(lambda: calls[name](mapped))
    np.testing.assert_array_equal(result, np.tile(expected, N_BLOCKS))
    # Some copies of the result, and as much as some batches take.
    allowed = 3 * result.nbytes + 3 * of_block + 2**22
    assert peak < allowed < mapped.nbytes
