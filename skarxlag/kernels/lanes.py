"""Storage of several signals side by side in one block, for vector instructions.

A recursion over time cannot be vectorised, but the same recursion on many signals can. A block is a
flat array that holds `LANES` signals sample by sample: sample k of the signal in lane l has the
index ``k * LANES + l``. A loop over this index can read the value that it wrote `LANES` places
before and still use vector instructions. The compiler needs three conditions for this: it knows the
length of the loop, it knows the distance `LANES`, and the loop writes each array in one place
only. A history is a block with one additional sample in front, which is the last sample before the
block.
"""

from typing import Any

from numpy.typing import NDArray

from .compiled import inlined

#: Signals in a block. All lanes go through the same instructions, so no result depends on its lane.
LANES = 16
#: Samples in a block: short enough for the states of a network to stay in the fastest memory.
TILE = 16


@inlined
def interleave(
    signals: NDArray[Any], first: int, channel: int, start: int, block: NDArray[Any]
) -> None:
    """Copy samples of up to `LANES` signals into a block.

    Parameters
    ----------
    signals : ndarray of shape (n_signals, n_channels, n_samples)
        The signals. Lanes after the last signal stay unused.
    first, channel, start : int
        First signal, channel and first sample.
    block : ndarray of shape (TILE * LANES,)
        The block to write. Positions without a signal or a sample are not changed.
    """
    for lane in range(min(LANES, signals.shape[0] - first)):
        for k in range(min(TILE, signals.shape[2] - start)):
            block[k * LANES + lane] = signals[first + lane, channel, start + k]


@inlined
def deinterleave(
    block: NDArray[Any], dropped: int, signals: NDArray[Any], first: int, channel: int, start: int
) -> None:
    """Copy the samples of a block back into up to `LANES` signals.

    Parameters
    ----------
    block : ndarray of shape (n_samples * LANES,)
        A block or a history.
    dropped : int
        Number of samples at the beginning of the block that are skipped.
    signals : ndarray of shape (n_signals, n_channels, n_samples)
        The signals to write.
    first, channel, start : int
        First signal, channel and first sample.
    """
    for lane in range(min(LANES, signals.shape[0] - first)):
        for k in range(min(len(block) // LANES - dropped, signals.shape[2] - start)):
            signals[first + lane, channel, start + k] = block[(dropped + k) * LANES + lane]


@inlined
def carry(history: NDArray[Any], n_samples: int) -> None:
    """Copy one sample of a history to its beginning, as the state before the next block.

    Parameters
    ----------
    history : ndarray of shape ((TILE + 1) * LANES,)
        The history. Its first sample is overwritten.
    n_samples : int
        Index of the sample that is copied.
    """
    for lane in range(LANES):
        history[lane] = history[n_samples * LANES + lane]
