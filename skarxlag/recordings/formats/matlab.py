"""MATLAB files: up to version 7 by SciPy, whole; version 7.3 as the HDF5 files that they are."""

import struct
import warnings
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from . import hdf5
from ._arrays import NamedArrays
from ._contents import Contents, Format, check_unpacked

# SciPy's compiled parser can crash or hang on a damaged file.
FORMAT = Format((".mat",), isolated=True)

_COMPRESSED = 15
_HDF5 = b"\x89HDF\r\n\x1a\n"


def contents(path: Path) -> Iterator[Contents]:
    """Return the channels of every numeric array of more than one value.

    A channel has the name of its variable. Fields of a struct are ``struct.field``, and
    elements of an array of structs or of a cell array are ``name[0]``, ``name[1]``, ...
    """
    from scipy.io import loadmat

    with path.open("rb") as file:
        head = file.read(520)
    # HDF5 files of early versions of MATLAB do not state version 7.3.
    if (head.startswith(b"MATLAB 7.3") and len(head) >= 512) or head[512:] == _HDF5:
        yield from hdf5.contents(path, is_matlab=True)
        return
    check_unpacked(path.stat().st_size, _unpacked_size(path))
    with warnings.catch_warnings():
        # Function handles and other objects that SciPy cannot read are not channels.
        warnings.simplefilter("ignore")
        variables = loadmat(
            path, appendmat=False, squeeze_me=False, struct_as_record=False
        )
    found = {}
    for variable, content in variables.items():
        if not variable.startswith("__"):
            found |= _arrays(variable, content)
    arrays = NamedArrays(found.__getitem__)
    for name, values in found.items():
        arrays.add(name, values.shape, values.dtype)
    yield arrays.contents()


def _arrays(name, values):
    """Yield the names of the arrays of a variable, and the arrays."""
    from scipy.io.matlab import mat_struct

    if isinstance(values, mat_struct):
        for field in values._fieldnames:
            yield from _arrays(f"{name}.{field}", getattr(values, field))
    elif isinstance(values, np.ndarray) and values.dtype == object:
        for i, element in enumerate(values.ravel()):
            yield from _arrays(name if values.size == 1 else f"{name}[{i}]", element)
    elif isinstance(values, np.ndarray):
        yield name, values


def _unpacked_size(path):
    """Bytes of all packed variables, from their tags, which are unpacked no further."""
    total = 0
    with path.open("rb") as file:
        # Version 4, which is never compressed, has no such mark.
        order = {b"IM": "<", b"MI": ">"}.get(file.read(128)[126:])
        while order and len(tag := file.read(8)) == 8:
            kind, size = struct.unpack(f"{order}II", tag)
            after = file.tell() + size
            if kind == _COMPRESSED:
                inner = zlib.decompressobj().decompress(file.read(min(size, 4096)), 8)
                total += struct.unpack(f"{order}II", inner)[1] if len(inner) == 8 else 0
            file.seek(after)
    return total
