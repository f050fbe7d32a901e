"""NumPy archives. The chosen arrays are read whole."""

from contextlib import contextmanager
from functools import cache
from pathlib import Path

import numpy as np

from ._arrays import NamedArrays
from ._contents import Contents, Format, check_unpacked, is_numeric

FORMAT = Format(
    "NumPy archive", (".npz",), in_parts=False, states="the rate, in a number named `fs` or alike"
)

_HEADERS = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}


def contents(path: Path) -> Contents:
    """Return the channels of every numeric array of more than one value, by its name."""
    arrays = NamedArrays()
    with _open(path) as archive:
        for name in archive.files:
            shape, dtype = _shape_and_dtype(archive, name)
            if is_numeric(dtype) and np.prod(shape) == 1:
                arrays.scalars[name] = archive[name].item()
            elif is_numeric(dtype) and np.prod(shape) > 1:
                arrays.add(name, shape)

    @contextmanager
    def opened():
        with _open(path) as archive:
            yield cache(archive.__getitem__)

    return arrays.contents(opened)


@contextmanager
def _open(path):
    # Opened here because NumPy leaves a damaged .npz open.
    with path.open("rb") as file:
        archive = np.load(file, allow_pickle=False)
        if not isinstance(archive, np.lib.npyio.NpzFile):
            raise ValueError("not an archive")
        unpacked = sum(member.file_size for member in archive.zip.infolist())
        check_unpacked(path.stat().st_size, unpacked)
        yield archive


def _shape_and_dtype(archive, name):
    member = name if name in archive.zip.namelist() else f"{name}.npy"
    with archive.zip.open(member) as file:
        read_header = _HEADERS.get(np.lib.format.read_magic(file))
        if read_header is None:
            array = archive[name]
            return array.shape, array.dtype
        shape, _, dtype = read_header(file)
    if dtype.hasobject:
        raise ValueError("holds Python objects")
    return shape, dtype
