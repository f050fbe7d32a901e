"""A million windows that are mapped from a file, in memory that does not grow with their number."""

import tracemalloc

import numpy as np
import pytest

from skarxlag import make_alpio, signal_quality

N_SAMPLES, N_IN_A_BLOCK, N_BLOCKS = 32, 10_000, 100


@pytest.fixture(scope="module")
def block():
    rng = np.random.default_rng(0)
    windows = rng.normal(size=(N_IN_A_BLOCK, N_SAMPLES)).astype(np.float32)
    windows[::2] = windows[::2].cumsum(axis=1)
    windows[5] = 3.0
    return windows


@pytest.fixture(scope="module")
def mapped(block, tmp_path_factory):
    path = tmp_path_factory.mktemp("million") / "windows.bin"
    with path.open("wb") as file:
        for _ in range(N_BLOCKS):
            file.write(block.tobytes())
    yield np.memmap(path, np.float32, "r").reshape(-1, N_SAMPLES)
    path.unlink()


def peak_of(call):
    """Result of a call, and the bytes that it had allocated at most."""
    tracemalloc.start()
    try:
        found = call()
        return found, tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.slow
def test_a_million_windows_are_diagnosed_in_constant_memory(block, mapped):
    assert len(mapped) == 10**6
    diagnoser = make_alpio().fit(block[:100], np.arange(100) % 2)
    expected, of_block = peak_of(lambda: diagnoser.predict(block))
    found, peak = peak_of(lambda: diagnoser.predict(mapped))
    np.testing.assert_array_equal(found, np.tile(expected, N_BLOCKS))
    # Two copies of the verdicts, and as much as some batches take.
    assert peak < 2 * found.nbytes + 3 * of_block + 2**22


@pytest.mark.slow
def test_the_quality_of_a_million_windows_is_judged_in_constant_memory(block, mapped):
    expected, of_block = peak_of(lambda: signal_quality(block))
    found, peak = peak_of(lambda: signal_quality(mapped))
    np.testing.assert_array_equal(found, np.tile(expected, N_BLOCKS))
    assert peak < 3 * found.nbytes + 3 * of_block + 2**22
