"""TDMS files of LabVIEW, which are read in parts."""

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ._arrays import NamedArrays
from ._contents import ContentError, Contents, Format, is_numeric
from ._facts import letters

FORMAT = Format(
    "NI TDMS",
    (".tdms",),
    library="nptdms",
    isolated=True,
    states="rate (`wf_increment`, or a number named `fs` or alike), unit (`unit_string`) and date "
    "(`wf_start_time`)",
)

#: LabVIEW counts from 1904, and writes this if no date was set. NaT is not later either.
_NO_DATE = np.datetime64("1904-01-02")
_SEPARATOR = "\0"
_UNIT_NAMES = ("unitstring", "unit", "units", "niunitdescription")


def contents(path: Path) -> Iterator[Contents]:
    """Return the channels by name, or by ``group/name`` if two groups have one of that name."""
    from nptdms import TdmsFile

    n_bytes = path.stat().st_size
    # Read from a file that is opened here, npTDMS does not look for an index next to it.
    with path.open("rb") as stream, TdmsFile.open(stream) as file:
        channels = _by_name(file)
        arrays = NamedArrays(channels.__getitem__, _SEPARATOR)
        _add_numbers(arrays, file)
        for group in file.groups():
            _add_numbers(arrays, group, group.name)
        for name, channel in channels.items():
            if len(channel) > 8 * n_bytes:
                raise ContentError(f"{len(channel)} samples are stated in {n_bytes} bytes")
            _add_numbers(arrays, channel, channel.group_name, name)
            place = _SEPARATOR.join((channel.group_name, name))
            unit = start = None
            for key, value in channel.properties.items():
                if letters(key) in _UNIT_NAMES and value:
                    unit = str(value)
            date = channel.properties.get("wf_start_time")
            if isinstance(date, np.datetime64) and date > _NO_DATE:
                start = float(date.astype("datetime64[us]").astype(float) / 1e6)
                start += arrays.scalars.get(f"{place}{_SEPARATOR}wf_start_offset", 0.0)
            arrays.add(name, (len(channel),), place=place, unit=unit, start=start)
        yield arrays.contents()


def _by_name(file):
    channels = [
        channel
        for group in file.groups()
        for channel in group.channels()
        if channel.dtype is not None and is_numeric(channel.dtype)
    ]
    counts = Counter(channel.name for channel in channels)
    return {
        channel.name
        if counts[channel.name] == 1
        else f"{channel.group_name}/{channel.name}": channel
        for channel in channels
    }


def _add_numbers(arrays, node, *place):
    """Add the properties that are numbers, by their place in the file."""
    for key, value in node.properties.items():
        if isinstance(value, int | float | np.number) and not isinstance(value, bool):
            arrays.scalars[_SEPARATOR.join((*place, key))] = float(value)
