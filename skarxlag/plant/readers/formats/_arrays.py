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
    numbers : dict of str to number
        Single numbers by name, of which some state sampling rates and speeds.
    texts : dict of str to str
        Single texts by name, of which some state units.
    refused : dict of str to str
        Arrays that are not channels, and the reason.
    """

    def __init__(self, array_of: Callable[[Any], Any], separator: str = ".") -> None:
        self.numbers: dict[str, Any] = {}
        self.texts: dict[str, str] = {}
        self.refused: dict[str, str] = {}
        self._array_of = array_of
        self._separator = separator
        self._channels: dict[str, Channel] = {}
        self._paths: dict[str, str] = {}
        # By channel: the key of its array, the axis of time, and the index, in which
        # the samples replace the one of that axis.
        self._parts: dict[str, tuple[Any, int, list[int]]] = {}

    def add_properties(self, path: str, properties: Mapping[str, Any]) -> None:
        """Add the single numbers and texts among the properties of a path in the file."""
        for key, value in properties.items():
            name = f"{path}{self._separator}{key}" if path else key
            array = np.asarray(value)
            if array.size != 1:
                continue
            single = array.item()
            if is_numeric(array.dtype):
                self.numbers[name] = single
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
        path: str = "",
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
            If it is given, single numbers become `numbers`, and arrays that are not
            numeric are left out.
        key : object, default=None
            Passed to the function that returns the array. None takes `name`.
        path : str, default=""
            Path of the array among those of `numbers`. Empty takes `name`.
        **facts
            Of the channels, such as ``unit``, see `Channel`.
        """
        key = name if key is None else key
        if dtype is not None and (np.prod(shape) <= 1 or not is_numeric(dtype)):
            if np.prod(shape) == 1:
                self.add_properties("", {name: self._array_of(key)[()]})
            return
        if 0 in shape:
            # One channel without samples.
            shape = (0,)
        time = int(np.argmax(shape))
        across = [n for axis, n in enumerate(shape) if n > 1 and axis != time]
        if len(across) > 1 or shape[time] in across:
            self.refused[name] = (
                f"array {name!r} of shape {tuple(shape)}: expected a vector, or a "
                "matrix that is longer in time than in channels"
            )
            return
        channels = [name or "0"]
        if across:
            positions = range(across[0])
            channels = [f"{name}[{i}]" if name else str(i) for i in positions]
        for i, channel in enumerate(channels):
            index = [i if n in across else 0 for n in shape]
            self._channels[channel] = Channel(shape[time], **facts)
            self._parts[channel] = (key, time, index)
            # Numbers below the name of the array take precedence.
            self._paths[channel] = f"{path or name}{self._separator}{channel}"

    def contents(self) -> Contents:
        """Return the contents of the file."""
        state_facts(
            self._channels, self._paths, self.numbers, self.texts, self._separator
        )
        return Contents(self._channels, self._read, self.refused)

    def _read(self, names, n_samples):
        for samples in slices(self._channels[names[0]].length, n_samples):
            block = [self._samples(name, samples) for name in names]
            if any(len(values) != samples.stop - samples.start for values in block):
                raise ValueError(f"the samples end before sample {samples.stop}")
            yield block

    def _samples(self, name, samples):
        key, time, index = self._parts[name]
        array = self._array_of(key)
        if len(index) == 1:
            # Channels of TDMS files do not take a tuple.
            return array[samples]
        return array[(*index[:time], samples, *index[time + 1 :])]
