"""NumPy archives. The chosen arrays are read whole."""

from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
from numpy.lib import format as npy

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
        members = archive.zip.infolist()
        check_unpacked(path.stat().st_size, sum(member.file_size for member in members))
        arrays = NamedArrays(cache(archive.__getitem__))
        for member in members:
            name = member.filename.removesuffix(".npy")
            with archive.zip.open(member) as array:
                shape, dtype = _shape_and_dtype(array)
            arrays.add(name, shape, dtype)
        yield arrays.contents()


def _shape_and_dtype(file):
    is_first = npy.read_magic(file) == (1, 0)
    read_header = npy.read_array_header_1_0 if is_first else npy.read_array_header_2_0
    shape, _, dtype = read_header(file)
    if dtype.hasobject:
        raise ValueError("holds Python objects")
    return shape, dtype
