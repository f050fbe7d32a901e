"""NumPy's files of one array, which are mapped and read in parts."""

import numpy as np

from ._channels import slices, split_matrix

SUFFIXES = (".npy",)


def blocks(path, n_samples):
    """Blocks of the array's channels."""

    def read():
        return split_matrix("", np.load(path, mmap_mode="r", allow_pickle=False))

    for part in slices(len(next(iter(read().values()))), n_samples):
        # Mapped anew for each block: pages of the last one stay in memory as long as its map.
        yield {name: values[part] for name, values in read().items()}, None
