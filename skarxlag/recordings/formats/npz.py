"""NumPy's archives of arrays, which are read whole."""

import numpy as np

from ._channels import numeric_channels

SUFFIXES = (".npz",)


def blocks(path, n_samples):
    """One block of every numeric array."""
    # Opened here because NumPy leaves a damaged .npz open.
    with path.open("rb") as file:
        content = np.load(file, allow_pickle=False)
        yield numeric_channels({name: content[name] for name in content.files}), None
