"""HDF5 files of any layout, MATLAB 7.3 among them, which are read in parts."""

from collections.abc import Iterator
from pathlib import Path

from .arrays import NamedArrays
from .contents import Contents, Format, check_unpacked
from .facts import stated_unit

FORMAT = Format((".h5", ".hdf5", ".hdf"), library="h5py", isolated=True)

#: Error on a file whose only variables are objects.
MATLAB_OBJECT = (
    "holds a MATLAB object (table, timetable, datetime, function handle), which cannot be "
    "read: save its numbers, as by x = table2array(t), or the fields of a struct by "
    "save('-struct')"
)
_REFERENCES = (
    "holds a cell array or an array of structs of MATLAB 7.3, which cannot be read: save it "
    "by save('-v7'), or its elements as variables"
)
#: Groups in which MATLAB stores the elements of cell arrays and of arrays of structs.
_INTERNAL = ("#refs#", "#subsystem#")
#: Classes of MATLAB that are no channels.
_NO_CHANNELS = (b"char", b"logical")


def contents(path: Path, is_matlab: bool = False) -> Iterator[Contents]:
    """Return the channels of every numeric data set of more than one value.

    Parameters
    ----------
    path : Path
        The file. A channel has the name of the data set's path in it.
    is_matlab : bool
        Whether MATLAB wrote it: a struct is a group, its fields are separated by dots.
    """
    import h5py

    separator = "." if is_matlab else "/"
    with h5py.File(path, "r") as file:
        arrays = NamedArrays(file.__getitem__, separator)

        def add(address, node):
            # MATLAB stores a sparse matrix as three vectors.
            is_sparse = "MATLAB_sparse" in node.parent.attrs
            if not address.startswith(_INTERNAL) and not is_sparse:
                _add_node(arrays, address.replace("/", separator), node)

        arrays.add_properties("", file.attrs)
        # Each object is visited once, and no link is followed.
        file.visititems(add)
        yield arrays.contents()


def _add_node(arrays, name, node):
    """Add the properties of a group or a data set, and its samples."""
    import h5py

    attributes = dict(node.attrs)
    arrays.add_properties(name, attributes)
    # MATLAB stores texts, flags, objects, and the shapes of empty arrays as integers.
    kind = attributes.get("MATLAB_class", b"")
    is_signal = isinstance(node, h5py.Dataset) and node.shape is not None
    if "MATLAB_object_decode" in attributes:
        arrays.refused[name] = MATLAB_OBJECT
    elif not is_signal or "MATLAB_empty" in attributes or kind in _NO_CHANNELS:
        return
    elif h5py.check_ref_dtype(node.dtype) is h5py.Reference:
        arrays.refused[name] = _REFERENCES
    elif node.external or node.is_virtual:
        arrays.refused[name] = (
            f"data set {node.name!r} lies in other files, which are not followed"
        )
    else:
        check_unpacked(node.id.get_storage_size(), node.nbytes)
        unit = stated_unit(attributes)
        arrays.add(name, node.shape, node.dtype, key=node.name, unit=unit)
