"""TDMS files of LabVIEW, which are read in parts."""

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ._arrays import NamedArrays
from ._contents import ContentError, Contents, Format, is_numeric
from ._facts import stated_unit

FORMAT = Format((".tdms",), library="nptdms", isolated=True)

#: LabVIEW counts from 1904, and writes this if no date was set. NaT is not later
#: either.
_NO_DATE = np.datetime64("1904-01-02")
_SEPARATOR = "\0"


def contents(path: Path) -> Iterator[Contents]:
    """Return the channels by name, or by ``group/name`` if two groups have one of that name."""
    from nptdms import TdmsFile

    n_bytes = path.stat().st_size
    # Read from a file that is opened here, npTDMS does not look for an index next to
    # it.
    with path.open("rb") as stream, TdmsFile.open(stream) as file:
        channels = _by_name(file)
        arrays = NamedArrays(channels.__getitem__, _SEPARATOR)
        arrays.add_numbers("", file.properties)
        for group in file.groups():
            arrays.add_numbers(group.name, group.properties)
        for name, channel in channels.items():
            if len(channel) > 8 * n_bytes:
                raise ContentError(
                    f"{len(channel)} samples are stated in {n_bytes} bytes"
                )
            place = f"{channel.group_name}{_SEPARATOR}{name}"
            start = None
            arrays.add_numbers(place, channel.properties)
            unit = stated_unit(channel.properties)
            date = channel.properties.get("wf_start_time")
            if isinstance(date, np.datetime64) and date > _NO_DATE:
                start = float(date.astype("datetime64[us]").astype(float) / 1e6)
                start += arrays.scalars.get(f"{place}{_SEPARATOR}wf_start_offset", 0.0)
            arrays.add(name, (len(channel),), at=place, unit=unit, start=start)
        yield arrays.contents()


def _by_name(file):
    channels = [channel for group in file.groups() for channel in group.channels()]
    channels = [
        channel
        for channel in channels
        if channel.dtype is not None and is_numeric(channel.dtype)
    ]
    counts = Counter(channel.name for channel in channels)
    by_path = {f"{channel.group_name}/{channel.name}": channel for channel in channels}
    return {
        channel.name if counts[channel.name] == 1 else path: channel
        for path, channel in by_path.items()
    }
