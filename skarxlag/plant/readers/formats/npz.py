"""NumPy archives. They are read whole."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from .arrays import NamedArrays
from .contents import Contents, DamagedError, Format, check_unpacked

FORMAT = Format((".npz",))


def contents(path: Path) -> Iterator[Contents]:
    """Return the channels of every numeric array of more than one value, by its name."""
    # Opened here because NumPy leaves a damaged .npz open.
    with path.open("rb") as file:
        archive = np.load(file, allow_pickle=False)
        if not isinstance(archive, np.lib.npyio.NpzFile):
            raise DamagedError("not an archive")
        n_bytes = sum(member.file_size for member in archive.zip.infolist())
        check_unpacked(path.stat().st_size, n_bytes)
        loaded = dict(archive)
        arrays = NamedArrays(loaded.__getitem__)
        for name, values in loaded.items():
            arrays.add(name, values.shape, values.dtype)
        yield arrays.contents()
