"""TDMS files of LabVIEW, which are read in parts."""

from contextlib import ExitStack
from pathlib import Path

import numpy as np

from ._contents import ContentError, Contents, common_length, is_numeric, joined_streams
from ._facts import letters, stated_rates, stated_speeds

TITLE = "NI TDMS"
SUFFIXES = (".tdms",)
LIBRARY, EXTRA = "nptdms", "formats"
ISOLATED = True
IN_PARTS = True
STATES = (
    "rate (`wf_increment`, or a number named `fs` or alike), unit (`unit_string`) and date "
    "(`wf_start_time`)"
)

#: LabVIEW counts from 1904, and writes this if no date was set. NaT is not later either.
_NO_DATE = np.datetime64("1904-01-02")
_SEPARATOR = "\0"


def contents(path: Path) -> Contents:
    """Return the channels by name, or by ``group/name`` if two groups have one of that name."""
    from nptdms import TdmsFile

    # Read from a file that is opened here, npTDMS does not look for an index next to it.
    with path.open("rb") as stream, TdmsFile.open(stream) as file:
        nodes = _by_name(file)
        lengths = {name: len(channel) for name, channel in nodes.items()}
        n_bytes = path.stat().st_size
        if any(length > 8 * n_bytes for length in lengths.values()):
            raise ContentError(f"{lengths} samples are stated in {n_bytes} bytes")
        scalars, units, starts = _numbers(file.properties), {}, {}
        for group in file.groups():
            scalars |= _numbers(group.properties, group.name)
        for name, channel in nodes.items():
            scalars |= _numbers(channel.properties, channel.group_name, name)
            date = channel.properties.get("wf_start_time")
            if isinstance(date, np.datetime64) and date > _NO_DATE:
                starts[name] = float(date.astype("datetime64[us]").astype(float) / 1e6)
                starts[name] += _numbers(channel.properties).get("wf_start_offset", 0.0)
            for key, value in channel.properties.items():
                if letters(key) in ("unitstring", "unit", "units", "niunitdescription") and value:
                    units[name] = str(value)
        places = {
            _SEPARATOR.join((channel.group_name, name, "")): name for name, channel in nodes.items()
        }
    by_place = {place: lengths[name] for place, name in places.items()}
    rates, speeds = (
        {places[place]: value for place, value in find(by_place, scalars, _SEPARATOR).items()}
        for find in (stated_rates, stated_speeds)
    )

    def read(names, n_samples):
        n_total = common_length(lengths, names)
        with ExitStack() as stack:
            streams = []
            for name in names:
                # Each channel is read from its start to its end, so each has a file of its own.
                stream = stack.enter_context(path.open("rb"))
                channel = _by_name(stack.enter_context(TdmsFile.open(stream)))[name]
                streams.append(chunk[:] for chunk in channel.data_chunks())
            n_read = 0
            for block in joined_streams(streams, n_samples or max(n_total, 1)):
                n_read += len(block[0])
                yield block
        if n_read != n_total:
            raise ValueError(f"{n_read} samples of {n_total}")

    return Contents(list(nodes), read, rates, units, lengths, starts=starts, speeds=speeds)


def _by_name(file):
    channels = [
        channel
        for group in file.groups()
        for channel in group.channels()
        if channel.dtype is not None and is_numeric(channel.dtype)
    ]
    names = [channel.name for channel in channels]
    return {
        channel.name
        if names.count(channel.name) == 1
        else f"{channel.group_name}/{channel.name}": channel
        for channel in channels
    }


def _numbers(properties, *place):
    """Properties that are numbers, by their place in the file."""
    return {
        _SEPARATOR.join((*place, key)): float(value)
        for key, value in properties.items()
        if isinstance(value, int | float | np.number) and not isinstance(value, bool)
    }
