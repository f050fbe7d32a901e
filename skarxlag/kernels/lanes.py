"""Storage of several signals side by side in one block, for vector instructions.

A recursion over time cannot be vectorised, but the same recursion on many signals can.
A block is a flat array that holds `LANES` signals sample by sample: sample k of the
signal in lane l has the index ``k * LANES + l``. A loop over this index can read the
value that it wrote `LANES` places before and still use vector instructions. The
compiler needs three conditions for this: it knows the length of the loop, it knows the
distance `LANES`, and the loop writes each array in one place only. A history is a block
with one additional sample in front, which is the last sample before the block.
"""

from .arrays import Array
from .compiled import inlined

#: Signals in a block. All lanes go through the same instructions, so no result depends
#: on its lane.
LANES = 16
#: Samples in a block: short enough for the states of a network to stay in the fastest
#: memory.
TILE = 16


@inlined
def interleave(
    signals: Array, first: int, channel: int, start: int, block: Array
) -> None:
    """Copy samples of up to `LANES` signals into a block.

    Parameters
    ----------
    signals : ndarray of shape (n_signals, n_channels, n_samples)
        The signals.
    first, channel, start : int
        First signal, channel and first sample.
    block : ndarray of shape (TILE * LANES,)
        The block to write. Positions without a signal or a sample receive the nearest
        one.
    """
    n_signals, _, n_samples = signals.shape
    # Loops of constant lengths. For others, the compiler takes gather instructions,
    # which are slow.
    for k in range(TILE):
        sample = min(start + k, n_samples - 1)
        for lane in range(LANES):
            signal = min(first + lane, n_signals - 1)
            block[k * LANES + lane] = signals[signal, channel, sample]


@inlined
def deinterleave(
    block: Array, signals: Array, first: int, channel: int, start: int
) -> None:
    """Copy the samples of a block back into up to `LANES` signals.

    Parameters
    ----------
    block : ndarray of shape (TILE * LANES,)
        A block that began as a copy of these signals, or of signals in the same
        positions.
    signals : ndarray of shape (n_signals, n_channels, n_samples)
        The signals to write.
    first, channel, start : int
        First signal, channel and place of the block's first sample. If it is negative,
        down to ``1 - TILE``, the signals begin within the block.
    """
    n_signals, _, n_samples = signals.shape
    for k in range(TILE):
        sample = min(max(start + k, 0), n_samples - 1)
        for lane in range(LANES):
            # Where there is no signal, the lane holds the last one, which is written
            # once more.
            signal = min(first + lane, n_signals - 1)
            signals[signal, channel, sample] = block[(sample - start) * LANES + lane]
