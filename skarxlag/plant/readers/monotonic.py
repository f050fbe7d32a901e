"""Columns that only rise or only fall: times and counts, which are no signal."""

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Steps from which the direction is judged, and the share of them that must have the
#: same sign. The others are those of a clock or a counter that starts again. Vibration
#: has as many of both.
_FEWEST_STEPS = 64
_ONE_WAY = 0.99


def refuse_one_way(blocks: Iterable[NDArray[Any]], name: str) -> Iterator[NDArray[Any]]:
    """Yield a signal block by block, and refuse it at its end if it only rises or only falls.

    Parameters
    ----------
    blocks : iterable of ndarray of shape (n_samples,) or (n_channels, n_samples)
        The signal. Of several channels, the first counts.
    name : str
        The channel, for the message.

    Raises
    ------
    ValueError
        After the last block, if nearly all steps have the same direction.

    Examples
    --------
    >>> blocks = np.split(np.arange(1000) % 250 / 20_000, 4)
    >>> [*refuse_one_way(blocks, "channel 't'")]
    Traceback (most recent call last):
        ...
    ValueError: channel 't' only rises or only falls: it holds times or a count, and is no
    signal; choose another channel
    """
    n_up = 0
    n_down = 0
    last = np.empty(0)
    for block in blocks:
        signal = block if block.ndim == 1 else block[0]
        for values in (np.append(last, signal[:1]), signal):
            # Differences would take as much memory as the block.
            n_up += int(np.count_nonzero(values[1:] > values[:-1]))
            n_down += int(np.count_nonzero(values[1:] < values[:-1]))
        # Without the copy, one sample would keep the whole block in memory.
        last = signal[-1:].copy()
        yield block
    n_steps = n_up + n_down
    if n_steps >= _FEWEST_STEPS and max(n_up, n_down) > _ONE_WAY * n_steps:
        raise ValueError(
            f"{name} only rises or only falls: it holds times or a count, and is no "
            "signal; choose another channel"
        )
