"""What MATLAB 7.3 keeps in an HDF5 file: cell arrays and arrays of structs are references."""

from collections.abc import Iterator
from typing import Any

import numpy as np

#: Where MATLAB keeps what the references lead to, and its classes.
INTERNAL = ("#refs#", "#subsystem#")
#: How deep a damaged file may lead, and to how many data sets.
_DEEPEST, _MOST_NODES = 20, 200_000


def matlab_nodes(file: Any) -> list[tuple[str, Any]]:
    """Groups and data sets by the path that MATLAB shows, with dots between the parts.

    Elements of a cell array are ``name[0]``, ``name[1]``, ..., row by row, as are those of an array
    of structs; of one element the name stays as it is. Sparse matrices, objects and links are left
    out.

    Parameters
    ----------
    file : h5py.File
        The file.

    Returns
    -------
    list of tuple of (str, h5py.HLObject)
        In the order of the file; data sets of references are not among them.
    """
    found, seen = [], set()

    def walk(name, node, depth):
        if depth > _DEEPEST or len(found) > _MOST_NODES:
            return
        if _is_reference(node):
            for own, element in _elements(file, name, node):
                walk(own, element, depth + 1)
            return
        found.append((name, node))
        if hasattr(node, "shape") or "MATLAB_sparse" in node.attrs or node.id in seen:
            return
        # Links in a circle would have no end.
        seen.add(node.id)
        for key in node:
            if key not in INTERNAL and _is_own(node, key):
                child = node[key]
                if name and _is_reference(child) and "MATLAB_class" not in child.attrs:
                    for own, element in _elements(file, name, child):
                        walk(f"{own}.{key}", element, depth + 1)
                else:
                    walk(f"{name}.{key}" if name else key, child, depth + 1)

    walk("", file, 0)
    return found


def _is_reference(node):
    import h5py

    return hasattr(node, "shape") and h5py.check_ref_dtype(node.dtype) is h5py.Reference


def _is_own(group, key):
    import h5py

    return isinstance(group.get(key, getlink=True), h5py.HardLink)


def _elements(file, name, node) -> Iterator[tuple[str, Any]]:
    """What a data set of references leads to; MATLAB writes columns first."""
    if "MATLAB_object_decode" in node.attrs or node.size > _MOST_NODES:
        return
    references = np.transpose(node[()]).ravel() if node.shape else [node[()]]
    for i, reference in enumerate(references):
        if reference:
            yield (name if len(references) == 1 else f"{name}[{i}]"), file[reference]
