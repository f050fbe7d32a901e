"""NumPy files of one array, which are mapped and read in parts."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from .arrays import NamedArrays
from .contents import Contents, Format

FORMAT = Format((".npy",))


def contents(path: Path) -> Iterator[Contents]:
    """Return the channels ``0``, ``1``, ... of the array."""

    def mapped(_):
        # Called for each block: the pages of a block stay in memory as long as its map.
        return np.atleast_1d(np.load(path, mmap_mode="r", allow_pickle=False))

    arrays = NamedArrays(mapped)
    arrays.add("", mapped("").shape)
    yield arrays.contents()
