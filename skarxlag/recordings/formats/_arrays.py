"""Files of named arrays: which arrays are channels, and how these are read."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from typing import Any

from ._contents import Contents, common_length, slices
from ._facts import stated_rates, stated_speeds


class NamedArrays:
    """Channels, single numbers and units found in a file of arrays.

    Parameters
    ----------
    separator : str, default="."
        Between the parts of a name.

    Attributes
    ----------
    scalars : dict of str to number
        Single numbers by name, of which some state sampling rates and speeds.
    """

    def __init__(self, separator: str = ".") -> None:
        self.scalars: dict[str, Any] = {}
        self._separator = separator
        self._lengths, self._units, self._refused = {}, {}, {}
        self._places, self._parts = {}, {}

    def add(
        self, name: str, shape: Sequence[int], *, key: str | None = None, unit: str | None = None
    ) -> None:
        """Add an array, whose rows or columns, whichever are longer, are channels.

        Parameters
        ----------
        name : str
            Name of the array. The channels of a matrix are ``name[0]``, ``name[1]``, ...; without
            a name they are ``0``, ``1``, ...
        shape : sequence of int
            One dimension or more.
        key : str, default=None
            Passed to the function that reads the array. None takes `name`.
        unit : str, default=None
            Of the samples.
        """
        long = [axis for axis, size in enumerate(shape) if size != 1]
        if len(long) > 2 or (len(long) == 2 and shape[long[0]] == shape[long[1]]):
            self.refuse(
                name,
                f"array {name!r} of shape {tuple(shape)}: expected a vector, or a matrix that is "
                "longer in time than in channels",
            )
            return
        index: list[int | None] = [0] * len(shape)
        if len(long) < 2 or 0 in shape:
            time = shape.index(0) if 0 in shape else max(long, default=0)
            across, names = None, [name or "0"]
        else:
            time, across = sorted(long, key=lambda axis: -shape[axis])
            names = [f"{name}[{i}]" if name else str(i) for i in range(shape[across])]
        index[time] = None
        for i, channel in enumerate(names):
            if across is not None:
                index[across] = i
            self._lengths[channel] = shape[time]
            self._parts[channel] = (name if key is None else key, tuple(index))
            # A number with the name of the array in front comes before all others.
            self._places[channel] = f"{name}{self._separator}{channel}"
            if unit:
                self._units[channel] = unit

    def refuse(self, name: str, reason: str) -> None:
        """Note why an array is not a channel."""
        self._refused[name] = reason

    def contents(
        self, opened: Callable[[], AbstractContextManager[Callable[[str], Any]]]
    ) -> Contents:
        """Return the contents of the file.

        Parameters
        ----------
        opened : callable
            Returns a context manager of a function from keys to arrays, which are sliced.
        """
        channel_at = {place: channel for channel, place in self._places.items()}
        lengths = {place: self._lengths[channel] for place, channel in channel_at.items()}
        rates = stated_rates(lengths, self.scalars, self._separator)
        speeds = stated_speeds(lengths, self.scalars, self._separator)

        def read(names, n_samples):
            n_total = common_length(self._lengths, names)
            with opened() as array_of:
                for part in slices(n_total, n_samples):
                    yield [
                        array_of(key)[tuple(part if i is None else i for i in index)]
                        for key, index in map(self._parts.__getitem__, names)
                    ]

        return Contents(
            list(self._lengths),
            read,
            {channel_at[place]: rate for place, rate in rates.items()},
            self._units,
            self._lengths,
            self._refused,
            speeds={channel_at[place]: speed for place, speed in speeds.items()},
        )
