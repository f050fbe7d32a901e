"""Find the channels in files of named arrays, and read them."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ._contents import Channel, Contents, is_numeric, slices
from ._facts import state_facts


class NamedArrays:
    """Channels, single numbers and units found in a file of arrays.

    Parameters
    ----------
    array_of : callable
        Returns the array of a key, which is sliced. It is called for each block.
    separator : str, default="."
        Between the parts of a name.

    Attributes
    ----------
    scalars : dict of str to number
        Single numbers by name, of which some state sampling rates and speeds.
    texts : dict of str to str
        Single texts by name, of which some state units.
    refused : dict of str to str
        Arrays that are not channels, and the reason.
    """

    def __init__(self, array_of: Callable[[Any], Any], separator: str = ".") -> None:
        self.scalars: dict[str, Any] = {}
        self.texts: dict[str, str] = {}
        self.refused: dict[str, str] = {}
        self._array_of = array_of
        self._separator = separator
        self._channels: dict[str, Channel] = {}
        self._places: dict[str, str] = {}
        self._parts: dict[str, tuple[Any, list[int | None]]] = {}

    def add_numbers(self, place: str, properties: Mapping[str, Any]) -> None:
        """Add the single numbers and texts among the properties of a place in the file."""
        for key, value in properties.items():
            name = f"{place}{self._separator}{key}" if place else key
            array = np.asarray(value)
            if array.size != 1:
                continue
            single = array.item()
            if is_numeric(array.dtype):
                self.scalars[name] = single
            elif isinstance(single, str):
                self.texts[name] = single
            elif isinstance(single, bytes):
                self.texts[name] = single.decode(errors="replace")

    def add(
        self,
        name: str,
        shape: Any,
        dtype: Any = None,
        key: Any = None,
        at: str = "",
        **facts: Any,
    ) -> None:
        """Add an array, whose rows or columns, whichever are longer, are channels.

        Parameters
        ----------
        name : str
            Name of the array. The channels of a matrix are ``name[0]``, ``name[1]``,
            ...; without a name they are ``0``, ``1``, ...
        shape : sequence of int
            One dimension or more.
        dtype : dtype or None
            If it is given, single numbers become scalars, and arrays that are not
            numeric are left out.
        key : object, default=None
            Passed to the function that returns the array. None takes `name`.
        at : str, default=""
            Place of the array among those of `scalars`. Empty takes `name`.
        **facts
            Of the channels, such as ``unit``, see `Channel`.
        """
        key = name if key is None else key
        if dtype is not None and (np.prod(shape) <= 1 or not is_numeric(dtype)):
            if np.prod(shape) == 1:
                self.add_numbers("", {name: self._array_of(key)[()]})
            return
        long = [axis for axis, size in enumerate(shape) if size != 1]
        if len(long) > 2 or (len(long) == 2 and shape[long[0]] == shape[long[1]]):
            self.refused[name] = (
                f"array {name!r} of shape {tuple(shape)}: expected a vector, or a "
                "matrix that is longer in time than in channels"
            )
            return
        time = max(long, key=lambda axis: shape[axis], default=0)
        if 0 in shape:
            time = shape.index(0)
        across = [axis for axis in long if axis != time and 0 not in shape]
        names = [name or "0"]
        if across:
            positions = range(shape[across[0]])
            names = [f"{name}[{i}]" if name else str(i) for i in positions]
        for i, channel in enumerate(names):
            index: list[int | None] = [
                i if axis in across else 0 for axis in range(len(shape))
            ]
            index[time] = None
            self._channels[channel] = Channel(shape[time], **facts)
            self._parts[channel] = (key, index)
            # Numbers below the name of the array take precedence.
            self._places[channel] = f"{at or name}{self._separator}{channel}"

    def contents(self) -> Contents:
        """Return the contents of the file."""
        state_facts(
            self._channels, self._places, self.scalars, self._separator, self.texts
        )
        return Contents(self._channels, self._read, self.refused)

    def _read(self, names, n_samples):
        for part in slices(self._channels[names[0]].length, n_samples):
            block = []
            for key, index in map(self._parts.__getitem__, names):
                place = tuple(part if i is None else i for i in index)
                block.append(self._array_of(key)[place if len(place) > 1 else part])
                if len(block[-1]) != part.stop - part.start:
                    raise ValueError(f"the samples end before sample {part.stop}")
            yield block
