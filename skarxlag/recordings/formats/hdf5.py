"""HDF5 files of any layout, which are read in parts."""

from contextlib import contextmanager
from pathlib import Path

import numpy as np

from ._contents import (
    ContentError,
    Contents,
    array_blocks,
    channels_or_refusal,
    is_numeric,
    letters,
    stated_rates,
)
from ._matlab_nodes import INTERNAL, matlab_nodes

TITLE = "HDF5, MATLAB 7.3"
SUFFIXES = (".h5", ".hdf5", ".hdf")
LIBRARY, EXTRA = "h5py", "formats"
ISOLATED = True
IN_PARTS = True
STATES = "rate and unit, in attributes named `fs`, `units` or alike, or in single numbers"


def contents(path: Path, is_matlab: bool = False) -> Contents:
    """Channels of every numeric data set of more than one value, by its path in the file.

    Parameters
    ----------
    path : Path
        The file.
    is_matlab : bool
        Whether MATLAB wrote it: a struct is a group, and its fields have a dot.
    """
    separator = "." if is_matlab else "/"
    with _open(path) as file:
        channels, scalars, units, places, refused = {}, {}, {}, {}, {}
        for label, node in _nodes(file, is_matlab):
            for key, value in node.attrs.items():
                _note(f"{label}{separator}{key}" if label else key, value, scalars)
            if not hasattr(node, "shape") or not _is_signal(node):
                continue
            if node.size == 1:
                scalars[label] = np.ravel(node[()])[0].item()
                continue
            own = channels_or_refusal(label, node, refused)
            # A rate among the attributes of the data set itself comes first.
            places |= {channel: f"{label}{separator}{channel}" for channel in own}
            lengths = {channel: len(values) for channel, values in own.items()}
            channels |= lengths
            unit = _unit(node.attrs)
            units |= dict.fromkeys(own, unit) if unit else {}
        by_place = stated_rates(
            {place: channels[channel] for channel, place in places.items()}, scalars, separator
        )

    def read(names, n_samples):
        with _open(path) as file:
            found = {}
            for label, node in _nodes(file, is_matlab):
                if hasattr(node, "shape") and _is_signal(node) and node.size > 1:
                    found |= channels_or_refusal(label, node, {})
            yield from array_blocks(found, names, n_samples)

    return Contents(
        list(channels),
        read,
        sampling_rates={c: by_place[place] for c, place in places.items() if place in by_place},
        units=units,
        lengths=channels,
        refused=refused,
    )


@contextmanager
def _open(path):
    import h5py

    with h5py.File(path, "r") as file:
        yield file


def _nodes(file, is_matlab):
    """The root and all groups and data sets, those with a place of their own (not links) once."""
    if is_matlab:
        return matlab_nodes(file)
    found = [("", file)]

    def visit(name, node):
        # A file of MATLAB under another name.
        if not name.startswith(INTERNAL):
            found.append((name, node))

    file.visititems(visit)
    return found


def _is_signal(node):
    if node.dtype is None or node.shape is None or not is_numeric(node.dtype):
        return False
    if node.external:
        raise ContentError(f"data set {node.name!r} lies in another file, which is not followed")
    # MATLAB stores texts, flags, objects, and the shapes of empty arrays as integers and says so.
    if "MATLAB_object_decode" in node.attrs or "MATLAB_empty" in node.attrs:
        return False
    return node.attrs.get("MATLAB_class", b"") not in (b"char", b"logical", b"cell")


def _note(name, value, scalars):
    value = np.asarray(value)
    if is_numeric(value.dtype) and value.size == 1:
        scalars[name] = value.ravel()[0].item()


def _unit(attributes):
    for key, value in attributes.items():
        if letters(key) in ("unit", "units", "unitstring"):
            text = value.decode(errors="replace") if isinstance(value, bytes) else value
            return text if isinstance(text, str) else None
    return None
