"""TDMS files of LabVIEW, which are read in parts."""

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from .arrays import NamedArrays
from .contents import ContentError, Contents, Format, is_numeric
from .facts import stated_unit

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
        arrays.add_properties("", file.properties)
        for group in file.groups():
            arrays.add_properties(group.name, group.properties)
        for name, channel in channels.items():
            if len(channel) > 8 * n_bytes:
                raise ContentError(
                    f"{len(channel)} samples are stated in {n_bytes} bytes"
                )
            channel_path = f"{channel.group_name}{_SEPARATOR}{name}"
            arrays.add_properties(channel_path, channel.properties)
            arrays.add(
                name,
                (len(channel),),
                path=channel_path,
                unit=stated_unit(channel.properties),
                start=_start(channel.properties),
            )
        yield arrays.contents()


def _start(properties):
    """Return the seconds since 1970 at the first sample, None if no date was set."""
    date = properties.get("wf_start_time")
    if not isinstance(date, np.datetime64) or not date > _NO_DATE:
        return None
    seconds = float(date.astype("datetime64[us]").astype(float) / 1e6)
    return seconds + properties.get("wf_start_offset", 0.0)


def _by_name(file):
    channels = [
        channel
        for group in file.groups()
        for channel in group.channels()
        if channel.dtype is not None and is_numeric(channel.dtype)
    ]
    counts = Counter(channel.name for channel in channels)
    by_path = {f"{channel.group_name}/{channel.name}": channel for channel in channels}
    return {
        channel.name if counts[channel.name] == 1 else path: channel
        for path, channel in by_path.items()
    }
