"""HDF5 files of any layout, MATLAB 7.3 among them, which are read in parts."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from .arrays import NamedArrays
from .contents import ContentError, Contents, Format, check_unpacked
from .facts import stated_unit

FORMAT = Format((".h5", ".hdf5", ".hdf"), library="h5py", isolated=True)

#: Groups in which MATLAB stores the elements of cell arrays and of arrays of structs.
#: Error on a file whose only variables are objects.
MATLAB_OBJECT = (
    "holds a MATLAB object (table, timetable, datetime, function handle), which cannot be "
    "read: save its numbers, as by x = table2array(t), or the fields of a struct by "
    "save('-struct')"
)
_INTERNAL = ("#refs#", "#subsystem#")
#: Bounds on the work that a damaged or hostile file can cause.
_DEEPEST = 20
_MOST_NODES = 200_000


def contents(path: Path, is_matlab: bool = False) -> Iterator[Contents]:
    """Return the channels of every numeric data set of more than one value.

    Parameters
    ----------
    path : Path
        The file. A channel has the name of the data set's path in it.
    is_matlab : bool
        Whether MATLAB wrote it: a struct is a group, its fields are separated by dots,
        and cell arrays and arrays of structs are references.
    """
    import h5py

    separator = "." if is_matlab else "/"
    with h5py.File(path, "r") as file:
        arrays = NamedArrays(file.__getitem__, separator)
        for name, node in _nodes(file, is_matlab):
            attributes = dict(node.attrs)
            arrays.add_properties(name, attributes)
            if "MATLAB_object_decode" in attributes:
                arrays.refused[name] = MATLAB_OBJECT
            if not isinstance(node, h5py.Dataset) or not _is_signal(node, attributes):
                continue
            if node.external or node.is_virtual:
                arrays.refused[name] = (
                    f"data set {node.name!r} lies in other files, which are not followed"
                )
            else:
                check_unpacked(node.id.get_storage_size(), node.nbytes)
                unit = stated_unit(attributes)
                arrays.add(name, node.shape, node.dtype, key=node.name, unit=unit)
        yield arrays.contents()


def _nodes(file, is_matlab):
    """Yield the file, and all groups and data sets in it, with their names; no links."""
    import h5py

    seen = set()
    # Paths and references of nodes that wait: open nodes take kilobytes each.
    waiting: list[tuple[str, Any, int]] = [("", "/", 0)]
    while waiting:
        name, address, depth = waiting.pop()
        if depth > _DEEPEST or len(seen) > _MOST_NODES:
            raise ContentError(
                f"groups are nested more than {_DEEPEST} deep, or over {_MOST_NODES}"
            )
        node = file[address]
        info = h5py.h5o.get_info(node.id)
        if (info.fileno, info.addr) not in seen:
            seen.add((info.fileno, info.addr))
            yield name, node
            below = _below(name, node, is_matlab)
            deeper = [(inner, child, depth + 1) for inner, child in below]
            waiting += reversed(deeper)


def _below(name, node, is_matlab):
    """Yield the names and addresses of the nodes directly below a node.

    Elements of a MATLAB cell array are ``name[0]``, ``name[1]``, ..., row by row, as
    are those of an array of structs; of one element the name stays as it is.
    """
    import h5py

    def is_reference(node):
        is_set = is_matlab and isinstance(node, h5py.Dataset)
        return is_set and h5py.check_ref_dtype(node.dtype) is h5py.Reference

    def elements(node):
        if "MATLAB_object_decode" in node.attrs or node.size > _MOST_NODES:
            return
        # MATLAB writes columns first.
        references = np.transpose(node[()]).ravel() if node.shape else [node[()]]
        for i, reference in enumerate(references):
            if reference:
                inner = name if len(references) == 1 else f"{name}[{i}]"
                yield inner, reference

    if is_reference(node):
        yield from elements(node)
    elif isinstance(node, h5py.Group) and "MATLAB_sparse" not in node.attrs:
        separator = "." if is_matlab else "/"
        for key in node:
            if key in _INTERNAL or not isinstance(
                node.get(key, getlink=True), h5py.HardLink
            ):
                continue
            inner = f"{name}{separator}{key}" if name else key
            if name and is_matlab:
                below = node[key]
                if is_reference(below) and "MATLAB_class" not in below.attrs:
                    for struct, element in elements(below):
                        yield f"{struct}.{key}", element
                    continue
            yield inner, f"{node.name}/{key}"


def _is_signal(node, attributes):
    # MATLAB stores texts, flags, objects, and the shapes of empty arrays as integers.
    if node.shape is None or {"MATLAB_object_decode", "MATLAB_empty"} & {*attributes}:
        return False
    return attributes.get("MATLAB_class", b"") not in (b"char", b"logical", b"cell")
