"""MATLAB files: up to version 7 by SciPy; version 7.3 as the HDF5 files that they are."""

import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from . import hdf5
from .arrays import NamedArrays
from .contents import Contents, Format

# SciPy's compiled parser can crash or hang on a damaged file.
FORMAT = Format((".mat",), isolated=True)

#: Classes of MATLAB that are no channels, or hold them.
_NO_CHANNELS = ("char", "logical", "sparse", "cell", "struct")
#: Classes that SciPy does not read.
_OBJECTS = ("opaque", "object", "function", "unknown")
_HDF5 = b"\x89HDF\r\n\x1a\n"


def contents(path: Path) -> Iterator[Contents]:
    """Return the channels of every numeric array of more than one value.

    A channel has the name of its variable. Fields of a struct are ``struct.field``, and
    elements of an array of structs or of a cell array are ``name[0]``, ``name[1]``, ...
    """
    from scipy.io import whosmat

    with path.open("rb") as file:
        head = file.read(520)
        # HDF5 files of early versions of MATLAB do not state version 7.3.
        is_hdf5 = head.startswith(b"MATLAB 7.3") and len(head) >= 512
        if is_hdf5 or head[512:] == _HDF5:
            yield from hdf5.contents(path, is_matlab=True)
            return
        loaded: dict[str, Any] = {}

        def array_of(name):
            # The samples of a variable are not loaded before it is chosen.
            if name not in loaded:
                loaded.update(_variables(file, [name]))
            return loaded[name]

        arrays = NamedArrays(array_of)
        for variable, shape, kind in whosmat(file):
            if variable.startswith("__") or kind in _OBJECTS:
                arrays.refused[""] = hdf5.MATLAB_OBJECT
            elif kind not in _NO_CHANNELS and np.prod(shape) > 1:
                arrays.add(variable, shape, kind)
            else:
                values = _variables(file, [variable])[variable]
                for name, element in _arrays(variable, values):
                    loaded[name] = element
                    arrays.add(name, element.shape, element.dtype)
        yield arrays.contents()


def _variables(file, names):
    """Load variables by name."""
    from scipy.io import loadmat

    with warnings.catch_warnings():
        # Function handles and other objects that SciPy cannot read are not channels.
        warnings.simplefilter("ignore")
        return loadmat(file, variable_names=names, struct_as_record=False)


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
