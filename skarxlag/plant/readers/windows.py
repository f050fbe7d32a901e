"""Cut recordings that arrive block by block into windows."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.validation import check_count
from ...core.windows import make_windows

#: Samples of a channel that are processed at a time, if a recording is read in parts.
_BLOCK = 2**20


def block_length(window_length: int) -> int:
    """Return the samples of a channel to read at a time: whole windows, about a million samples.

    Examples
    --------
    >>> from skarxlag.plant.readers.windows import block_length
    >>> block_length(1000), block_length(3_000_000)
    (1048000, 3000000)
    """
    check_count(window_length, "window_length")
    return window_length * max(_BLOCK // window_length, 1)


def cut_blocks(
    blocks: Iterable[Any], name: str, window_length: int, hop: int | None = None
) -> Iterator[NDArray[Any]]:
    """Cut a recording that arrives block by block into windows.

    Parameters
    ----------
    blocks : iterable of arrays of shape (n_samples,) or (n_channels, n_samples)
        Consecutive parts of one recording, of any lengths.
    name : str
        Name for error messages.
    window_length : int
        Samples in a window.
    hop : int, default=None
        As in :func:`make_windows`.

    Yields
    ------
    ndarray of shape (n_windows, window_length) or (n_windows, n_channels,
    window_length)
        The windows that :func:`make_windows` cuts from the whole, some at a time.

    Raises
    ------
    ValueError
        If the recording is shorter than one window.

    Examples
    --------
    >>> from skarxlag.plant.readers.windows import cut_blocks
    >>> parts = (np.arange(3), np.arange(3, 8))
    >>> [windows.tolist() for windows in cut_blocks(parts, "run", 2)]
    [[[0.0, 1.0]], [[2.0, 3.0], [4.0, 5.0], [6.0, 7.0]]]
    """
    hop = window_length if hop is None else hop
    at_a_time = block_length(window_length) // window_length
    rest = None
    n_windows = 0
    n_skipped = 0
    for block in blocks:
        # If the hop reaches beyond the last block, the start of this one is left out.
        signal = block[..., n_skipped:]
        n_skipped = max(n_skipped - block.shape[-1], 0)
        if rest is not None:
            signal = np.concatenate([rest, signal], axis=-1)
        n_fitting = max((signal.shape[-1] - window_length) // hop + 1, 0)
        for first in range(0, n_fitting, at_a_time):
            part = signal[
                ..., first * hop : (first + at_a_time - 1) * hop + window_length
            ]
            yield make_windows(part, window_length, hop=hop)
        n_windows += n_fitting
        n_skipped += max(n_fitting * hop - signal.shape[-1], 0)
        # Without the copy, a few samples would keep the whole block in memory.
        rest = signal[..., n_fitting * hop :].copy()
    if n_windows == 0:
        raise ValueError(
            f"{name}: recording has {rest.shape[-1]} samples, fewer than "
            f"window_length={window_length}; choose a shorter window (--window-length)"
        )


def thin_windows(
    parts: Iterable[Any], max_windows: int
) -> tuple[NDArray[Any], NDArray[Any], int]:
    """Keep some of the windows of one recording, evenly spread over it.

    Every window is kept until there are too many; then every second, every fourth, and
    so on. At least half of `max_windows` remain of a recording that has more.

    Parameters
    ----------
    parts : iterable of ndarray of shape (n_windows, ...)
        Windows in time order, some at a time.
    max_windows : int
        Windows to keep, at most.

    Returns
    -------
    windows : ndarray
        Those kept.
    position : ndarray of int, shape (n_windows,)
        Position of each among all windows.
    n_available : int
        Number of all windows.

    Examples
    --------
    >>> from skarxlag.plant.readers.windows import thin_windows
    >>> windows, position, n_available = thin_windows([np.zeros((7, 3)), np.ones((2, 3))], 5)
    >>> position, n_available
    (array([0, 2, 4, 6, 8]), 9)
    """
    kept = {}
    step = 1
    n_seen = 0
    for window in chain.from_iterable(parts):
        if n_seen % step == 0:
            # Without the copy, one window would keep its part in memory.
            kept[n_seen] = window.copy()
        n_seen += 1
        if len(kept) > max_windows:
            step *= 2
            kept = {place: kept[place] for place in kept if place % step == 0}
    return np.stack([*kept.values()]), np.array([*kept]), n_seen
