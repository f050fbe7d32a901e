"""NumPy's files of one array, which are mapped and read in parts."""

from pathlib import Path

import numpy as np

from ._contents import Contents, array_channels, slices

TITLE = "NumPy array"
SUFFIXES = (".npy",)
LIBRARY = EXTRA = None
ISOLATED = False
IN_PARTS = True
STATES = "nothing"


def contents(path: Path) -> Contents:
    """Channels ``0``, ``1``, ... of the array."""
    channels = _map(path)
    lengths = {name: len(channel) for name, channel in channels.items()}

    def read(names, n_samples):
        for part in slices(lengths[names[0]], n_samples):
            # Mapped anew for each block: pages of the last one stay in memory as long as its map.
            mapped = _map(path)
            yield [mapped[name][part] for name in names]

    return Contents(list(channels), read, lengths=lengths)


def _map(path):
    return array_channels("", np.atleast_1d(np.load(path, mmap_mode="r", allow_pickle=False)))
