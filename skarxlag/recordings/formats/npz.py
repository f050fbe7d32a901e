"""NumPy's archives of arrays, of which those asked for are read whole."""

from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ._contents import (
    Contents,
    array_blocks,
    array_channels,
    array_contents,
    channels_or_refusal,
    is_numeric,
)
from ._limits import check_unpacked

TITLE = "NumPy archive"
SUFFIXES = (".npz",)
LIBRARY = EXTRA = None
ISOLATED = False
IN_PARTS = False
STATES = "the rate, in a number named `fs` or alike"


class _Header:
    """An array of which only the header has been read."""

    def __init__(self, shape: Any) -> None:
        self.shape = shape


def contents(path: Path) -> Contents:
    """Channels of every numeric array of more than one value, by the name of the array."""
    channels, scalars, arrays, refused = {}, {}, {}, {}
    with _open(path) as archive:
        for name in archive.files:
            shape, dtype = _shape_and_dtype(archive, name)
            if not is_numeric(dtype):
                continue
            if np.prod(shape) == 1:
                scalars[name] = archive[name].item()
            elif np.prod(shape) > 1:
                own = channels_or_refusal(name, _Header(shape), refused)
                channels |= own
                arrays |= dict.fromkeys(own, name)
    found = array_contents(channels, scalars, refused)

    def read(names, n_samples):
        with _open(path) as archive:
            loaded = {}
            for array in dict.fromkeys(arrays[name] for name in names):
                loaded |= array_channels(array, archive[array])
        yield from array_blocks(loaded, names, n_samples)

    found.read = read
    return found


@contextmanager
def _open(path):
    # Opened here because NumPy leaves a damaged .npz open.
    with path.open("rb") as file:
        archive = np.load(file, allow_pickle=False)
        if not isinstance(archive, np.lib.npyio.NpzFile):
            raise ValueError("no archive")
        check_unpacked(path, sum(member.file_size for member in archive.zip.infolist()))
        yield archive


def _shape_and_dtype(archive, name):
    member = name if name in archive.zip.namelist() else f"{name}.npy"
    with archive.zip.open(member) as file:
        version = np.lib.format.read_magic(file)
        read_header = {
            (1, 0): np.lib.format.read_array_header_1_0,
            (2, 0): np.lib.format.read_array_header_2_0,
        }.get(version)
        if read_header is None:
            array = archive[name]
            return array.shape, array.dtype
        shape, _, dtype = read_header(file)
    if dtype.hasobject:
        raise ValueError("holds Python objects")
    return shape, dtype
