"""MATLAB files: up to version 7 by SciPy, whole; version 7.3 as the HDF5 files that they are."""

import struct
import warnings
import zlib
from pathlib import Path

import numpy as np
from scipy.io import loadmat
from scipy.io.matlab import mat_struct

from . import hdf5
from ._contents import Contents, array_contents, channels_or_refusal, is_numeric
from ._limits import check_unpacked

TITLE = "MATLAB up to version 7"
SUFFIXES = (".mat",)
LIBRARY = EXTRA = None
ISOLATED = True  # SciPy's compiled parser can crash or hang on a damaged file.
IN_PARTS = False  # Version 7.3 is read in parts.
STATES = "the rate, in a number named `fs` or alike"

_COMPRESSED = 15
_HDF5 = b"\x89HDF\r\n\x1a\n"


def contents(path: Path) -> Contents:
    """Channels of every numeric array of more than one value, by the name of the variable.

    Fields of a struct are ``struct.field``, and elements of an array of structs or of a cell array
    are ``name[0]``, ``name[1]``, ...
    """
    with path.open("rb") as file:
        head = file.read(520)
    # What early versions of MATLAB wrote as HDF5 does not call itself 7.3.
    if (head.startswith(b"MATLAB 7.3") and len(head) >= 512) or head[512:] == _HDF5:
        return hdf5.contents(path, is_matlab=True)
    check_unpacked(path, _unpacked_size(path))
    with warnings.catch_warnings():
        # Function handles and other objects that SciPy cannot read are no channels.
        warnings.simplefilter("ignore")
        variables = loadmat(path, appendmat=False, squeeze_me=False, struct_as_record=False)
    found = {}, {}, {}
    for name, values in variables.items():
        if not name.startswith("__"):
            _collect(name, values, found)
    return array_contents(*found)


def _collect(name, values, found):
    channels, scalars, refused = found
    if isinstance(values, mat_struct):
        for field in values._fieldnames:
            _collect(f"{name}.{field}", getattr(values, field), found)
    elif not isinstance(values, np.ndarray):
        return
    elif values.dtype == object:
        elements = values.ravel()
        for i, element in enumerate(elements):
            own = name if len(elements) == 1 else f"{name}[{i}]"
            _collect(own, element, found)
    elif is_numeric(values.dtype) and values.size == 1:
        scalars[name] = values.item()
    elif is_numeric(values.dtype) and values.size > 1:
        channels.update(channels_or_refusal(name, values, refused))


def _unpacked_size(path):
    """Bytes of all variables, from the tags of the elements, which are unpacked no further."""
    total, n_bytes = 0, path.stat().st_size
    with path.open("rb") as file:
        head = file.read(128)
        if len(head) < 128 or 0 in head[:4]:  # version 4, which is never compressed
            return n_bytes
        order = "<" if head[126:] == b"IM" else ">"
        while len(tag := file.read(8)) == 8:
            kind, size = struct.unpack(f"{order}II", tag)
            if kind == _COMPRESSED:
                inner = zlib.decompressobj().decompress(file.read(min(size, 4096)), 8)
                total += struct.unpack(f"{order}II", inner)[1] if len(inner) == 8 else 0
                file.seek(max(size - 4096, 0), 1)
            else:
                # What reaches beyond the end of the file is damage, which the reader will find.
                total += min(size, n_bytes)
                file.seek(size, 1)
    return total
