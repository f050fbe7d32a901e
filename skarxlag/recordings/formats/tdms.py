"""National Instruments' TDMS files, which are read in the chunks in which they were written."""

from contextlib import ExitStack
from pathlib import Path

import numpy as np

from ._contents import (
    ContentError,
    Contents,
    common_length,
    is_numeric,
    is_rate,
    letters,
    rechunked,
    rounded,
)

TITLE = "NI TDMS"
SUFFIXES = (".tdms",)
LIBRARY, EXTRA = "nptdms", "formats"
ISOLATED = True
IN_PARTS = True
STATES = "rate (`wf_increment`), unit (`unit_string`) and date (`wf_start_time`)"

#: LabVIEW counts from 1904, and writes this where no date was set. NaT is not later either.
_NO_DATE = np.datetime64("1904-01-02")


def contents(path: Path) -> Contents:
    """Channels by name, or by ``group/name`` where two groups have a channel of one name."""
    from nptdms import TdmsFile

    # Read from a file that is opened here, npTDMS does not look for an index beside it.
    with path.open("rb") as stream, TdmsFile.open(stream) as file:
        nodes = _by_name(file)
        lengths = {name: len(channel) for name, channel in nodes.items()}
        n_bytes = path.stat().st_size
        if any(length > 8 * n_bytes for length in lengths.values()):
            raise ContentError(f"{lengths} samples are stated in {n_bytes} bytes")
        rates, units, starts = {}, {}, {}
        for name, channel in nodes.items():
            step = channel.properties.get("wf_increment")
            if isinstance(step, float | np.floating) and is_rate(step) and is_rate(1 / step):
                rates[name] = rounded(1 / step, 1e-12)
                date = channel.properties.get("wf_start_time")
                if isinstance(date, np.datetime64) and date > _NO_DATE:
                    starts[name] = float(date.astype("datetime64[us]").astype(float) / 1e6)
                    offset = channel.properties.get("wf_start_offset")
                    starts[name] += offset if isinstance(offset, float | np.floating) else 0.0
            for key, value in channel.properties.items():
                if letters(key) in ("unitstring", "unit", "units", "niunitdescription") and value:
                    units[name] = str(value)

    def read(names, n_samples):
        n_total = common_length(lengths, names)
        with ExitStack() as stack:
            parts = []
            for name in names:
                # Each channel is read from its start to its end, so each has a file of its own.
                stream = stack.enter_context(path.open("rb"))
                channel = _by_name(stack.enter_context(TdmsFile.open(stream)))[name]
                chunks = (chunk[:] for chunk in channel.data_chunks())
                parts.append(rechunked(chunks, n_samples or max(n_total, 1)))
            n_read = 0
            for block in zip(*parts, strict=True):
                n_read += len(block[0])
                yield list(block)
        if n_read != n_total:
            raise ValueError(f"{n_read} samples of {n_total}")

    return Contents(list(nodes), read, rates, units, lengths, starts=starts)


def _by_name(file):
    nodes = [
        (group.name, channel)
        for group in file.groups()
        for channel in group.channels()
        if channel.dtype is not None and is_numeric(channel.dtype)
    ]
    names = [channel.name for _, channel in nodes]
    return {
        channel.name if names.count(channel.name) == 1 else f"{group}/{channel.name}": channel
        for group, channel in nodes
    }
