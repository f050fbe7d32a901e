"""Several signals side by side in one block, which is what a processor's vectors want.

A recursion over time cannot be vectorised, the same recursion on many signals can. A block is a
flat array that holds `LANES` signals sample by sample: sample k of the signal in lane l stands at
``k * LANES + l``. A loop over the flat index that reads what it wrote `LANES` places before
then runs on whole vectors: its length and that distance are known when it is compiled, and its
arrays are rows of which each is written in one place only. A history is a block with one more
sample in front, the one before the block begins.
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
        The signals; those after the last one are missing.
    first, channel, start : int
        First signal, channel and first sample.
    block : ndarray of shape (TILE * LANES,)
        Written; places of missing signals and samples are left as they are.
    """
    for lane in range(min(LANES, signals.shape[0] - first)):
        for k in range(min(TILE, signals.shape[2] - start)):
            block[k * LANES + lane] = signals[first + lane, channel, start + k]


@inlined
def deinterleave(
    block: NDArray[Any], dropped: int, signals: NDArray[Any], first: int, channel: int, start: int
) -> None:
    """Copy samples of a block to where up to `LANES` signals want them.

    Parameters
    ----------
    block : ndarray of shape (n_samples * LANES,)
        A block or a history.
    dropped : int
        Samples at its beginning that nobody wants.
    signals : ndarray of shape (n_signals, n_channels, n_samples)
        Written.
    first, channel, start : int
        First signal, channel and first sample.
    """
    for lane in range(min(LANES, signals.shape[0] - first)):
        for k in range(min(len(block) // LANES - dropped, signals.shape[2] - start)):
            signals[first + lane, channel, start + k] = block[(dropped + k) * LANES + lane]


@inlined
def carry(history: NDArray[Any], n_samples: int) -> None:
    """Make a sample of a history the one that it begins with.

    Parameters
    ----------
    history : ndarray of shape ((TILE + 1) * LANES,)
        Its first sample is overwritten.
    n_samples : int
        Samples to go on by.
    """
    for lane in range(LANES):
        history[lane] = history[n_samples * LANES + lane]
